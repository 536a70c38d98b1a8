"""Machines against machines on the TTC-x plane: what a swing is to the bodies beside it.

Rasul 2021, Section 4 asks for people, objects and machines alike. All bodies are cut into short
pieces. A partner's are objects with a speed of their own about the swing's axis; and as machines do
not go straight on, both are looked at along the ways on which their joints and tracks, moving as
they do, take them: the earlier time counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from backend.fusion.inflation import spread
from backend.fusion.pose import FusedPose, Validity
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.partner_risks_kernel import first_meeting, seen_from_above
from backend.pipeline.people_records import PartnerRisk
from backend.pipeline.place import base_transform
from backend.pipeline.records import MachineState, PairDistance
from backend.safety.partner import part
from backend.safety.people import Watch
from backend.safety.record import Concern, Evidence
from backend.safety.swing_arcs import HEADROOM, Objects, judge_swing
from backend.safety.swing_limit import fractions, swing_limited
from backend.safety.swing_risk import Swing, risk, speeding
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray

PIECE = 0.6
"""Bodies are cut into pieces of this length at most [m]."""
MOST = 8
"""Pieces of one body at most."""
STEP = 0.1
"""Between two looks ahead [s]."""
STEPS = 30
"""Looks ahead, past the time below which anybody is warned of."""
_TIMES: Array = STEP * np.arange(STEPS + 1.0)
_AT_REST = 0.02  # [rad/s]


class Pieces(NamedTuple):
    """k pieces at t times, from above: (t, k, 2) middles, (t, k) radii that hold all of a piece,
    lowest and highest points [m].
    """

    middle: Array
    radius: Array
    low: Array
    high: Array

    def take(self, index: BoolArray) -> Pieces:
        return Pieces(*(np.ascontiguousarray(values[:, index]) for values in self))


def partner_risks(
    own: str,
    machines: Mapping[str, MachineState],
    swing: Swing,
    horizon: float,
    watch: Watch,
    config: Config,
) -> tuple[PartnerRisk, ...]:
    """One for every other machine that is placed and known. The machine `own` is placed.

    swing: of `own`, counter-clockwise about the upward axis; horizon: how far ahead, up to
    STEP * STEPS [s].
    """
    machine, state = config.machines[own], machines[own]
    assert state.body is not None
    T = transform.inverse(state.body.link_poses[0] @ machine.arm.T_root_swing)
    swings = np.flatnonzero(machine.body_joints[:, 0])
    corners = state.body.boxes.take(swings).moved(T).corners()
    mine, of_mine = pieces(machine, _ways(machine, state.pose, swing), T, swings)
    longest = float(np.linalg.norm(corners[..., :2], axis=2).max(initial=0.0))
    found = []
    for name, other in machines.items():
        if name == own or other.body is None or other.pose.validity is not Validity.VALID:
            continue
        partner = config.machines[name]
        doubt = spread(machine, state.pose) + spread(partner, other.pose)
        every = np.arange(len(partner.body_links))
        theirs, of_theirs = pieces(partner, _ways(partner, other.pose), T, every)
        far = np.linalg.norm(theirs.middle, axis=2) - theirs.radius
        near = (far <= longest + doubt).any(axis=0)
        if not (near.any() and len(swings)):
            found.append(PartnerRisk(own, name, "", "", math.inf, math.inf, math.inf, math.inf, 0))
            continue
        theirs, of_theirs = theirs.take(near), of_theirs[near]
        soon = first_meeting(tuple(mine), tuple(theirs), doubt, HEADROOM)
        k = round(horizon / STEP)
        risks = judge_swing(
            corners,
            swing,
            _objects(theirs, 0, doubt),
            _objects(theirs, k, doubt),
            horizon,
            watch.boundaries,
            watch.uncertainty,
        )
        worst = int(np.lexsort((risks.index, risks.ttc, -risks.level))[0])
        side = 1 - risks.side if machine.sun.azimuth_sign < 0 else risks.side
        left = fractions(risks.level, side)
        ttc, level = float(risks.ttc.min()), int(risks.level.max())
        bodies = int(swings[risks.body[worst]]), int(of_theirs[worst])
        meeting = max((soon[0] - 0.5) * STEP, 0.0) if soon[0] >= 0 else math.inf
        if meeting < ttc:
            ttc, bodies = meeting, (int(of_mine[soon[1]]), int(of_theirs[soon[2]]))
            by_way = risk(np.array([meeting]), np.array([math.inf]), watch.boundaries)
            level = max(level, int(by_way[0]))
            left = np.minimum(left, _towards(by_way, state.pose))
        found.append(
            PartnerRisk(
                own,
                name,
                f"{own}:{machine.body_names[bodies[0]]}",
                f"{name}:{partner.body_names[bodies[1]]}",
                ttc,
                float(risks.index.min()),
                min(float(risks.ttc_ahead.min()), max(ttc - horizon, 0.0)),
                float(risks.index_ahead.min()),
                level,
                (float(left[0]), float(left[1])),
            )
        )
    return tuple(found)


def swinging(
    found: Concern, partners: tuple[PartnerRisk, ...], pairs: Iterable[PairDistance]
) -> Concern:
    """The partners' verdict on a machine with what its swing is to them."""
    if not partners:
        return found
    worst = max(partners, key=lambda one: (one.level, -one.ttc))
    left = np.min([one.left for one in partners], axis=0)
    limited = swing_limited(found, left, worst.level)
    if limited.level == found.level:
        return limited
    soon = min(worst.ttc, worst.ttc_ahead + 1.0)
    when = f"in {soon:.1f} s" if math.isfinite(soon) else "within its braking distance"
    reason = f"{part(worst.body)} meets {worst.other_body} {when}"
    if found.evidence is not None:
        return replace(limited, reason=reason)
    both = {worst.machine, worst.other}
    apart = next((pair.distance for pair in pairs if {pair.a, pair.b} == both), math.nan)
    evidence = Evidence(worst.body, worst.other_body, apart, None, soon)
    return replace(limited, reason=reason, evidence=evidence)


def _towards(level: IntArray, pose: FusedPose) -> Array:
    """(2,) what is left of a swing that turns towards a meeting; at rest somebody else moves."""
    rate = float(pose.joint_velocities[0])
    if abs(rate) < _AT_REST:
        return np.ones(2)
    return fractions(level, np.array([1 if rate > 0.0 else 0]))


def _ways(machine: Machine, pose: FusedPose, swing: Swing | None = None) -> Array:
    """(t, links, 4, 4) where the links will be at _TIMES if all moves on as it does.

    swing: how the first joint speeds up, counter-clockwise.
    """
    q = pose.joints + _TIMES[:, None] * pose.joint_velocities
    if swing is not None and swing.acceleration:
        t = np.minimum(_TIMES, speeding(swing))
        more = swing.acceleration * (0.5 * t**2 + t * (_TIMES - t))
        q[:, 0] += machine.sun.azimuth_sign * more
    q = np.clip(q, machine.lower, machine.upper)
    T = np.repeat(base_transform(pose)[None], len(_TIMES), axis=0)
    T[:, :3, 3] += _TIMES[:, None] * pose.base_velocity
    return link_poses(machine, q, T)


def pieces(
    machine: Machine, poses: Array, T_axis_site: Array, bodies: IntArray
) -> tuple[Pieces, IntArray]:
    """The given bodies, cut, along poses (t, links, 4, 4), and (k,) the body of each piece."""
    parts, owner = cut(machine.bodies.take(bodies))
    links = machine.body_link_index[bodies[owner]]
    found = seen_from_above(
        T_axis_site @ poses, links, parts.centers, parts.rotations, parts.half_extents
    )
    return Pieces(*found), bodies[owner]


def cut(boxes: Boxes) -> tuple[Boxes, IntArray]:
    """Boxes cut across their longest edges, and (k,) whose pieces they are."""
    counts = np.clip(np.ceil(2.0 * boxes.half_extents.max(axis=1, initial=0.0) / PIECE), 1, MOST)
    counts = counts.astype(np.int64)
    owner = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    half = boxes.half_extents[owner].copy()
    rows, axis = np.arange(len(owner)), boxes.half_extents.argmax(axis=1)[owner]
    length = half[rows, axis]
    off = ((2.0 * number + 1.0) / counts[owner] - 1.0) * length
    half[rows, axis] = length / counts[owner]
    R = boxes.rotations[owner]
    return Boxes(boxes.centers[owner] + off[:, None] * R[rows, :, axis], R, half), owner


def _objects(theirs: Pieces, k: int, doubt: float) -> Objects:
    """The pieces at the k-th time, with their speeds then."""
    middle = theirs.middle
    a = min(k, len(middle) - 2)
    velocity = (middle[a + 1] - middle[a]) / STEP
    vague = np.full(middle.shape[1], doubt)
    return Objects(middle[k], velocity, theirs.radius[k], theirs.low[k], theirs.high[k], vague)
