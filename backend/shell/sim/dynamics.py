"""How a simulated machine moves: first-order hydraulics, bounded accelerations, joint limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make
from backend.spatial.types import Array


@dataclass(frozen=True)
class Hydraulics:
    """Lags of the velocity loops [s]: valve and cylinder of a joint, motors of the tracks."""

    joint_lag: float = 0.08
    track_lag: float = 0.20

    def __post_init__(self) -> None:
        if not (self.joint_lag > 0.0 and self.track_lag > 0.0):
            raise ValueError("lags must be greater than 0 s")


@dataclass(frozen=True)
class SimState:
    """One machine. q, qd: (n,) joint values and rates [rad, rad/s], not wrapped; position: (3,) of
    the URDF root, site frame [m]; yaw, pitch, roll [rad]; travel: (2,) left, right track [m/s].
    """

    q: Array
    qd: Array
    position: Array
    yaw: float
    pitch: float
    roll: float
    travel: Array

    @property
    def T_site_root(self) -> Array:
        """(4, 4)"""
        return make(from_attitude(self.yaw, self.pitch, self.roll), self.position)


@dataclass(frozen=True)
class Demand:
    """Wanted velocities. joints: (n,) [rad/s]; travel: (2,) left, right track [m/s]."""

    joints: Array
    travel: Array


def standstill(machine: Machine) -> Demand:
    return Demand(np.zeros(len(machine.joints)), np.zeros(2))


@dataclass(frozen=True)
class Limits:
    """What the actuators can do, as arrays. lower, upper: (n,) [rad]; velocity, acceleration: (n,)
    [rad/s, rad/s^2]; travel_speed, travel_acceleration of a track [m/s, m/s^2]; gauge [m].
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    travel_speed: float
    travel_acceleration: float
    gauge: float


def limits_of(machine: Machine) -> Limits:
    return Limits(
        machine.lower,
        machine.upper,
        np.array([joint.max_velocity for joint in machine.joints]),
        np.array([joint.max_acceleration for joint in machine.joints]),
        machine.tracks.max_speed,
        machine.tracks.max_acceleration,
        machine.tracks.gauge,
    )


def step(
    state: SimState, demand: Demand, limits: Limits, hydraulics: Hydraulics, dt: float
) -> SimState:
    """The state `dt` seconds later. Velocities follow the demand with a first-order lag.

    Speeds, accelerations and joint limits hold whatever is demanded; a joint brakes in time to
    stop at its limit. Pitch and roll stay: the ground is a plane.
    """
    qd = _towards(
        state.qd,
        np.clip(demand.joints, -limits.velocity, limits.velocity),
        limits.acceleration,
        hydraulics.joint_lag,
        dt,
    )
    # From the distance that is left, v^2 = 2 a d; the step's own way is taken off beforehand.
    way = np.abs(state.qd) * dt
    up = np.sqrt(2.0 * limits.acceleration * np.maximum(limits.upper - state.q - way, 0.0))
    down = np.sqrt(2.0 * limits.acceleration * np.maximum(state.q - limits.lower - way, 0.0))
    qd = np.clip(qd, -down, up)
    free = state.q + 0.5 * (state.qd + qd) * dt
    q = np.clip(free, limits.lower, limits.upper)
    qd = np.where(q == free, qd, 0.0)

    travel = _towards(
        state.travel,
        np.clip(demand.travel, -limits.travel_speed, limits.travel_speed),
        limits.travel_acceleration,
        hydraulics.track_lag,
        dt,
    )
    position, yaw = state.position, state.yaw
    if travel.any() or state.travel.any():
        left, right = (float(v) for v in 0.5 * (state.travel + travel))
        forward, turn = 0.5 * (left + right), (right - left) / limits.gauge
        heading = yaw + 0.5 * turn * dt
        ahead = from_attitude(heading, state.pitch, state.roll)[:, 0]
        position = position + forward * dt * ahead
        yaw = yaw + turn * dt
    return SimState(q, qd, position, yaw, state.pitch, state.roll, travel)


def _towards(
    velocity: Array, wanted: Array, acceleration: Array | float, lag: float, dt: float
) -> Array:
    """First-order lag, exact over dt, with the acceleration bounded."""
    change = (wanted - velocity) * (1.0 - math.exp(-dt / lag))
    return velocity + np.clip(change, -acceleration * dt, acceleration * dt)
