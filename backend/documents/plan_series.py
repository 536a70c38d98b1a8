"""What Figs. 5-7 of Yamashita and Kikuuwe 2025 consist of, in a plan's document."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

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
