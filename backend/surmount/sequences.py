"""The three sequences of Jayasekara and Arisumi 2015: where crawler and bucket are, row by row.

Each is timed alone. The bucket's edge keeps its place, the crawler moves, the joints follow.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array, BoolArray
from backend.surmount.laws import rise, smooth_step
from backend.surmount.machine import Climber
from backend.surmount.outline import lean, on_both, rear_wheel
from backend.surmount.records import Parameters, Spline, Step

SHORTEST = 1.0
"""No sequence is shorter [s]."""


class Course(NamedTuple):
    """Of a sequence over u in 0..1. x, z: (m,) of P_b [m]; alpha: (m,) its lean [rad]; belt: (m,)
    way of the belts over the crawler since the start [m]; rear, front: (m,) x of the lines that
    bear the crawler, and of the bucket's edge [m]; held: (2,) x, z of the middle of the bucket's
    bar; way: 1 with the arm ahead, -1 behind.
    """

    u: Array
    x: Array
    z: Array
    alpha: Array
    belt: Array
    held: Array
    way: int


def sequence_1(
    climber: Climber, step: Step, parameters: Parameters, u: Array, spline: Spline | None = None
) -> Course:
    """The front is lifted by the bucket on the step while the rear wheel rolls on the ground:
    x by Eq. (3), z over x by Eq. (7), the belts by (16) and (17).

    Eq. (17) is the wheel's speed over the ground; the belts turn against the crawler, which turns
    itself: its lean's rate is added.
    """
    a, r = climber.a, climber.r
    x_f, z_f, _ = on_both(parameters.alpha_f, step.height, a, r)
    share = smooth_step(u).value
    x = -parameters.p1 + (x_f + parameters.p1) * share
    z = z_f * rise(share, spline)
    alpha = lean(z, a, r)
    belt = rear_wheel(x, alpha, a, r) + r * alpha
    held = np.array([parameters.p2, step.height + climber.edge[0]])
    return Course(u, x, z, alpha, belt - belt[0], held, 1)


def sequence_2_1(climber: Climber, step: Step, parameters: Parameters, u: Array) -> Course:
    """The rear is lifted by the bucket behind, the crawler turning about the edge with its belts
    locked: x by Eq. (8) with its offset, z by Eq. (9)."""
    a, r, h = climber.a, climber.r, step.height
    x_f1, _, e = on_both(parameters.alpha_f, h, a, r)
    x = x_f1 + (-e - x_f1) * smooth_step(u).value
    z = h - np.sqrt(np.maximum(e**2 - x**2, 0.0))
    alpha = np.arctan2(h - z, -x) if e > 0.0 else np.zeros_like(x)
    held = np.array([-parameters.p3, climber.edge[0]])
    return Course(u, x, z, alpha, np.zeros_like(x), held, -1)


def sequence_2_2(climber: Climber, step: Step, parameters: Parameters, u: Array) -> Course:
    """Level over the top: x by Eq. (10) with its offset, z by (11), the belts by (18)."""
    e = on_both(parameters.alpha_f, step.height, climber.a, climber.r)[2]
    x = -e + (parameters.p4 + e) * smooth_step(u).value
    held = np.array([-parameters.p3, climber.edge[0]])
    flat = np.zeros_like(x)
    return Course(u, x, flat + step.height, flat, x - x[0], held, -1)


class Joints(NamedTuple):
    """Of a course. q: (m, n) [rad]; reached: (m,); T: (m, 4, 4) T_step_root."""

    q: Array
    reached: BoolArray
    T: Array


def joints_of(climber: Climber, course: Course) -> Joints:
    """The joints that keep the bucket where it is, Eqs. (12)-(15)."""
    T = climber.root_poses(course.x, course.z, course.alpha)
    q, reached = climber.arm(T, course.held, course.way)
    return Joints(q, reached, T)


def duration_of(climber: Climber, course: Course, q: Array) -> float:
    """As long as the slowest joint, or the belts, need at `demands.pace` of full speed [s]."""
    machine, pace = climber.machine, climber.demands.pace
    du = np.diff(course.u)
    rates = np.abs(np.diff(q, axis=0)) / du[:, None]
    needed = (rates / machine.max_velocity).max(initial=0.0) / pace
    belts = np.abs(np.diff(course.belt)) / du
    needed = max(float(needed), float(belts.max(initial=0.0)) / (pace * machine.tracks.max_speed))
    # Half of what the joints can accelerate by is enough by far: the law's peak is 7.5 / t^2.
    sharp = np.abs(np.diff(rates * np.sign(np.diff(q, axis=0)), axis=0)) / du[1:, None]
    effort = float((sharp / machine.max_acceleration).max(initial=0.0)) / pace
    return max(SHORTEST, needed, math.sqrt(effort))
