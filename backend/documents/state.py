"""The state document: one set of machine states, as `assess` reads it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from backend.errors import InputError
from backend.machine.model import Machine
from backend.site.messages import sentence
from backend.spatial.types import Array

Number = Annotated[float, Field(allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]

LIMIT_TOLERANCE = 0.02
"""How far a joint value may lie beyond its limit: sensors and stops are not exact [rad]."""


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid")


class Sigma(Table):
    """Standard deviations."""

    position: NotNegative = Field(0.0, description="of each coordinate [m]")
    yaw: NotNegative = Field(0.0, description="of the base yaw [rad]")
    joints: NotNegative = Field(0.0, description="of each joint value [rad]")


class MachineStateDocument(Table):
    """One machine. R = Rz(yaw) Ry(-pitch) Rx(roll)."""

    model: str = Field(min_length=1, description="shipped model or path of a URDF or xacro file")
    position: Vector = Field(description="of the URDF root, in the document's frame [m]")
    yaw: Number = Field(0.0, description="of the tracks, counter-clockwise from grid east [rad]")
    pitch: Number = Field(0.0, ge=-1.5, le=1.5, description="positive raises the front [rad]")
    roll: Number = Field(0.0, ge=-1.5, le=1.5, description="about the forward axis [rad]")
    joints: dict[str, Number] = Field(description="the URDF's own joint values by role [rad]")
    joint_velocities: dict[str, Number] = Field(default_factory=dict, description="[rad/s]")
    joint_accelerations: dict[str, Number] = Field(
        default_factory=dict, description="for stability only [rad/s^2]"
    )
    payload: NotNegative = Field(0.0, description="at the end point, for stability only [kg]")
    sigma: Sigma = Field(default_factory=Sigma)


class ObstacleDocument(Table):
    """A box of the site."""

    name: str = Field(min_length=1)
    center: Vector = Field(description="[m]")
    rotation: tuple[Vector, Vector, Vector] = Field(description="columns are the box axes")
    half_extents: tuple[Positive, Positive, Positive] = Field(description="[m]")

    @model_validator(mode="after")
    def _is_rotation(self) -> ObstacleDocument:
        R = np.array(self.rotation)
        if np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
            raise ValueError("rotation is not a rotation matrix (orthonormal, determinant 1)")
        return self


class StateDocument(Table):
    """One set of machine states at one time."""

    time: Number = Field(0.0, description="[s]")
    frame: Literal["projected", "site"] = Field(
        "projected", description="of all positions: the site's projected CRS, or the site frame"
    )
    machines: dict[str, MachineStateDocument] = Field(min_length=1)
    obstacles: list[ObstacleDocument] = Field(default_factory=list)


def parse_state(data: Any, where: str) -> StateDocument:
    """A validated state; raises InputError naming `where` (a file, or a file and line)."""
    if not isinstance(data, dict):
        raise InputError(f"{where}: is not a JSON object; allowed is a state document.")
    try:
        return StateDocument.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {sentence(error, StateDocument)}") from error


def joint_vector(machine: Machine, values: dict[str, float], where: str) -> Array:
    """Joint values (n,) in the machine's order; every joint is needed and must be possible.

    Joints are named by role or by their URDF name. Raises InputError otherwise.
    """
    q = _by_joint(machine, values, where)
    missing = [j.role for j, value in zip(machine.joints, q, strict=True) if math.isnan(value)]
    if missing:
        raise InputError(f"{where}.{missing[0]} is missing; it is required.")
    for joint, value in zip(machine.joints, q, strict=True):
        low, high = joint.lower - LIMIT_TOLERANCE, joint.upper + LIMIT_TOLERANCE
        if not low <= value <= high or abs(value) > 100.0:
            allowed = (
                "any angle in radians"
                if joint.continuous
                else f"{joint.lower:.3f} to {joint.upper:.3f} rad"
            )
            raise InputError(f"{where}.{joint.role} is {value:g}; allowed is {allowed}.")
    return q


def velocity_vector(machine: Machine, values: dict[str, float], where: str) -> Array:
    """Joint velocities (n,) [rad/s]; what is not given is 0."""
    return np.nan_to_num(_by_joint(machine, values, where))


def _by_joint(machine: Machine, values: dict[str, float], where: str) -> Array:
    index = {name: k for k, j in enumerate(machine.joints) for name in (j.role, j.name)}
    q = np.full(len(machine.joints), np.nan)
    for name, value in values.items():
        if name not in index:
            roles = ", ".join(j.role for j in machine.joints)
            raise InputError(
                f"{where}.{name} is not a joint of {machine.name}; allowed are {roles}."
            )
        q[index[name]] = value
    return q
