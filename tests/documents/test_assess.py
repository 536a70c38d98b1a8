"""`cockpit assess` prints what its schema says, and agrees with an independent solver."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from assess_states import assess_lines, disagreements, random_states
from program import cockpit

STATE: dict[str, Any] = {
    "time": 0.0,
    "machines": {
        "left": {
            "model": "mini",
            "position": [308611.05, 4129957.348, 0.0],
            "yaw": 0.3,
            "pitch": 0.0,
            "roll": 0.0,
            "joints": {"swing": 0.1, "boom": 0.5, "stick": -1.0, "bucket": 0.5},
            "joint_velocities": {"swing": 0.0},
            "sigma": {"position": 0.02, "yaw": 0.005, "joints": 0.003},
        },
        "right": {
            "model": "mini",
            "position": [308616.0, 4129957.0, 0.0],
            "yaw": 2.0,
            "joints": {"swing": 0.0, "boom": 0.5, "stick": -1.0, "bucket": 0.5},
        },
    },
    "obstacles": [
        {
            "name": "pole",
            "center": [308611.0, 4129950.0, 1.0],
            "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            "half_extents": [0.1, 0.1, 3],
        }
    ],
}


def assess(state: Any, folder: Path, *options: str) -> dict[str, Any]:
    path = folder / "state.json"
    path.write_text(json.dumps(state))
    done = cockpit("assess", "--state", str(path), *options)
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def test_the_example_of_the_contract(tmp_path: Path) -> None:
    result = assess(STATE, tmp_path)
    schema = json.loads(cockpit("schema", "assess").stdout)
    jsonschema.validate(result, schema)
    jsonschema.validate(STATE, json.loads(cockpit("schema", "state").stdout))
    left = result["machines"]["left"]
    assert left["max_reach"] == pytest.approx(4.371)
    # Sun's own angles: the arm points to yaw + swing, the tip lies at d (Sun 2020, Eqs. (2), (3)).
    d = 1 + 1.72 * math.cos(0.5) + 0.951 * math.cos(-0.5) + 0.7 * math.cos(0.0)
    assert left["reach"] == pytest.approx(d, abs=1e-9)
    tip = np.array(left["end_point"][:2]) - left["swing_center"][:2]
    np.testing.assert_allclose(tip, d * np.array([math.cos(0.4), math.sin(0.4)]), atol=1e-6)
    assert set(result["sun"]) == {"left<-right", "right<-left"}
    sun = result["sun"]["left<-right"]
    assert len(sun["theta"]) == len(sun["d"]) == len(sun["boom"][0])
    assert len(sun["boom"]) == sun["m"] + 1
    assert [row["b"] for row in result["obstacles"]] == ["obstacle:pole"] * 2


def test_all_pairs_include_the_closest(tmp_path: Path) -> None:
    one, every = assess(STATE, tmp_path), assess(STATE, tmp_path, "--all")
    n = [len(m["bodies"]) for m in one["machines"].values()]
    assert len(one["closest"]) == 1
    assert len(every["closest"]) == n[0] * n[1]
    assert min(row["distance"] for row in every["closest"]) == pytest.approx(
        one["closest"][0]["distance"], abs=1e-12
    )


def test_site_frame_and_projected_frame_agree(tmp_path: Path) -> None:
    projected = assess(STATE, tmp_path, "--site", "sun2020-experiment")
    state = json.loads(json.dumps(STATE))
    state["frame"] = "site"
    for item in (*state["machines"].values(),):
        item["position"] = list(np.array(item["position"]) - [308600.0, 4129950.0, 0.0])
    for item in state["obstacles"]:
        item["center"] = list(np.array(item["center"]) - [308600.0, 4129950.0, 0.0])
    local = assess(state, tmp_path)
    assert local["closest"][0]["distance"] == pytest.approx(
        projected["closest"][0]["distance"], abs=1e-8
    )
    origin = np.array([308600.0, 4129950.0, 0.0])
    moved = origin + local["machines"]["left"]["end_point"]
    np.testing.assert_allclose(moved, projected["machines"]["left"]["end_point"], atol=1e-8)


def test_closest_distances_agree_with_coal(tmp_path: Path) -> None:
    results = assess_lines(random_states(["mini", "ex13"], 40, seed=7), tmp_path)
    found = disagreements(results)
    assert found["apart"] >= 15
    assert found["over"] <= 1e-6
    assert found["under"] <= 1e-6
    assert found["overlaps called free"] == 0


def test_lines_are_judged_one_by_one_and_a_bad_one_says_why(tmp_path: Path) -> None:
    path = tmp_path / "states.jsonl"
    bad = {**STATE, "machines": {"left": {**STATE["machines"]["left"], "model": "nosuch"}}}
    lines = [json.dumps(STATE), "{broken", json.dumps(bad), json.dumps(STATE)]
    path.write_text("\n".join(lines))
    done = cockpit("assess", "--state", str(path))
    assert done.returncode == 0
    results = [json.loads(line) for line in done.stdout.splitlines()]
    assert [set(r) == {"error"} for r in results] == [False, True, True, False]
    assert "states.jsonl:2" in results[1]["error"]
    assert "nosuch" in results[2]["error"]


def broken(change: Any) -> dict[str, Any]:
    state = json.loads(json.dumps(STATE))
    change(state)
    return state


BAD = {
    "unknown machine": (lambda s: s["machines"]["left"].update(model="nosuch"), "nosuch"),
    "unknown joint": (lambda s: s["machines"]["left"]["joints"].update(elbow=1.0), "elbow"),
    "missing joint": (lambda s: s["machines"]["left"]["joints"].pop("boom"), "boom"),
    "degrees for radians": (lambda s: s["machines"]["left"]["joints"].update(boom=50.0), "boom"),
    "text for a number": (lambda s: s["machines"]["left"].update(yaw="north"), "yaw"),
    "not finite": (lambda s: s["machines"]["left"]["position"].__setitem__(0, 1e400), "position"),
    "unknown field": (lambda s: s.update(machine={}), "machine"),
    "no machines": (lambda s: s.update(machines={}), "machines"),
    "not a rotation": (lambda s: s["obstacles"][0].update(rotation=[[2, 0, 0]] * 3), "rotation"),
    "negative size": (lambda s: s["obstacles"][0].update(half_extents=[-1, 1, 1]), "half_extents"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_states_are_one_clear_sentence(name: str, tmp_path: Path) -> None:
    change, word = BAD[name]
    path = tmp_path / "state.json"
    path.write_text(json.dumps(broken(change)))
    done = cockpit("assess", "--state", str(path))
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert word in done.stderr
    assert "state.json" in done.stderr


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"\xff\xfe\x00", b"null"])
def test_files_that_are_no_state_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "state.json"
    path.write_bytes(content)
    done = cockpit("assess", "--state", str(path))
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_a_missing_file_is_named() -> None:
    done = cockpit("assess", "--state", "/nowhere/state.json")
    assert done.returncode == 2
    assert "/nowhere/state.json" in done.stderr
