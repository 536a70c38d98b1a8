"""Figs. 5-7 of Yamashita and Kikuuwe 2025, as a plan's document has them."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field

from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.planning.trajectory.figures import Motion, initial_motion, motion_of
from backend.planning.trajectory.records import Task, Trajectory
from backend.spatial.types import Array

Row = list[float]
Values = Annotated[
    list[float | None], Field(description="null where no rate or acceleration tips it, or unknown")
]


class MotionSeries(BaseModel):
    """One trajectory over its time. Limits are of two masses on level ground."""

    time: list[float] = Field(description="[s]")
    end_point: list[Row] = Field(description="in the document's frame [m]")
    swing: list[float] = Field(description="rate [rad/s]")
    critical_swing: Values = Field(description="Omega_c [rad/s]; (8), (9), corrected")
    lift: Values = Field(description="a_z, upward acceleration of arm and load [m/s^2]")
    critical_lift: Values = Field(description="a_cz [m/s^2]; (7), corrected")


class PlanFigures(BaseModel):
    """The simple trajectory and the planned one."""

    initial: MotionSeries = Field(
        description="straight in joint space, as fast as the joints alone allow"
    )
    planned: MotionSeries


class FollowedSeries(MotionSeries):
    """What the sensors saw while a trajectory was followed."""

    at: list[float] = Field(description="the path's time [s]; time counts from the beginning")
    joints: list[Row] = Field(description="[rad]")


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
