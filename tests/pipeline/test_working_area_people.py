"""Working areas in a cycle: of fused poses, with who is in them, in the document and back."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from test_people import run
from test_step import config, inputs  # noqa: F401

from backend.documents.snapshot import snapshot_document
from backend.documents.working_area import read_working_area
from backend.fusion.motion import JOINT_WINDOW
from backend.fusion.pose import Validity
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.pipeline.step import initial, step
from backend.pipeline.working_area import area_of
from backend.safety.area_records import Area, Within
from backend.safety.people import Watch
from backend.shell.app.models import SnapshotModel
from backend.shell.app.wire import dumps
from backend.shell.session.recorded_snapshot import recorded_snapshot


def current(snapshot: Snapshot, machine: str = "a") -> Area:
    area = snapshot.machines[machine].area
    assert area is not None
    assert area.current is not None
    return area.current


def test_every_machine_has_its_areas(config: Config) -> None:  # noqa: F811
    snapshot = run(config)
    for name, state in snapshot.machines.items():
        assert state.area is not None
        assert state.body is not None
        assert state.area.reason == ""
        assert state.area.predicted is not None
        assert state.area.maximum is not None
        np.testing.assert_allclose(state.area.center, state.body.swing_center[:2])
        here = current(snapshot, name)
        corners = state.body.boxes.corners()[..., :2] - state.body.swing_center[:2]
        assert here.reach == pytest.approx(np.linalg.norm(corners, axis=2).max(), abs=0.01)
        assert here.reach > state.body.reach  # whole bodies, not the tip
        middle = 0.5 * (here.start + here.end)
        assert math.cos(middle - state.body.azimuth) == pytest.approx(1.0, abs=1e-6)
        # Joints stand: the swing may be three standard deviations of its rate from that.
        doubt = 3.0 * math.sqrt(2.0) * state.pose.sigma_joints / JOINT_WINDOW
        assert state.area.predicted.end - here.end > doubt
        assert here.reach < state.area.predicted.reach < state.area.maximum.reach
        assert state.area.maximum.whole


def test_without_a_valid_pose_no_area_is_told(config: Config) -> None:  # noqa: F811
    state = initial(config)
    for k in range(60):
        now = 100.0 + 0.02 * k
        silent = ("a",) if k > 20 else ()
        state, snapshot = step(state, inputs(config, now, silent=silent), now, config)
    here = snapshot.machines["a"]
    assert here.pose.validity is not Validity.VALID
    assert here.area is not None
    assert here.area.reason == here.pose.reasons[0]
    assert (here.area.current, here.area.predicted, here.area.maximum) == (None, None, None)
    document = snapshot_document(snapshot, config)["machines"]["a"]["working_area"]
    assert document["reason"]
    assert document["predicted"] is None
    other = snapshot.machines["b"]
    assert other.area is not None
    assert other.area.reason == ""


def test_a_number_that_is_none_is_unknown(config: Config) -> None:  # noqa: F811
    machine = config.machines["a"]
    state = run(config).machines["a"]
    for broken in (
        replace(state.pose, joint_velocities=np.array([0.0, math.nan, 0.0, 0.0])),
        replace(state.pose, sigma_position=math.inf),
        replace(state.pose, base_velocity=np.full(3, math.nan)),
    ):
        found = area_of(machine, broken, state.body, state.pose.time)
        assert found.reason == "motion is unknown"
        assert found.current is None


def test_what_is_old_by_now_is_foretold_for_longer(config: Config) -> None:  # noqa: F811
    machine, state = config.machines["a"], run(config).machines["a"]
    pose = replace(state.pose, joint_velocities=np.array([0.3, 0.0, 0.0, 0.0]))
    soon = area_of(machine, pose, state.body, pose.time).predicted
    late = area_of(machine, pose, state.body, pose.time + 0.2).predicted
    assert soon is not None
    assert late is not None
    assert late.end - soon.end > 0.2 * 0.3


def test_who_is_in_them_is_told(config: Config) -> None:  # noqa: F811
    reach = current(run(config)).reach
    far = run(config, (7, reach + 9.0, 0.0, 0.0, 0.0)).people
    assert far is not None
    assert far.inside == ()
    near = run(config, (7, reach - 0.5, 0.0, 0.0, 0.0), (9, -reach, 0.0, 0.0, 0.0)).people
    assert near is not None
    found = {(one.id, one.machine): one for one in near.inside}
    assert found[7, "a"].now is Within.CURRENT
    assert found[9, "a"].now is Within.MAXIMUM  # the arm is on the other side
    assert (7, "b") not in found
    walking = run(config, (7, reach + 1.8, 0.0, -1.4, 0.0)).people
    assert walking is not None
    (one,) = walking.inside
    assert one.ahead > one.now
    assert one.ahead is Within.CURRENT


def test_nobody_is_in_them_while_people_are_unknown(config: Config) -> None:  # noqa: F811
    people = run(config, (7, 3.0, 0.0, 0.0, 0.0), cycles=60, scans=1).people
    assert people is not None
    assert people.reason
    assert people.inside == ()


def test_the_document_has_them_and_reads_back(config: Config) -> None:  # noqa: F811
    snapshot = run(config, (7, 3.0, 0.5, 0.0, 0.0))
    watching = replace(config, people=Watch())
    sent = json.loads(dumps(snapshot_document(snapshot, watching)))
    jsonschema.validate(sent, SnapshotModel.model_json_schema())
    area = sent["machines"]["a"]["working_area"]
    assert sorted(area) == ["center", "current", "maximum", "predicted", "reason", "tail"]
    assert area["current"]["reach"] == pytest.approx(current(snapshot).reach)
    (inside,) = (one for one in sent["people"]["inside"] if one["machine"] == "a")
    assert inside == {"id": 7, "machine": "a", "area": "current", "area_ahead": "current"}
    back = recorded_snapshot(sent, watching)
    assert current(back) == pytest.approx(current(snapshot))
    assert back.people is not None
    assert snapshot.people is not None
    assert back.people.inside == snapshot.people.inside
    # Recordings of before have neither.
    for machine in sent["machines"].values():
        del machine["working_area"]
    del sent["people"]["inside"]
    before = recorded_snapshot(sent, watching)
    assert before.machines["a"].area is None
    assert before.people is not None
    assert before.people.inside == ()
    jsonschema.validate(sent, SnapshotModel.model_json_schema())
    with pytest.raises(KeyError):
        read_working_area({"reason": ""})
