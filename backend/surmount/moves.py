"""Moves of the arm alone, while the crawler stands: onto the step, to the back, off the ground.

The arm goes through a few postures and rests at each: it lifts the bucket, folds to where the
machine stands firmest, swings, unfolds, and sets the bucket down. A last part presses it onto the
ground, a first one takes the load off it again.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import end_point
from backend.planning.trajectory.sweep import OWN, Sweep
from backend.spatial.types import Array
from backend.surmount.judge import SUNK, Sequence, clearance_of, small
from backend.surmount.laws import smooth_step
from backend.surmount.machine import Climber
from backend.surmount.records import Motion, Phase, Step
from backend.surmount.statics import weights_of
from backend.surmount.support import margin, zero_moment_points

LIFTED = 0.25
"""How high the bucket is lifted before anything else, of its length."""
PRESSED = 0.8
"""That the load takes onto the bucket, or off it [s]."""
SHORTEST = 0.8
"""No part of a move is shorter [s]."""
BRISK = 1.6
"""Moves of the arm alone are this much faster than sequences, but no joint is at full speed."""
TURN = np.radians(2.0)
"""Between two looks no joint turns by more [rad]."""


@dataclass(frozen=True, eq=False)
class Stance:
    """Where the crawler stands meanwhile. T: (4, 4) T_step_root; lines: (2, 3) that bear it, see
    `support.margin`; lines_z: (2,) their heights [m].
    """

    T: Array
    lines: Array
    lines_z: Array


class Move(NamedTuple):
    """postures: (k, n) at each of which the arm rests [rad]; margin: the least on the way [m];
    clearance: the least of bodies [m]; why: what is in the way, empty where nothing is.
    """

    postures: Array
    margin: float
    clearance: float
    why: str


def on_ground(climber: Climber, x: float, z: float) -> Stance:
    """Level, all of its underside on the ground or the top; where that begins at the edge, from
    there."""
    wide, a = climber.crawler.half_width, climber.a
    T = climber.root_poses(np.array([x]), np.array([z]), np.array([0.0]))[0]
    rear = x - a if z <= 0.0 else max(x - a, 0.0)
    return Stance(T, np.array([[rear, 0.0, wide], [x + a, 0.0, wide]]), np.array([z, z]))


def on_edge(climber: Climber, step: Step, sequence: Sequence) -> Stance:
    """Where sequence 1 ends: the rear wheels on the ground, the underside on the edge."""
    wide = climber.crawler.half_width
    rear = float(sequence.lines[-1, 0, 0])
    lines = np.array([[rear, 0.0, wide], [0.0, 0.0, wide]])
    return Stance(sequence.joints.T[-1], lines, np.array([0.0, step.height]))


def carried(
    climber: Climber, step: Step, stance: Stance, swings: Array, own: Sweep | None
) -> Array | None:
    """(n,) of the posture, swing left at 0, in which the machine stands firmest through all swings
    (k,), and nothing touches anything; None where there is none.
    """
    machine = climber.machine
    low, high = machine.lower[1:4], machine.upper[1:4]
    booms, sticks = (np.linspace(low[k], high[k], 6)[1:] for k in (0, 1))
    tried = np.array([[b, s, 0.5 * (low[2] + high[2])] for b in booms for s in sticks])
    best, found = -np.inf, None
    for arm in tried:
        q = np.zeros((len(swings), len(machine.joints)))
        q[:, 0], q[:, 1:4] = swings, arm
        left, clear = looked_at(climber, step, stance, q, own, False)
        if clear < 0.0 or left <= best:
            continue
        best, found = left, q[0].copy()
    if found is not None:
        found[0] = 0.0
    return found


def looked_at(
    climber: Climber, step: Step, stance: Stance, q: Array, own: Sweep | None, touching: bool
) -> tuple[float, float]:
    """The least margin against tipping at rest, and what is left of the clearance at the least [m].

    q: (m, n); touching: whether the bucket may be on the ground.
    """
    T = np.broadcast_to(stance.T, (len(q), 4, 4))
    weights = weights_of(climber, T, q)
    z = np.broadcast_to(stance.lines_z, (len(q), 2))
    lines = np.broadcast_to(stance.lines, (len(q), 2, 3))
    points = zero_moment_points(weights.centre, np.zeros((len(q), 3)), z, lines[..., 0])
    placed = climber.bodies(T, q)
    asked = np.full(len(climber.beside), climber.demands.clearance)
    if touching:
        asked[climber.of_bucket] = -SUNK
    # The undercarriage's own bodies were judged where the crawler came to stand.
    moving = np.any(climber.machine.body_joints[climber.beside], axis=1)
    left = clearance_of(placed, step).min(axis=0) - asked
    clear = float(left[np.asarray(moving)].min())
    if own is not None:
        clear = min(clear, own.least_along(q)[0] - OWN * small(climber))
    return float(margin(points, lines).min()), clear


def move(
    climber: Climber,
    step: Step,
    stance: Stance,
    begin: Array,
    end: Array | None,
    lifted: tuple[bool, bool],
    own: Sweep | None,
) -> Move:
    """From one posture (n,) to another; to the folded one where `end` is None.

    lifted: whether the bucket is on the ground at begin and at end.
    """
    swings = np.array([begin[0]]) if end is None else np.linspace(begin[0], end[0], 13)
    folded = carried(climber, step, stance, swings, own)
    if folded is None:
        why = "the arm cannot be folded and swung there without touching anything"
        return Move(np.array([begin]), -np.inf, -np.inf, why)
    postures = [begin]
    if lifted[0]:
        postures.append(_above(climber, stance, begin))
    last = begin if end is None else end
    for swing in dict.fromkeys((float(begin[0]), float(last[0]))):
        posture = folded.copy()
        posture[0] = swing
        postures.append(posture)
    if end is not None:
        if lifted[1]:
            postures.append(_above(climber, stance, end))
        postures.append(end)
    rows = np.array(postures)
    tight, least = np.inf, np.inf
    for k, (a, b) in enumerate(pairwise(rows)):
        count = max(3, int(np.ceil(np.abs(b - a).max() / TURN)))
        q = a + (b - a) * np.linspace(0.0, 1.0, count)[:, None]
        near = (k == 0 and lifted[0]) or (k == len(rows) - 2 and lifted[1] and end is not None)
        left, clear = looked_at(climber, step, stance, q, own, near)
        tight, least = min(tight, left), min(least, clear)
    why = ""
    if least < 0.0:
        why = f"the arm would come {-least:.3f} m too near to something when it is moved"
    elif tight < climber.demands.margin:
        why = f"it would come within {tight:.3f} m of tipping over while the arm is moved"
    return Move(rows, tight, least + climber.demands.clearance, why)


def _above(climber: Climber, stance: Stance, q: Array) -> Array:
    """The posture with the bucket lifted straight up; the same where the arm cannot."""
    machine = climber.machine
    T = np.array([stance.T])
    held = end_point(machine, q[None], T)[0]
    lift = LIFTED * machine.sun.lengths[3]
    way = 1 if held[0] > stance.T[0, 3] else -1
    for share in (1.0, 0.6, 0.3, 0.15):
        up = np.array([held[0], held[2] + share * lift])
        found, reached = climber.arm(T, up, way)
        inside = (found[0] >= machine.lower - 1e-9) & (found[0] <= machine.upper + 1e-9)
        if reached[0] and inside.all():
            posture = np.array(found[0])
            posture[0] = q[0]
            return posture
    return q


def timed(
    climber: Climber,
    stance: Stance,
    name: str,
    made: Move,
    loads: tuple[Array | None, Array | None],
    dt: float,
) -> Motion:
    """A move row by row, dt [s] apart. loads: (n,) torques with the bucket loaded before and after,
    None where it is not."""
    machine, pace = climber.machine, min(0.9, BRISK * climber.demands.pace)
    q = [made.postures[:1]]
    peak, sharp = 2.1875, 7.5132  # of the 7th-order law's first two derivatives
    for a, b in pairwise(made.postures):
        way = np.abs(b - a)
        needed = float((peak * way / machine.max_velocity).max()) / pace
        effort = float(np.sqrt((sharp * way / machine.max_acceleration).max() / pace))
        duration = max(SHORTEST, needed, effort)
        u = np.linspace(0.0, 1.0, max(2, round(duration / dt)) + 1)[1:]
        q.append(a + (b - a) * smooth_step(u).value[:, None])
    rows = np.concatenate(q)
    weights = weights_of(climber, np.broadcast_to(stance.T, (len(rows), 4, 4)), rows)
    torques = weights.gravity
    ramp = np.linspace(0.0, 1.0, round(PRESSED / dt) + 1)[:-1, None]
    if loads[0] is not None:
        first = loads[0] + (torques[0] - loads[0]) * ramp
        rows = np.concatenate([np.repeat(rows[:1], len(ramp), axis=0), rows])
        torques = np.concatenate([first, torques])
    if loads[1] is not None:
        last = torques[-1] + (loads[1] - torques[-1]) * ramp
        rows = np.concatenate([rows, np.repeat(rows[-1:], len(ramp), axis=0)])
        torques = np.concatenate([torques, last])
    m = len(rows)
    time: Array = np.arange(m) * np.float64(dt)
    return Motion(
        time=time,
        q=rows,
        rates=np.gradient(rows, dt, axis=0),
        belts=np.zeros(m),
        T_step_root=np.broadcast_to(stance.T, (m, 4, 4)),
        support=np.broadcast_to(stance.lines[:, [0, 2]], (m, 2, 2)),
        held=np.full((m, 2), np.nan),
        torques=torques,
        phases=(Phase(name, 0.0, float(time[-1])),),
    )
