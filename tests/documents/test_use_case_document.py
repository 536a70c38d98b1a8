"""`cockpit use-case`: its document, its words and what it refuses."""

from __future__ import annotations

import json

import jsonschema
import numpy as np
import pytest
from program import cockpit

from backend.documents.use_case import poses
from backend.spatial import rotation, transform
from cockpit.schemas import SCHEMAS


def test_json_follows_its_schema_and_every_series_has_every_instant() -> None:
    done = cockpit("use-case", "pole", "--method", "scaling", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, SCHEMAS["use-case"][0].model_json_schema())
    assert (document["upper"], document["lower"]) == (0.8, 0.2)
    assert document["roles"] == ["swing", "boom", "stick", "bucket", "tilt", "rotate"]
    assert [box["name"] for box in document["limits"]] == ["pole"]
    (run,) = document["runs"]
    count = round(document["seconds"] / document["step"])
    lists = {name: len(value) for name, value in run.items() if isinstance(value, list)}
    assert lists.pop("pairs") == 1
    assert set(lists.values()) == {count}
    k = int(np.argmin(run["distance"]))
    assert run["nearest"]["distance"] == pytest.approx(run["distance"][k], abs=1e-4)
    assert run["nearest"]["time"] == pytest.approx(run["times"][k])
    # The speeds lead from one posture to the next.
    q, rates = np.array(run["joints"]), np.array(run["rates"])
    np.testing.assert_allclose(np.diff(q, axis=0), rates[:-1] * document["step"], atol=3e-5)
    off = np.linalg.norm(np.subtract(run["tool"], run["designed"])[:, :3], axis=1)
    np.testing.assert_allclose(off, run["error"], atol=2e-4)
    assert not run["limited"][0]
    assert run["limited"][k - 1]


def test_all_methods_stand_beside_each_other() -> None:
    done = cockpit("use-case", "pole")
    assert done.returncode == 0, done.stderr
    head, _, *rows = done.stdout.splitlines()
    assert "Figs. 4.2-4.4" in head
    methods = ("no limit", "velocity scaling", "potential field", "constrained")
    assert [row[2:19].strip() for row in rows] == list(methods)
    assert all("to pole" in row for row in rows)


def test_angles_of_the_tool_do_not_jump() -> None:
    yaw = np.radians([170.0, 178.0, -176.0, -170.0])
    T = np.array([transform.make(rotation.rz(a), np.ones(3)) for a in yaw])
    found = poses(T)
    np.testing.assert_allclose(np.degrees(found[:, 3]), [170.0, 178.0, 184.0, 190.0])
    np.testing.assert_allclose(found[:, :3], 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("bridge",), 'use case "bridge" is not known; allowed are pole, ballast.'),
        (("pole", "--method", "magic"), 'method "magic" is not known; allowed are none, scaling'),
    ],
)
def test_mistakes_are_one_sentence(arguments: tuple[str, ...], message: str) -> None:
    done = cockpit("use-case", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
