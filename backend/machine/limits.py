"""Joint limits and rates: the URDF's, then joint_limits.yaml (MoveIt), then the sidecar."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from backend.errors import InputError
from backend.machine.model import Joint
from backend.machine.sidecar import Limit
from backend.machine.urdf import Description, UrdfJoint

_VELOCITY = {"swing": 1.0, "boom": 0.45, "stick": 0.7, "bucket": 1.0, "tilt": 0.6, "rotate": 1.0}
_ACCELERATION = {"swing": 0.5, "boom": 0.6, "stick": 1.0, "bucket": 2.0, "tilt": 1.0, "rotate": 2.0}
_KEYS = {
    "has_position_limits",
    "min_position",
    "max_position",
    "has_velocity_limits",
    "max_velocity",
    "has_acceleration_limits",
    "max_acceleration",
    "has_deceleration_limits",
    "max_deceleration",
    "has_jerk_limits",
    "max_jerk",
    "has_effort_limits",
    "max_effort",
    "angle_wraparound",
}


def read_joint_limits(path: Path, robot: Description) -> dict[str, dict[str, float]]:
    """joint name -> key -> number, from a MoveIt joint_limits.yaml; limits turned off are left out.

    Raises InputError for a broken file, unknown joints or keys, and values that are no numbers.
    """
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}.") from None
    table = data.get("joint_limits") if isinstance(data, dict) else None
    if not isinstance(table, dict):
        raise InputError(f"{path}: no table 'joint_limits'; MoveIt's format is expected.")
    names = {joint.name for joint in robot.joints}
    result: dict[str, dict[str, float]] = {}
    for name, row in table.items():
        if name not in names:
            raise InputError(
                f"{path}: joint '{name}' is not in the robot; its joints are "
                f"{', '.join(sorted(names))}."
            )
        result[name] = _row(path, str(name), row)
    return result


def _row(path: Path, name: str, row: Any) -> dict[str, float]:
    if not isinstance(row, dict):
        raise InputError(f"{path}: joint_limits.{name} must be a table.")
    unknown = sorted(str(key) for key in row if key not in _KEYS)
    if unknown:
        raise InputError(
            f"{path}: joint_limits.{name}.{unknown[0]} is not known; allowed are "
            f"{', '.join(sorted(_KEYS))}."
        )
    numbers: dict[str, float] = {}
    for key, switch in (
        ("min_position", "has_position_limits"),
        ("max_position", "has_position_limits"),
        ("max_velocity", "has_velocity_limits"),
        ("max_acceleration", "has_acceleration_limits"),
        ("max_effort", "has_effort_limits"),
    ):
        if key not in row or not row.get(switch, True):
            continue
        value = row[key]
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise InputError(f"{path}: joint_limits.{name}.{key} = {value!r} must be a number.")
        if key in ("max_velocity", "max_acceleration", "max_effort") and value < 0:
            raise InputError(f"{path}: joint_limits.{name}.{key} = {value} must not be negative.")
        numbers[key] = float(value)
    return numbers


def actuated_joint(
    role: str,
    joint: UrdfJoint,
    stated: dict[str, float],
    sidecar: Limit | None,
    file: str,
    notes: list[str],
) -> Joint:
    """The joint with its limits; what no file states is assumed, and said in `notes`."""
    lower = -math.inf if joint.lower is None else joint.lower
    upper = math.inf if joint.upper is None else joint.upper
    lower = stated.get("min_position", lower)
    upper = stated.get("max_position", upper)
    velocity = stated.get("max_velocity", joint.velocity or 0.0)
    acceleration = stated.get("max_acceleration", 0.0)
    if sidecar is not None:
        lower = lower if sidecar.lower_deg is None else float(np.radians(sidecar.lower_deg))
        upper = upper if sidecar.upper_deg is None else float(np.radians(sidecar.upper_deg))
        velocity = _rate(sidecar.max_velocity, sidecar.max_velocity_deg, velocity)
        acceleration = _rate(sidecar.max_acceleration, sidecar.max_acceleration_deg, acceleration)
    if lower >= upper:
        raise InputError(
            f"{file}: joint '{joint.name}' ({role}): lower limit {lower:g} rad is not below the "
            f"upper limit {upper:g} rad."
        )
    if np.isfinite(lower) != np.isfinite(upper):
        raise InputError(
            f"{file}: joint '{joint.name}' ({role}): a continuous joint takes both lower and upper "
            f"limits or none; got {lower:g} and {upper:g} rad."
        )
    if velocity <= 0.0:
        velocity = _VELOCITY[role]
        notes.append(f"{role}: full speed of {velocity:g} rad/s is assumed")
    if acceleration <= 0.0:
        acceleration = _ACCELERATION[role]
        notes.append(f"{role}: acceleration of {acceleration:g} rad/s^2 is assumed")
    torque = stated.get("max_effort", joint.effort or 0.0)
    if sidecar is not None and sidecar.max_torque is not None:
        torque = sidecar.max_torque
    torque = torque if torque > 0.0 else math.inf
    return Joint(role, joint.name, lower, upper, velocity, acceleration, torque)


def _rate(radians: float | None, degrees: float | None, otherwise: float) -> float:
    if radians is not None:
        return radians
    return otherwise if degrees is None else float(np.radians(degrees))
