"""Figs. 5-7 of Yamashita and Kikuuwe 2025, as a plan's document has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from backend.documents.plan_series import MotionSeries, PlanFigures
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.planning.trajectory.figures import Motion, initial_motion, motion_of
from backend.planning.trajectory.records import Task, Trajectory
from backend.spatial.types import Array


def figures(machine: Machine, task: Task, made: Trajectory, T_frame_root: Array) -> PlanFigures:
    """T_frame_root: (4, 4) to the frame of end points."""
    planned = motion_of(machine, task.payload, made.time, made.q, made.rates, made.accelerations)
    initial = initial_motion(machine, task, made.q[-1])
    return PlanFigures(
        initial=MotionSeries(**series(machine, initial, T_frame_root)),
        planned=MotionSeries(**series(machine, planned, T_frame_root)),
    )


def series(machine: Machine, motion: Motion, T_frame_root: Array) -> dict[str, Any]:
    """The fields of `MotionSeries`."""
    return {
        "time": _short(motion.time),
        "end_point": np.round(end_point(machine, motion.q, T_frame_root), 4).tolist(),
        "swing": _short(motion.swing),
        "critical_swing": _short(motion.critical_swing),
        "lift": _short(motion.lift),
        "critical_lift": _short(motion.critical_lift),
    }


def _short(values: Array) -> list[Any]:
    return [round(v, 5) if np.isfinite(v) else None for v in values.tolist()]
