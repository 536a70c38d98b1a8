"""People and moving objects as a safety concern: of one machine, with its swing's risks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from backend.collision.box_distance import lower_bounds, pair_distances
from backend.collision.scene import moving
from backend.collision.server import closest
from backend.fusion.inflation import spread
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.braking import LONGEST_DELAY, age_of, motion_of
from backend.pipeline.config import Config
from backend.pipeline.partner_risks import partner_risks
from backend.pipeline.people import PeopleState, boxes_of, counts, largest, lost_boxes, name_of
from backend.pipeline.people_records import Judged, People
from backend.pipeline.records import MachineState
from backend.pipeline.site_concern import rows_to
from backend.safety import people as judging
from backend.safety.approach import Approach, approach_moving, standing_reach
from backend.safety.people import Risks, Watch
from backend.safety.record import Concern
from backend.safety.swing_arcs import Objects, judge_swing
from backend.safety.swing_risk import Risk, Swing
from backend.spatial import transform
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.types import AnyArray, Array, IntArray

SIGMAS = 3.0
HORIZON = 1.0
"""How far ahead people are judged [s]."""


def people_concern(
    own: str,
    machines: Mapping[str, MachineState],
    present: People,
    memory: PeopleState,
    now: float,
    config: Config,
    driven: bool,
) -> tuple[Concern, Judged | None]:
    """The verdict on one own machine, and what it is based on; that is None when unknown.

    What stands in `memory.judged` is not judged anew; distances and brakes are, in every cycle.
    driven: somebody controls it from here, so that braking distances are judged, too.
    """
    watch = config.people
    assert watch is not None
    machine, state = config.machines[own], machines[own]
    joints = len(machine.joints)
    if state.pose.validity is not Validity.VALID or state.body is None:
        reason = state.pose.reasons[0] if state.pose.reasons else "is unknown"
        return judging.unknown(own, joints, f"{config.labels[own]} {reason}", now), None
    if present.reason:
        return judging.unknown(own, joints, f"people: {present.reason}", now), None
    judged = memory.judged.get(own)
    if judged is None:
        swing = _swing(own, machine, state, memory)
        judged = replace(
            _judged(own, machine, state, present, swing, watch),
            partners=partner_risks(own, machines, swing, HORIZON, watch, config),
        )
    boxes, names, velocity, least, picked = _around(present, watch, now)
    risks = _picked(judged.risks, picked)
    doubt = spread(machine, state.pose)
    reach = watch.slow_below + doubt
    near = bool((lower_bounds(state.body.boxes, boxes) <= reach).any())
    scene = moving(boxes, names) if near else moving(NO_BOXES)
    found = closest(scene, state.body.boxes, reach)
    rows = rows_to(machine, state, scene, found, doubt, velocity)
    approach = (
        _approach(machine, state, boxes, names, velocity, least, now, watch) if driven else None
    )
    bodies = tuple(f"{own}:{name}" for name in machine.body_names), names
    concern = judging.judge(own, joints, rows, bodies, watch, risks, now, approach)
    return concern, judged


def _around(
    present: People, watch: Watch, now: float
) -> tuple[Boxes, tuple[str, ...], Array, Array, IntArray]:
    """Who limits: boxes (k), names, velocities (k, 3), least speeds nearer (k,), and which of the
    tracks they are, -1 for those who were lost lately.
    """
    tracked = present.tracked
    picked = np.flatnonzero(counts(tracked)) if len(tracked) else np.zeros(0, np.int64)
    lost = tuple(one for one in present.lost if now - one.lost < watch.remembered)
    everybody = boxes_of(tracked, SIGMAS).take(picked) if len(tracked) else NO_BOXES
    names = (
        *(name_of(tracked, k) for k in picked.tolist()),
        *(f"person:P{one.id}" for one in lost),
    )
    velocity = np.zeros((len(names), 3))
    velocity[: len(picked), :2] = tracked.velocity[picked]
    least = np.zeros(len(names))
    least[: len(picked)] = watch.walking
    index = np.concatenate([picked, np.full(len(lost), -1)])
    return concatenated([everybody, lost_boxes(lost)]), names, velocity, least, index


def _approach(
    machine: Machine,
    state: MachineState,
    boxes: Boxes,
    names: tuple[str, ...],
    velocity: Array,
    least: Array,
    now: float,
    watch: Watch,
) -> Approach | None:
    """None when nobody can come too near before everything stands."""
    assert state.body is not None
    keep = watch.stop_below + spread(machine, state.pose)
    stopping = LONGEST_DELAY + float((machine.max_velocity / machine.max_acceleration).max())
    speed = np.maximum(np.linalg.norm(velocity, axis=1), least)
    reach = standing_reach(machine, keep, LONGEST_DELAY) + speed * stopping
    apart = np.linalg.norm(boxes.centers - state.body.swing_center, axis=1)
    near = apart - np.linalg.norm(boxes.half_extents, axis=1) < machine.bounding_radius + reach
    if not near.any():
        return None
    kept = np.flatnonzero(near)
    named = tuple(names[k] for k in kept)
    return approach_moving(
        machine,
        motion_of(state),
        boxes.take(kept),
        velocity[kept],
        least[kept],
        named,
        keep,
        age_of(state, now),
        LONGEST_DELAY,
    )


def _judged(
    own: str,
    machine: Machine,
    state: MachineState,
    present: People,
    swing: Swing,
    watch: Watch,
) -> Judged:
    """Everybody, tentative tracks too, against all bodies of one machine."""
    assert state.body is not None
    tracked = present.tracked
    k = len(tracked)
    swings = machine.body_joints[:, 0]
    T_axis_site = transform.inverse(state.body.link_poses[0] @ machine.arm.T_root_swing)
    R = T_axis_site[:3, :3]
    corners = state.body.boxes.take(swings).moved(T_axis_site).corners()
    people = boxes_of(tracked)
    middle = people.centers @ R.T + T_axis_site[:3, 3]
    velocity = np.column_stack([tracked.velocity, np.zeros(k)]) @ R.T
    radius = people.half_extents[:, :2].max(axis=1, initial=0.0) if k else np.zeros(0)
    half = people.half_extents[:, 2]
    now = Objects(
        middle[:, :2], velocity[:, :2], radius, middle[:, 2] - half, middle[:, 2] + half,
        tracked.sigma,
    )  # fmt: skip
    placed = np.column_stack([tracked.ahead, people.centers[:, 2]]) @ R.T + T_axis_site[:3, 3]
    vague = largest(tracked.ahead_cov)
    ahead = now._replace(place=placed[:, :2], sigma=np.minimum(vague, 1.0))
    risks = judge_swing(
        corners,
        swing,
        now,
        ahead,
        HORIZON,
        watch.boundaries,
        watch.uncertainty,
    )
    if machine.sun.azimuth_sign < 0:
        risks = replace(risks, side=1 - risks.side)
    if not k:
        return Judged(np.zeros(0), (), risks)
    bodies = len(state.body.boxes)
    i, j = np.divmod(np.arange(bodies * k), k)
    apart = pair_distances(state.body.boxes, people, i, j)[0].reshape(bodies, k)
    nearest = apart.argmin(axis=0)
    all_bodies = np.flatnonzero(swings)
    body = all_bodies[risks.body] if len(all_bodies) else risks.body
    risks = _closing(replace(risks, body=body), state, tracked.position, velocity @ R, apart, watch)
    names = tuple(f"{own}:{machine.body_names[b]}" for b in nearest)
    return Judged(apart.min(axis=0), names, risks)


def _closing(
    risks: Risks, state: MachineState, position: Array, velocity: Array, apart: Array, watch: Watch
) -> Risks:
    """Whoever walks towards the machine's nearest body, or is driven at, has a time to collision,
    too; and nearer than the stop distance everything is an emergency.
    """
    assert state.body is not None
    near = apart.min(axis=0)
    body = apart.argmin(axis=0)
    to = state.body.boxes.centers[body] - position
    unit = to[:, :2] / np.maximum(np.linalg.norm(to[:, :2], axis=1), 1e-6)[:, None]
    speed = np.einsum("kx,kx->k", velocity[:, :2] - state.pose.base_velocity[:2], unit)
    with np.errstate(divide="ignore"):
        met = np.where(speed > 0.05, np.maximum(near, 0.0) / np.maximum(speed, 1e-6), np.inf)
    sooner = met < risks.ttc
    ttc = np.where(sooner, met, risks.ttc)
    level = np.where(near <= watch.stop_below, int(Risk.EMERGENCY), risks.level)
    return replace(risks, ttc=ttc, level=level, body=np.where(sooner, body, risks.body))


def _swing(own: str, machine: Machine, state: MachineState, memory: PeopleState) -> Swing:
    """In the sense that is counter-clockwise about the swing axis, upwards."""
    sign = machine.sun.azimuth_sign
    joint = machine.joints[0]
    return Swing(
        0.0,
        sign * float(state.pose.joint_velocities[0]),
        sign * memory.acceleration(own),
        joint.max_velocity,
        joint.max_acceleration,
    )


def _picked(risks: Risks, picked: IntArray) -> Risks:
    """Of those who limit; who was lost lately has no risk of its own."""
    here = picked >= 0
    safe = np.where(here, picked, 0)
    if not len(risks.level):
        k = len(picked)
        never = np.full(k, np.inf)
        none = np.zeros(k, np.int64)
        return Risks(none, never, never, never, never, none, none)

    def take(values: AnyArray, otherwise: float) -> AnyArray:
        return np.asarray(np.where(here, values[safe], otherwise))

    return Risks(
        take(risks.body, 0).astype(np.int64),
        take(risks.ttc, np.inf),
        take(risks.index, np.inf),
        take(risks.ttc_ahead, np.inf),
        take(risks.index_ahead, np.inf),
        take(risks.level, int(Risk.SAFE)).astype(np.int64),
        take(risks.side, 0).astype(np.int64),
    )
