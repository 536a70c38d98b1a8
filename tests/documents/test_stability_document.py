"""The key `stability` of an assessment: statics by hand, its schema, and what is not known."""

from __future__ import annotations

import dataclasses
import json

import jsonschema
import numpy as np
import pytest

from backend.documents.assessment import AssessmentDocument
from backend.documents.scene import make_scene
from backend.documents.stability import AssessedStability, assessed_stability
from backend.documents.state import parse_state
from backend.errors import InputError
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.shell.app.wire import dumps

MINI = load_machine("mini")
JOINTS = {"swing": 0.4, "boom": 0.4, "stick": -0.7, "bucket": -0.3}


def assessed(machine=MINI, **more):
    one = {"model": "mini", "position": [3.0, 4.0, 0.0], "yaw": 0.3, "joints": JOINTS, **more}
    state = parse_state({"machines": {"left": one}}, "state.json")
    scene = make_scene(state, {"left": machine}, None, "state.json")
    document = state.machines["left"]
    args = machine, document, scene.poses["left"], scene.placed["left"], "state.json: left"
    found = json.loads(dumps(assessed_stability(*args)))
    jsonschema.validate(found, AssessedStability.model_json_schema())
    return found


def test_on_level_ground_it_is_the_weight_of_the_links_and_the_load():
    """Nothing of the room itself: links at their places, the load at the tip, moments by hand."""
    payload = 120.0
    found = assessed(payload=payload)
    q = np.array([JOINTS[joint.role] for joint in MINI.joints])
    T = kinematics.link_poses(MINI, q)
    links = [(link.inertia, T[i]) for i, link in enumerate(MINI.links) if link.inertia]
    sums = sum(i.mass * (T[:3, :3] @ i.com + T[:3, 3]) for i, T in links)
    weight = sum(i.mass for i, _ in links)
    tip = kinematics.end_point(MINI, q)
    centre = (sums + payload * tip) / (weight + payload)
    np.testing.assert_allclose(found["zmp"], centre[:2], atol=1e-9)
    half = np.array([0.5 * MINI.tracks.length, 0.5 * (MINI.tracks.gauge + MINI.tracks.shoe)])
    assert found["margin"] == pytest.approx((half - abs(centre[:2])).min(), abs=1e-9)
    assert found["share"] == pytest.approx((1.0 - abs(centre[:2]) / half).min(), abs=1e-9)
    assert found["percent"] == pytest.approx(100.0 * found["share"])
    most = (half * weight - sums[:2]) / (tip[:2] - half)
    assert found["lift_capacity"] == pytest.approx(min(m for m in most if m > 0.0), rel=1e-9)
    assert found["sigma"] == 0.0
    assert found["edges"] == ["front", "left", "rear", "right"]


def test_motion_and_slope_move_it():
    still = np.array(assessed()["zmp"])
    assert np.linalg.norm(np.array(assessed(joint_velocities={"swing": 0.9})["zmp"]) - still) > 0.01
    hard = assessed(joint_accelerations={"boom": -1.0})
    assert np.linalg.norm(np.array(hard["zmp"]) - still) > 0.01
    assert assessed(pitch=-0.2)["zmp"][0] > still[0] + 0.05


def test_without_trusted_masses_it_says_so_and_nothing_else():
    found = assessed(dataclasses.replace(MINI, masses_trusted=False))
    assert "not trusted" in found.pop("reason")
    assert found.pop("edge") == ""
    assert found.pop("holds") == []
    assert set(found.values()) == {None}


def test_an_unknown_joint_is_named():
    with pytest.raises(InputError, match=r"left\.joint_accelerations\.swung"):
        assessed(joint_accelerations={"swung": 1.0})


def test_it_is_a_part_of_the_assessments_schema():
    schema = AssessmentDocument.model_json_schema()
    assert "stability" in schema["required"]
    assert "lift_capacity" in schema["$defs"]["AssessedStability"]["properties"]
