"""A use case of the working gauge, run by one or more methods: what the thesis's figures plot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from backend.machine.model import Machine
from backend.planning.simulate import STEP
from backend.planning.use_cases import UseCaseRun
from backend.spatial.rotation import to_attitude
from backend.spatial.types import Array

NameModel = Literal["pole", "ballast"]
MethodModel = Literal["none", "scaling", "potential", "constrained"]

WORDS = {
    "none": "no limit",
    "scaling": "velocity scaling",
    "potential": "potential field",
    "constrained": "constrained",
}
"""Of the methods, for people."""


class BoxModel(BaseModel):
    """A limit: a box along the axes of the machine's root frame."""

    name: str
    center: tuple[float, float, float] = Field(description="[m]")
    half_extents: tuple[float, float, float] = Field(description="[m]")


class NearestModel(BaseModel):
    """The moment of the shortest distance."""

    distance: float = Field(description="negative on overlap [m]")
    time: float = Field(description="[s]")
    pair: str = Field(description='"rotate to adjacent track"')


class VibrationModel(BaseModel):
    """How much the joints' speeds vibrate."""

    sign_changes: int = Field(description="of the joints' speeds, all joints")
    reversals: int = Field(description="of the joints' accelerations, all joints")
    energy: float = Field(description="of the joints' speeds above 2 Hz [rad^2/s]")


class RunModel(BaseModel):
    """One run; every list but `joints`, `pairs` has an entry for each instant of `times`."""

    method: MethodModel
    words: str = Field(description="the method for people")
    gain: float | None = Field(description="mu of Eq. (3.13) [m^4/s]; null of other methods")
    slope: float | None = Field(description="of the velocity dampers [1/s]; null of other methods")
    arrived: float | None = Field(description="at the end of the task [s]; null: never")
    nearest: NearestModel
    mean_error: float = Field(description="of the tool's position from what was meant [m]")
    max_error: float = Field(description="[m]")
    vibration: VibrationModel
    times: list[float] = Field(description="[s]")
    joints: list[list[float]] = Field(description="angles in the order of `roles` [rad]; Fig. 4.9")
    rates: list[list[float]] = Field(description="commanded [rad/s]; Fig. 4.3")
    distance: list[float] = Field(description="of the deciding pair [m]; Figs. 4.4 and 4.11")
    pair: list[int] = Field(description="which one that is, in `pairs`")
    pairs: list[str]
    scale: list[float] = Field(description="the smallest factor a speed was cut by, Eq. (3.12)")
    limited: list[bool] = Field(description="whether anything held the motion back")
    error: list[float] = Field(description="of the tool's position from what was meant [m]")
    turn_error: list[float] = Field(description="of its attitude [rad]")
    tool: list[list[float]] = Field(
        description="x, y, z [m], yaw, pitch, roll [rad] of the tool; Fig. 4.8"
    )
    designed: list[list[float]] = Field(description="the same as it was meant to be")


class UseCaseDocument(BaseModel):
    """What `cockpit use-case --json` prints. Frame: the machine's root, which stands on the top of
    rail, x along the track, y to the left, z up.
    """

    name: NameModel
    title: str
    figures: str = Field(description="of the thesis (Mäkinen 2021)")
    model: str = Field(description="of the machine")
    roles: list[str] = Field(description="of its joints")
    seconds: float = Field(description="a run lasts [s]")
    step: float = Field(description="between two instants [s]")
    upper: float = Field(description="p_u: from here on limits are felt [m]")
    lower: float = Field(description="p_l: what is kept from limits [m]")
    own: bool = Field(description="whether own bodies count in the distance, or limits alone do")
    limits: list[BoxModel]
    runs: list[RunModel] = Field(min_length=1)


def use_case_document(machine: Machine, model: str, runs: Sequence[UseCaseRun]) -> UseCaseDocument:
    """runs: one or more of the same use case; model: the machine's, by name."""
    case, settings = runs[0].case, runs[0].settings
    boxes = case.limits.boxes
    return UseCaseDocument(
        name=case.name,
        title=case.title,
        figures=case.figures,
        model=model,
        roles=[joint.role for joint in machine.joints],
        seconds=case.seconds,
        step=STEP,
        upper=settings.thresholds.upper,
        lower=settings.thresholds.lower,
        own=case.own,
        limits=[
            BoxModel(name=name, center=tuple(center), half_extents=tuple(half))
            for name, center, half in zip(
                case.limits.names, boxes.centers.tolist(), boxes.half_extents.tolist(), strict=True
            )
        ],
        runs=[run_model(one) for one in runs],
    )


def run_model(one: UseCaseRun) -> RunModel:
    """One run, to 0.1 mm and 0.01 mrad."""
    done, near = one.run, one.nearest
    k = int(near.distance.argmin())
    return RunModel(
        method=one.method,
        words=WORDS[one.method],
        gain=one.settings.gain if one.method == "potential" else None,
        slope=one.settings.rate,
        arrived=done.arrived if math.isfinite(done.arrived) else None,
        nearest=NearestModel(
            distance=float(near.distance[k]),
            time=float(done.times[k]),
            pair=near.words[near.pair[k]],
        ),
        mean_error=float(done.error[:, 0].mean()),
        max_error=float(done.error[:, 0].max()),
        vibration=VibrationModel(**one.vibration._asdict()),
        times=_short(done.times, 3),
        joints=_short(done.q, 5),
        rates=_short(done.rates, 5),
        distance=_short(near.distance, 4),
        pair=near.pair.tolist(),
        pairs=list(near.words),
        scale=_short(done.scale, 4),
        limited=[bool(why) for why in done.why],
        error=_short(done.error[:, 0], 4),
        turn_error=_short(done.error[:, 1], 5),
        tool=_short(poses(one.tool), 5),
        designed=_short(poses(one.designed), 5),
    )


def poses(T: Array) -> Array:
    """(m, 6) x, y, z [m], yaw, pitch, roll [rad] of T (m, 4, 4); yaw and roll without jumps."""
    yaw, pitch, roll = to_attitude(T[:, :3, :3])
    angles = np.stack([np.unwrap(yaw), pitch, np.unwrap(roll)], axis=1)
    return np.concatenate([T[:, :3, 3], angles], axis=1)


def _short(values: Array, decimals: int) -> Any:
    return np.round(values, decimals).tolist()
