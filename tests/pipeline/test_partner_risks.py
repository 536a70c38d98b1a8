"""Machines against machines: a swing's times to a partner, against turning both in small steps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from test_people import FAR, inputs, run  # noqa: F401
from test_step import config  # noqa: F401

from backend.collision.verdict import contact
from backend.documents.people import PartnerRiskModel
from backend.documents.people_document import people_document
from backend.fusion.pose import FusedPose, StreamStatus, Validity
from backend.fusion.samples import Fix
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.partner_risks import partner_risks, pieces, swinging
from backend.pipeline.people_records import PartnerRisk
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import MachineState, PairDistance
from backend.safety import partner
from backend.safety.people import Watch
from backend.safety.record import Level
from backend.safety.swing_risk import Risk, Swing
from backend.spatial.rotation import from_attitude

MINI = load_machine("mini")
STEP = 0.02
SOON = 1.5  # [s]


def fused(
    name: str, q: np.ndarray, qd: np.ndarray, position: np.ndarray, yaw: float, speed: np.ndarray
) -> FusedPose:
    streams = {n: StreamStatus(0.0, 50.0, "offset", 1, 0) for n in ("joints", "position")}
    return FusedPose(
        name, 0.0, Validity.VALID, (), position, yaw, 0.0, 0.0, q, qd, speed, 0.0, 0.0, 0.0,
        Fix.RTK_FIXED, streams, (0.0, 0.0),
    )  # fmt: skip


def state(pose: FusedPose) -> MachineState:
    return MachineState(pose, place(MINI, pose.joints, base_transform(pose)), 0.1)


def between(rng: np.random.Generator) -> dict[str, MachineState]:
    """Two machines within reach of each other, both swinging, the second driving."""
    low, high = np.maximum(MINI.lower, -2.5), np.minimum(MINI.upper, 2.5)
    found = {}
    for name, position in (("a", np.zeros(3)), ("b", np.array([rng.uniform(2.5, 5.0), 0.0, 0.0]))):
        q = rng.uniform(low, high)
        qd = np.array([rng.choice([-1.0, 1.0]) * rng.uniform(0.4, 0.9), 0.0, 0.0, 0.0])
        yaw = rng.uniform(-np.pi, np.pi)
        speed = np.zeros(3) if name == "a" else np.array([rng.uniform(-0.3, 0.3), 0.0, 0.0])
        found[name] = state(fused(name, q, qd, position, yaw, speed))
    return found


def swing_of(machines: dict[str, MachineState]) -> Swing:
    joint = MINI.joints[0]
    rate = float(machines["a"].pose.joint_velocities[0])
    return Swing(0.0, rate, 0.0, joint.max_velocity, joint.max_acceleration)


def met(machines: dict[str, MachineState]) -> float:
    """When the swinging part of a first touches b, both moving on as they do [s]; infinite for
    later than SOON.
    """
    swings = np.flatnonzero(MINI.body_joints[:, 0])
    a, b = machines["a"].pose, machines["b"].pose
    for k in range(round(SOON / STEP) + 1):
        t = k * STEP
        own = place(MINI, a.joints + t * a.joint_velocities, base_transform(a))
        at = base_transform(b)
        at[:3, 3] += t * b.base_velocity
        other = place(MINI, b.joints + t * b.joint_velocities, at)
        if contact(own.boxes.take(swings), other.boxes)[0]:
            return t
    return math.inf


def judged(machines: dict[str, MachineState], config: Config) -> PartnerRisk:  # noqa: F811
    (risk,) = partner_risks("a", machines, swing_of(machines), 1.0, Watch(), config)
    return risk


def test_pieces_hold_all_of_their_bodies() -> None:
    rng = np.random.default_rng(0)
    every = np.arange(len(MINI.body_links))
    for _ in range(10):
        machine = between(rng)["b"]
        assert machine.body is not None
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = from_attitude(*rng.uniform(-3.0, 3.0, 3)), rng.normal(size=3)
        found, owner = pieces(MINI, machine.body.link_poses[None], T, every)
        boxes = machine.body.boxes.moved(T)
        for k in every:
            inside = rng.uniform(-1.0, 1.0, (200, 3)) * boxes.half_extents[k]
            points = inside @ boxes.rotations[k].T + boxes.centers[k]
            middle, radius, low, high = (values[0, owner == k] for values in found)
            apart = np.linalg.norm(points[:, None, :2] - middle, axis=2)
            height = points[:, 2, None]
            held = (apart <= radius + 1e-9) & (height >= low - 1e-9) & (height <= high + 1e-9)
            assert held.any(axis=1).all()


def test_times_are_never_later_than_moving_both_in_steps(config: Config) -> None:  # noqa: F811
    met_soon = 0
    for seed in range(100):
        machines = between(np.random.default_rng(seed))
        truth = met(machines)
        if truth > SOON:
            continue
        met_soon += 1
        risk = judged(machines, config)
        assert risk.ttc <= truth + STEP
        assert risk.level == Risk.EMERGENCY if truth < 1.0 else risk.level >= Risk.WARNING
    assert met_soon >= 15


def test_far_away_is_safe_and_near_is_not(config: Config) -> None:  # noqa: F811
    rng = np.random.default_rng(1)
    machines = between(rng)
    b = machines["b"].pose
    far = {**machines, "b": state(replace(b, position=np.array([20.0, 0.0, 0.0])))}
    risk = judged(far, config)
    assert (risk.level, risk.body) == (Risk.SAFE, "")
    assert risk.ttc == risk.index_ahead == math.inf
    near = {**machines, "b": state(replace(b, position=np.array([1.5, 0.0, 0.0])))}
    risk = judged(near, config)
    assert risk.level == Risk.EMERGENCY
    assert risk.body.startswith("a:")
    assert risk.other_body.startswith("b:")
    assert min(risk.left) == 0.0


def test_who_is_not_known_is_left_to_the_partners_concern(config: Config) -> None:  # noqa: F811
    machines = between(np.random.default_rng(2))
    b = machines["b"]
    unknown = replace(b, pose=replace(b.pose, validity=Validity.STALE))
    swing = swing_of(machines)
    assert not partner_risks("a", {**machines, "b": unknown}, swing, 1.0, Watch(), config)
    assert not partner_risks(
        "a", {**machines, "b": replace(b, body=None)}, swing, 1.0, Watch(), config
    )


def test_levels_limit_the_swing_and_say_why() -> None:
    clear = partner.judge("a", 4, (), partner.Limits(0.8, 0.2), 1.0)
    pairs = [PairDistance("b", "a", "", "", 2.5, None, "", 0, near=False)]
    risk = PartnerRisk("a", "b", "a:stick/0", "b:boom/0", 2.0, 9.0, 1.5, 8.0, 1, (1.0, 0.4))
    slow = swinging(clear, (risk,), pairs)
    assert slow.level is Level.SLOW
    np.testing.assert_array_equal(slow.allowed[0], [1.0, 0.4])
    assert slow.allowed[1:].all()
    assert slow.reason == "stick meets b:boom/0 in 2.0 s"
    assert slow.evidence is not None
    assert (slow.evidence.distance, slow.evidence.other) == (2.5, "b:boom/0")
    stop = swinging(clear, (risk, replace(risk, level=2, ttc=0.5, left=(0.0, 1.0))), pairs)
    assert stop.level is Level.STOP
    np.testing.assert_array_equal(stop.allowed[0], [0.0, 0.4])
    safe = replace(risk, level=0, left=(1.0, 1.0))
    assert swinging(clear, (safe,), pairs) is clear
    assert swinging(clear, (), pairs) is clear
    unknown = partner.unknown("a", 4, "b is silent", 1.0)
    assert swinging(unknown, (risk,), pairs) is unknown


def test_the_document_tells_machines_apart_from_people(config: Config) -> None:  # noqa: F811
    for place_of_b, level in ((FAR, "SAFE"), ((1.5, 0.0), "EMERGENCY")):
        snapshot = run(config, position=place_of_b)
        assert snapshot.people is not None
        rows = people_document(snapshot.people, snapshot.time)["machines"]
        assert {(row["machine"], row["other"]) for row in rows} == {("a", "b"), ("b", "a")}
        for row in rows:
            PartnerRiskModel.model_validate(
                {k: None if v == math.inf else v for k, v in row.items()}
            )
        assert rows[0]["level"] == level
        concern = next(c for c in snapshot.concerns if c.name == "partner" and c.machine == "a")
        assert (concern.level >= Level.SLOW) == (level != "SAFE")
