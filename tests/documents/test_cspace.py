"""`cockpit cspace` writes what it says; cells agree with direct checks of every pair of boxes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from program import cockpit

STATE: dict[str, Any] = {
    "machines": {
        "left": {
            "model": "mini",
            "position": [308611.05, 4129957.348, 0.0],
            "yaw": 0.3,
            "pitch": 0.05,
            "joints": {"swing": 0.1, "boom": 0.5, "stick": -1.0, "bucket": 0.5},
            "sigma": {"position": 0.02, "yaw": 0.005, "joints": 0.003},
        },
        "right": {
            "model": "ex13",
            "position": [308616.05, 4129957.348, 0.0],
            "yaw": 1.0,
            "joints": {"swing": 2.1, "boom": 0.5, "stick": -1.0, "bucket": -0.5},
        },
    },
    "obstacles": [
        {
            "name": "pole",
            "center": [308611.05, 4129961.0, 1.0],
            "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "half_extents": [0.1, 0.1, 3],
        }
    ],
}


@pytest.fixture
def state(tmp_path: Path) -> Path:
    path = tmp_path / "state.json"
    path.write_text(json.dumps(STATE))
    return path


def written(state: Path, *options: str) -> tuple[dict[str, Any], Any]:
    out = state.with_name("image.npz")
    done = cockpit("cspace", "--state", str(state), "--out", str(out), "--json", *options)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, json.loads(cockpit("schema", "cspace").stdout))
    return document, np.load(out, allow_pickle=False)


def bodies_at(state: Path, q: np.ndarray) -> dict[str, Any]:
    """What `assess` says of the same scene with the machine at joint values q."""
    moved = json.loads(state.read_text())
    roles = ("swing", "boom", "stick", "bucket")
    moved["machines"]["left"]["joints"] = dict(zip(roles, q.tolist(), strict=True))
    path = state.with_name("moved.json")
    path.write_text(json.dumps(moved))
    done = cockpit("assess", "--state", str(path), "--all")
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def test_joint4_has_the_arrays_of_the_contract(state: Path) -> None:
    shape = (9, 8, 7, 6)
    document, image = written(
        state, "--machine", "left", "--shape", "9,8,7,6", "--certified", "--layers"
    )
    assert image["colliding"].shape == shape
    assert image["colliding"].dtype == np.uint8
    for k, n in enumerate(shape):
        centers, edges = image[f"axis_{k}"], image[f"edge_{k}"]
        assert (len(centers), len(edges)) == (n, n + 1)
        np.testing.assert_allclose(centers, 0.5 * (edges[1:] + edges[:-1]))
    assert image["axis_names"].tolist() == ["swing", "boom", "stick", "bucket"]
    assert image["axis_units"].tolist() == ["rad"] * 4
    layers = [image[f"layer_{name}"] for name in ("partner", "site", "self")]
    np.testing.assert_array_equal(np.any(layers, axis=0), image["colliding"].astype(bool))
    free, hit = image["certified_free"], image["certified_colliding"]
    assert free.dtype == hit.dtype == bool
    assert not (free & hit).any()
    assert not (free & image["colliding"].astype(bool)).any()
    assert image["colliding"].astype(bool)[hit].all()
    assert document["undecided"] == pytest.approx((~free & ~hit).mean())
    assert float(image["eta"]) == pytest.approx(document["eta"])
    assert document["eta"] > 0.06  # 3 sigma of the position alone


def test_cells_are_what_direct_distances_say(state: Path) -> None:
    _, image = written(state, "--machine", "left", "--shape", "12,6,6,6", "--layers")
    rng = np.random.default_rng(3)
    hit = image["layer_partner"].astype(bool)
    chosen = np.concatenate([rng.permutation(np.argwhere(hit == v))[:6] for v in (False, True)])
    seen = set()
    for index in chosen:
        q = np.array([image[f"axis_{k}"][i] for k, i in enumerate(index)])
        result = bodies_at(state, q)
        touches = min(row["distance"] for row in result["closest"]) <= 0.0
        assert touches == bool(hit[tuple(index)])
        seen.add(touches)
    assert seen == {False, True}


def test_joint3_is_the_present_swing(state: Path) -> None:
    document, image = written(state, "--machine", "left", "--kind", "joint3", "--shape", "5,6,7")
    assert image["colliding"].shape == (5, 6, 7)
    assert document["swing"] == pytest.approx(0.1)
    assert [axis["name"] for axis in document["axes"]] == ["boom", "stick", "bucket"]


def test_ground_blocks_what_is_below_the_tracks(state: Path) -> None:
    shape = ("--machine", "left", "--kind", "joint3", "--shape", "12,12,12", "--layers")
    _, without = written(state, *shape)
    free = without["colliding"].astype(bool)
    _, image = written(state, *shape, "--ground")
    below = image["layer_ground"].astype(bool)
    assert below.any()
    assert not below.all()  # the tracks stand on it
    np.testing.assert_array_equal(image["colliding"].astype(bool), free | below)


def test_reach_says_what_a_cell_is(state: Path) -> None:
    document, image = written(
        state, "--machine", "left", "--kind", "reach", "--shape", "36,30", "--layers"
    )
    assert image["state"].shape == (36, 30)
    assert set(np.unique(image["state"]).tolist()) <= {0, 1, 2, 3}
    assert image["axis_units"].tolist() == ["rad", "m"]
    hit = np.any([image[f"layer_{n}"] for n in ("partner", "site", "self")], axis=0)
    np.testing.assert_array_equal(hit, image["state"] == 1)
    _, high = written(
        state, "--machine", "left", "--kind", "reach", "--shape", "36,30", "--height", "9"
    )
    assert (high["state"] == 2).all()
    assert document["height"] is not None


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--machine", "middle"), "allowed are left, right"),
        (("--machine", "left", "--shape", "3,3"), "does not fit joint4"),
        (("--machine", "left", "--shape", "3,x"), "is not a shape"),
        (("--machine", "left", "--kind", "joint5"), "allowed are joint4, joint3, reach"),
        (("--machine", "left", "--kind", "reach", "--certified"), "does not go with"),
        (("--machine", "left", "--height", "1"), "--kind reach only"),
    ],
)
def test_mistakes_are_one_sentence(state: Path, options: tuple[str, ...], said: str) -> None:
    out = str(state.with_name("image.npz"))
    done = cockpit("cspace", "--state", str(state), "--out", out, *options)
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_margins_of_assess_end_in_contact(state: Path) -> None:
    done = cockpit("assess", "--state", str(state))
    result = json.loads(done.stdout)
    jsonschema.validate(result, json.loads(cockpit("schema", "assess").stdout))
    margins = result["margins"]["left"]
    assert set(margins) == {"swing", "boom", "stick", "bucket"}
    met = 0
    for k, role in enumerate(("swing", "boom", "stick", "bucket")):
        for sign, way in ((-1.0, "negative"), (1.0, "positive")):
            certified = margins[role]["certified"]
            assert certified[way] <= margins[role][way] + 1e-6
            if not (margins[role][f"{way}_hits"] or "").startswith("right:"):
                continue
            met += 1
            q = np.array([0.1, 0.5, -1.0, 0.5])
            q[k] += sign * (margins[role][way] - 1e-3)
            before = min(row["distance"] for row in bodies_at(state, q)["closest"])
            q[k] += sign * 2e-3
            after = min(row["distance"] for row in bodies_at(state, q)["closest"])
            assert after <= 0.0 < before < 0.02
    assert met >= 2
