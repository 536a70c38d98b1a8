"""Whether parameters can be gone through at all, and what they need when gone through slowly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.planning.trajectory.records import Obstacles
from backend.planning.trajectory.sweep import OWN, Sweep, make_sweep
from backend.spatial.types import Array
from backend.surmount.machine import Climber
from backend.surmount.outline import (
    belt_clearance,
    body_clearance,
    leans,
    rear_wheel,
)
from backend.surmount.records import LEFT, SEQUENCES, Parameters, Spline, Step, Verdict
from backend.surmount.sequences import (
    Course,
    Joints,
    duration_of,
    joints_of,
    sequence_1,
    sequence_2_1,
    sequence_2_2,
)
from backend.surmount.statics import Loads, loads_of, slow_energy, weights_of
from backend.surmount.support import margin, zero_moment_points

ROWS = 61
"""Of a sequence when it is judged."""
SUNK = 1e-3
"""How deep the bucket's bodies may be in what it stands on [m]."""
ROUNDING = 1e-9
SPARE = 0.1
"""Of what lies on the top, before the line that bears it least behind: the bucket carries so much
that the crawler's pressure stays off the edge."""


@dataclass(frozen=True, eq=False)
class Sequence:
    """One sequence worked out. lines: (m, 2, 3) of what bears the machine, see `support.margin`;
    lines_z: (m, 2) their heights [m]; zmp: (m, 2) [m]; margin: (m,) [m]; duration [s]; potential:
    the least that any drive must do [J], as heights of the centre of mass ask for it.
    """

    name: str
    course: Course
    joints: Joints
    duration: float
    loads: Loads
    centre: Array
    lines: Array
    lines_z: Array
    zmp: Array
    margin: Array
    potential: float


def course_of(
    name: str,
    climber: Climber,
    step: Step,
    parameters: Parameters,
    u: Array,
    spline: Spline | None = None,
) -> Course:
    """One of SEQUENCES over u (m,); spline: of sequence 1."""
    if name == SEQUENCES[0]:
        return sequence_1(climber, step, parameters, u, spline)
    if name == SEQUENCES[1]:
        return sequence_2_1(climber, step, parameters, u)
    return sequence_2_2(climber, step, parameters, u)


def worked_out(climber: Climber, step: Step, name: str, course: Course, joints: Joints) -> Sequence:
    """Time, loads and margins of one course; finite even where it cannot be reached."""
    duration = duration_of(climber, course, joints.q)
    weights = weights_of(climber, joints.T, joints.q)
    lines, lines_z, bearing = _lines(climber, step, course)
    held = np.array([course.held[0], course.held[1] - climber.edge[0]])
    if name == "sequence 2-2":
        # The bucket carries what is left when the crawler's pressure lies well on the top.
        low, high = bearing
        least = low + SPARE * (high - low)
        bearing_x = np.clip(weights.centre[:, 0], least, np.maximum(high, least))
    else:
        bearing_x = bearing[0]
    line_z = np.full(len(course.x), 0.0 if name == "sequence 1" else step.height)
    loads = loads_of(climber, weights, np.stack([bearing_x, line_z], axis=1), held)
    dt = duration / (len(course.u) - 1)
    acceleration = np.gradient(np.gradient(weights.centre, dt, axis=0), dt, axis=0)
    points = zero_moment_points(weights.centre, acceleration, lines_z, lines[..., 0])
    return Sequence(
        name,
        course,
        joints,
        duration,
        loads,
        weights.centre,
        lines,
        lines_z,
        points,
        margin(points, lines),
        climber.weight * float(np.abs(np.diff(weights.centre[:, 2])).sum()),
    )


def _lines(
    climber: Climber, step: Step, course: Course
) -> tuple[Array, Array, tuple[Array, Array]]:
    """What bears the machine: (m, 2, 3), its heights (m, 2), and where the crawler bears (x, x)."""
    m, wide = len(course.x), climber.crawler.half_width
    a, r = climber.a, climber.r
    beside = climber.machine.arm.tip_lateral
    bucket = np.array([course.held[0], course.way * beside, climber.edge[1]])
    held_z = course.held[1] - climber.edge[0]
    lines, z = np.zeros((m, 2, 3)), np.zeros((m, 2))
    if course.way > 0:
        rear = rear_wheel(course.x, course.alpha, a, r)
        lines[:, 0, 0], lines[:, 0, 2] = rear, wide
        lines[:, 1] = bucket
        z[:, 1] = held_z
        return lines, z, (rear, rear)
    lines[:, 0] = bucket
    low = np.maximum(course.x - a, 0.0)
    high = np.where(course.alpha > 1e-9, 0.0, course.x + a)
    lines[:, 1, 0], lines[:, 1, 2] = np.maximum(high, 0.0), wide
    z[:, 0], z[:, 1] = held_z, step.height
    return lines, z, (np.where(course.alpha > 1e-9, 0.0, low), np.maximum(high, 0.0))


def judge(
    climber: Climber,
    step: Step,
    parameters: Parameters,
    spline: Spline | None = None,
    rows: int = ROWS,
    own: Sweep | None = None,
    names: tuple[str, ...] = SEQUENCES,
    quick: bool = False,
) -> tuple[Verdict, tuple[Sequence, ...]]:
    """What holds, with the sequences; these are empty where alpha_f is impossible.

    own: of `own_bodies`, made once for many parameters; own bodies are not looked at when None.
    names: of the sequences that are judged. quick: nothing more is worked out once something does
    not hold, and what was not is infinite.
    """
    low, high = leans(step.height, climber.a, climber.r)
    if not low - ROUNDING <= parameters.alpha_f <= high + ROUNDING:
        why = (
            f"a lean of {np.degrees(parameters.alpha_f):.2f} degrees is impossible: the edge is "
            f"under the front half of the crawler from {np.degrees(low):.2f} to "
            f"{np.degrees(high):.2f} degrees"
        )
        off = min(parameters.alpha_f - low, high - parameters.alpha_f)
        return Verdict(dict.fromkeys(LEFT, float(off)), kind="reach", why=why), ()
    u = np.linspace(0.0, 1.0, rows)
    demands = climber.demands
    left = dict.fromkeys(LEFT, np.inf)
    left["room"] = _room(climber, step, parameters, names)
    left["slip"] = demands.friction - float(np.tan(parameters.alpha_f))
    made: list[Sequence] = []
    energy = 0.0
    for name in names:
        course = course_of(name, climber, step, parameters, u, spline)
        joints = joints_of(climber, course)
        _least(left, "reach", _reach(climber, course, joints))
        _least(left, "joints", _ends(climber, joints))
        _least(left, "crawler", _belts(climber, step, course))
        if quick and min(left.values()) < -ROUNDING:
            break
        one = worked_out(climber, step, name, course, joints)
        made.append(one)
        shares = np.abs(one.loads.torques) / demands.torques
        _least(left, "torque", 1.0 - float(shares.max()))
        _least(left, "margin", float(one.margin.min()) - demands.margin)
        _least(left, "bodies", _bodies(climber, step, one))
        if own is not None:
            kept = own.least_along(joints.q)[0] - OWN * small(climber)
            _least(left, "bodies", kept)
        energy += slow_energy(one.loads, joints.q, course.belt, demands.friction)
    kind, why = _words(left, climber)
    whole = energy if len(made) == len(names) else np.nan
    return Verdict(left, whole, kind, why), tuple(made)


def _least(left: dict[str, float], name: str, value: float) -> None:
    left[name] = min(left[name], value)


def own_bodies(climber: Climber) -> Sweep:
    """Pairs of the machine's own bodies."""
    return make_sweep(climber.machine, Obstacles(ground=False), OWN)


def small(climber: Climber) -> float:
    """Small machines keep less from themselves: by their arm, of two metres or more."""
    return min(1.0, climber.machine.max_reach / 2.0)


def _room(climber: Climber, step: Step, parameters: Parameters, names: tuple[str, ...]) -> float:
    """What is left of the ground before the edge and of the top, for tracks and bucket [m]."""
    side = climber.a + climber.r
    keep = 2.0 * climber.edge[0]
    left = [np.inf]
    if SEQUENCES[0] in names:
        left.append(step.before - parameters.p1 - side)
        left += [step.depth - parameters.p2 - keep, parameters.p2 - keep]
    if SEQUENCES[2] in names:
        left += [step.before - parameters.p3 - keep, step.depth - parameters.p4 - side]
    return float(min(left))


def _ends(climber: Climber, joints: Joints) -> float:
    """What is left to the joints' ends [rad]."""
    q, machine = joints.q, climber.machine
    return float(np.minimum(q - machine.lower, machine.upper - q).min())


def _reach(climber: Climber, course: Course, joints: Joints) -> float:
    """What is left of (22) and (23), as a share of the arm's length."""
    _, l2, l3, l4 = climber.machine.sun.lengths
    pivot = _boom_pivot(climber, joints.T, course.way)
    phi = climber.demands.attitude
    joint = course.held - l4 * np.array([course.way * np.cos(phi), np.sin(phi)])
    length = np.linalg.norm(joint - pivot, axis=1)
    left = np.minimum(l2 + l3 - length, length - abs(l2 - l3))
    return float(left.min()) / (l2 + l3)


def _boom_pivot(climber: Climber, T: Array, way: int) -> Array:
    """(m, 2) x, z of the boom's joint with the arm ahead or behind."""
    arm, f = climber.machine.arm, climber.demands.facing
    l1 = climber.machine.sun.lengths[0]
    ahead = way * f
    swing = arm.T_root_swing
    p = swing[:3, 3] + swing[:3, :3] @ np.array([ahead * l1, 0.0, arm.pivot_height])
    placed = np.einsum("mij,j->mi", T[:, :3, :3], p) + T[:, :3, 3]
    return np.asarray(placed[:, [0, 2]])


def _belts(climber: Climber, step: Step, course: Course) -> float:
    """What is left between belts and risers [m]."""
    a, r = climber.a, climber.r
    return min(
        float(belt_clearance(course.x - x, course.z, course.alpha, h, a, r).min())
        for x, h in step.risers
    )


def clearance_of(placed: Array, step: Step) -> Array:
    """(m - 1, B) of bodies with corners (m, B, 8, 3) to risers, tops and ground [m]: of what each
    covers on its way from one row to the next, taken as straight.
    """
    flat = placed[..., [0, 2]]
    swept = np.concatenate([flat[:-1], flat[1:]], axis=-2) if len(flat) > 1 else flat
    found = [body_clearance(swept - np.array([x, 0.0]), h) for x, h in step.risers]
    return np.asarray(np.minimum.reduce(found))


def _bodies(climber: Climber, step: Step, one: Sequence) -> float:
    """What is left of the clearance; the bucket's own bodies stand on the ground."""
    left = clearance_of(climber.bodies(one.joints.T, one.joints.q), step).min(axis=0)
    asked = np.where(climber.of_bucket, -SUNK, climber.demands.clearance)
    return float((left - asked).min())


def _words(left: dict[str, float], climber: Climber) -> tuple[str, str]:
    """The first that does not hold, in the order in which they are asked."""
    demands = climber.demands
    if left["room"] < -ROUNDING:
        short = -left["room"]
        return "room", f"the ground before the edge or its top is {short:.3f} m too short"
    if left["reach"] < 0.0:
        return "reach", "the arm does not reach from the crawler to the bucket all the way"
    if left["joints"] < -ROUNDING:
        past = np.degrees(-left["joints"])
        return "reach", f"a joint would have to go {past:.1f} degrees past its end"
    if left["crawler"] < -1e-6:
        return "collision", f"the crawler would be {-left['crawler']:.3f} m inside the step"
    if left["bodies"] < 0.0:
        near = demands.clearance + left["bodies"]
        return "collision", f"a body would come within {near:.3f} m of step, ground or another body"
    if left["margin"] < 0.0:
        near = demands.margin + left["margin"]
        return "stability", f"it would come within {near:.3f} m of tipping over"
    if left["torque"] < 0.0:
        return "torque", f"a joint would need {100.0 * (1.0 - left['torque']):.0f} % of its torque"
    if left["slip"] < 0.0:
        return "stability", "it would slide off the edge: the lean is steeper than friction holds"
    return "", ""
