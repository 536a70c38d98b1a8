"""`cockpit surmount` and its documents."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from surmounting import STEPS
from typer.testing import CliRunner

from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_side import base_poses
from backend.errors import InputError
from backend.machine.kinematics import end_point
from backend.machine.load import load_machine
from cockpit.cli import app

RUNNER = CliRunner()


def task(name: str = "shovel", **more: Any) -> dict[str, Any]:
    away = {"shovel": 0.4, "mini": 2.4, "ex13": 5.5}[name]
    machine = {
        "model": name,
        "position": [10.0, 20.0, 0.0],
        "yaw": 0.5,
        "joints": {"swing": 0.0, "boom": 0.8, "stick": -1.5, "bucket": -0.5},
    }
    return {
        "state": {"frame": "site", "machines": {"one": machine}},
        "machine": "one",
        "edges": [{"distance": away, "rise": STEPS[name]}],
        "effort": "quick",
        **more,
    }


def surmounted(tmp_path: Path, asked: dict[str, Any], *options: str) -> dict[str, Any]:
    path = tmp_path / "task.json"
    path.write_text(json.dumps(asked))
    result = RUNNER.invoke(app, ["surmount", str(path), "--json", *options])
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_the_document_of_the_shovel(tmp_path: Path) -> None:
    made = surmounted(tmp_path, task())
    jsonschema.validate(made, SurmountDocument.model_json_schema())
    assert made["ok"], made["why"]
    rows = len(made["time"])
    for name in ("joints", "joint_velocities", "tracks", "base", "end_point"):
        assert len(made[name]) == rows
    assert made["duration"] == made["time"][-1]
    assert [p["name"] for p in made["phases"]] == [
        *("drive", "reach", "sequence 1", "turn", "sequence 2-1", "sequence 2-2", "stow")
    ]
    assert made["energy"] > made["energy_quasi_static"] > 0.999 * made["energy_potential"] > 0.0
    assert sum(c["chosen"] for c in made["candidates"]) == 1
    assert made["checks"]["max_penetration"] < 1e-3
    assert made["checks"]["max_slip"] < 5e-3
    assert made["checks"]["min_stability_margin"] > 0.0
    assert any("0.033 m" in one for one in made["assumptions"])
    assert any("assumed" in one for one in made["assumptions"])
    # Rows agree with each other: positions are those of the base, and rates those of the joints.
    machine = load_machine("shovel")
    T, q = base_poses(np.array(made["base"])), np.array(made["joints"])
    assert np.abs(end_point(machine, q, T) - made["end_point"]).max() < 1e-6
    way = np.array(made["base"])[:, :2] - [10.0, 20.0]
    across = way @ [-math.sin(0.5), math.cos(0.5)]
    assert np.abs(across).max() < 1e-9
    assert made["base"][-1][2] == pytest.approx(0.066, abs=1e-6)
    dt = np.diff(made["time"])[:, None]
    moved = np.diff(q, axis=0) / dt
    rates = np.array(made["joint_velocities"])
    assert np.abs(moved - 0.5 * (rates[1:] + rates[:-1])).max() < 0.05


def test_given_parameters_are_taken_as_they_are(tmp_path: Path) -> None:
    p = {"p1": 0.2675, "p2": 0.21, "p3": 0.4396, "p4": 0.08, "alpha_f": math.radians(16.75)}
    made = surmounted(tmp_path, task(parameters=p))
    assert made["ok"], made["why"]
    assert made["parameters"] == p
    assert made["method"] == "given"


def test_a_box_of_the_state_is_climbed_over(tmp_path: Path) -> None:
    asked = task("ex13", obstacle="slab", over=True)
    del asked["edges"]
    c, s = math.cos(0.5), math.sin(0.5)
    middle = 5.5 + 5.0
    asked["state"]["obstacles"] = [
        {
            "name": "slab",
            "center": [10.0 + c * middle, 20.0 + s * middle, 0.2],
            "rotation": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
            "half_extents": [5.0, 4.0, 0.2],
        }
    ]
    made = surmounted(tmp_path, asked)
    assert made["ok"], made["why"]
    assert made["obstacle"]["height"] == pytest.approx(0.4)
    assert made["obstacle"]["depth"] == pytest.approx(10.0)
    assert max(row[2] for row in made["base"]) >= 0.4
    assert made["base"][-1][2] == pytest.approx(0.0, abs=1e-6)
    # Something else that stands on it is in the way.
    asked["state"]["obstacles"].append(
        {
            "name": "pole",
            "center": [10.0 + c * 9.0, 20.0 + s * 9.0, 2.0],
            "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "half_extents": [0.1, 0.1, 2.0],
        }
    )
    blocked = surmounted(tmp_path, asked)
    assert not blocked["ok"]
    assert blocked["kind"] == "collision"
    assert "pole" in blocked["why"]


def test_an_angle_is_squared_up_first(tmp_path: Path) -> None:
    made = surmounted(tmp_path, task("ex13", angle=0.3))
    assert made["ok"], made["why"]
    assert made["phases"][0]["name"] == "square up"
    assert made["base"][0][3] == pytest.approx(0.5)
    assert made["base"][-1][3] == pytest.approx(0.2)
    first = np.array(made["tracks"])[1:5]
    assert (first[:, 0] > 0.0).all()
    assert (first[:, 1] < 0.0).all()  # to the right
    assert any("squaring up" in note for note in made["notes"])


def test_an_interrupted_search_goes_on(tmp_path: Path) -> None:
    kept = tmp_path / "kept.jsonl"
    first = surmounted(tmp_path, task(), "--keep", str(kept))
    lines = kept.read_text().splitlines()
    assert len(lines) >= 10
    # Cut in the middle of a line, as a killed process leaves it.
    kept.write_text("\n".join(lines[:5]) + "\n" + lines[5][:20])
    again = surmounted(tmp_path, task(), "--keep", str(kept))
    assert again == first
    # And once more: what was cut is not in the way of what came after it.
    assert len(kept.read_text().splitlines()) == len(lines)
    assert surmounted(tmp_path, task(), "--keep", str(kept)) == first
    kept.write_text("nothing\n" * 3)
    path = tmp_path / "task.json"
    for wrong in (kept, tmp_path, tmp_path / "none" / "kept.jsonl"):
        bad = RUNNER.invoke(app, ["surmount", str(path), "--keep", str(wrong)])
        assert isinstance(bad.exception, InputError), bad.output
        assert str(wrong) in str(bad.exception)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"machine": "two"}, 'machine "two" is not in state'),
        ({"edges": []}, "needs either obstacle or edges"),
        ({"payload": -1.0}, "payload"),
        ({"edges": None}, "edges"),
        ({"obstacle": "x"}, "needs either obstacle or edges"),
        ({"friction": 0.0}, "friction"),
        ({"edges": [{"distance": 0.4, "rise": 0.0}]}, "rise"),
        (
            {"edges": [{"distance": 0.4, "rise": 0.05}, {"distance": 0.3, "rise": 0.05}]},
            "is not beyond",
        ),
        (
            {
                "edges": [{"distance": 0.4, "rise": 0.05}, {"distance": 2.3, "rise": 0.05}],
                "parameters": {"p1": 1, "p2": 1, "p3": 1, "p4": 1, "alpha_f": 0.3},
            },
            "parameters are those of one edge",
        ),
    ],
)
def test_bad_tasks_are_told(tmp_path: Path, change: dict[str, Any], sentence: str) -> None:
    path = tmp_path / "task.json"
    path.write_text(json.dumps(task(**change)))
    result = RUNNER.invoke(app, ["surmount", str(path)])
    shown = f"{result.output}{result.exception}"
    assert result.exit_code != 0
    assert sentence in " ".join(shown.split())
    assert "Traceback" not in result.output


def test_machines_that_cannot_are_told(tmp_path: Path) -> None:
    asked = task()
    asked["state"]["machines"]["one"]["model"] = "rail6"
    asked["state"]["machines"]["one"]["joints"].update(tilt=0.0, rotate=0.0)
    path = tmp_path / "task.json"
    path.write_text(json.dumps(asked))
    result = RUNNER.invoke(app, ["surmount", str(path)])
    assert result.exit_code != 0
    assert "no body of its own for each of two tracks" in f"{result.output}{result.exception}"


def test_too_near_is_told(tmp_path: Path) -> None:
    made = surmounted(tmp_path, task(edges=[{"distance": 0.1, "rise": 0.066}]))
    assert not made["ok"]
    assert made["kind"] == "room"
    assert "drive back" in made["why"]


def test_words(tmp_path: Path) -> None:
    path = tmp_path / "task.json"
    path.write_text(json.dumps(task()))
    result = RUNNER.invoke(app, ["surmount", str(path)])
    assert result.exit_code == 0
    assert "sequence 2-1" in result.output
    assert " J in the sequences" in result.output
