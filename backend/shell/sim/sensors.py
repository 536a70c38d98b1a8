"""What a simulated machine's sensors publish: the true state with noise, as encoded messages.

Rates and noise are those of the hardware of Sun 2020 (Section 5.1, Appendix A) unless the site
file says otherwise. Noise is white and Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from backend.errors import InputError
from backend.fusion.samples import Fix
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.machine.strokes import Stroke, length_and_slope
from backend.shell.link.encode import (
    encode_fix,
    encode_heading,
    encode_imu,
    encode_joint_states,
)
from backend.shell.sim.dynamics import SimState
from backend.site.site import Site
from backend.spatial.rotation import from_attitude, to_quaternion
from backend.spatial.types import Array

IMU_PERIOD = 0.02  # [s]
TILT_NOISE = math.radians(0.05)  # [rad]
RATE_NOISE = math.radians(0.1)  # [rad/s], gyroscopes and joint speeds

Measure: TypeAlias = Callable[[SimState, float, np.random.Generator], bytes]
"""(true state, stamp on the machine's clock [s], noise source) -> encoded message."""


@dataclass(frozen=True)
class Sensor:
    """topic, fields: the row of the topic table and what fills its key; period [s]."""

    topic: str
    fields: dict[str, str]
    period: float
    measure: Measure


def sensors(machine: Machine, site: Site, joints: str = "angles") -> tuple[Sensor, ...]:
    """The sensors of one machine on this site. joints: as in the site's `MachineSim`.

    Raises InputError when strokes are asked for and the machine's sidecar has no cylinder.
    """
    hardware = site.sim
    cylinders = machine.strokes if joints == "strokes" else ()
    if joints == "strokes" and not cylinders:
        raise InputError(
            f'machine "{machine.name}": sim.joints = "strokes", but its sidecar describes no '
            'cylinder; allowed is "angles".'
        )
    return (
        Sensor(
            "joint_states",
            {},
            hardware.joint_period,
            _joints(machine, cylinders, math.radians(hardware.joint_noise_deg)),
        ),
        Sensor("imu", {"link": "base"}, IMU_PERIOD, _base_imu(machine)),
        Sensor(
            "gnss_fix", {}, hardware.position_period, _gnss(machine, site, hardware.position_noise)
        ),
        Sensor(
            "gnss_heading",
            {},
            hardware.heading_period,
            _heading(machine, site, math.radians(hardware.heading_noise_deg)),
        ),
    )


def _joints(machine: Machine, cylinders: tuple[Stroke, ...], sigma: float) -> Measure:
    """Angles, and strokes of `cylinders` whose noise is that of the angles times their levers."""
    names = [joint.name for joint in machine.joints]
    by_joint = {stroke.joint: stroke for stroke in cylinders}
    for k, stroke in by_joint.items():
        names[k] = stroke.names[0]
    n = len(names)
    rate_sigma = RATE_NOISE if sigma > 0.0 else 0.0

    def measure(state: SimState, stamp: float, rng: np.random.Generator) -> bytes:
        noise = rng.standard_normal((2, n))
        position, velocity = state.q + sigma * noise[0], state.qd + rate_sigma * noise[1]
        for k, stroke in by_joint.items():
            q = np.clip(state.q[k], machine.joints[k].lower, machine.joints[k].upper)
            length, lever = length_and_slope(stroke, q)
            position[k] = length - stroke.closed_length + lever * (position[k] - q)
            velocity[k] *= lever
        return encode_joint_states(stamp, names, position, velocity)

    return measure


def _base_imu(machine: Machine) -> Measure:
    gauge = machine.tracks.gauge
    unknown_yaw = math.pi**2

    def measure(state: SimState, stamp: float, rng: np.random.Generator) -> bytes:
        pitch, roll = rng.normal((state.pitch, state.roll), TILT_NOISE)
        turn = float(state.travel[1] - state.travel[0]) / gauge
        R = from_attitude(state.yaw, state.pitch, state.roll)
        rate = R.T @ np.array([0.0, 0.0, turn]) + rng.normal(0.0, RATE_NOISE, 3)
        q = to_quaternion(from_attitude(state.yaw, pitch, roll))
        return encode_imu(stamp, "base", q, rate, (TILT_NOISE**2, TILT_NOISE**2, unknown_yaw))

    return measure


def antenna_position(machine: Machine, state: SimState) -> Array:
    """(3,) site frame [m]."""
    T = link_poses(machine, state.q, state.T_site_root)[machine.antenna.link]
    return np.asarray(T[:3, :3] @ machine.antenna.position + T[:3, 3])


def _gnss(machine: Machine, site: Site, sigma: float) -> Measure:
    covariance = np.eye(3) * sigma**2

    def measure(state: SimState, stamp: float, rng: np.random.Generator) -> bytes:
        position = antenna_position(machine, state) + rng.normal(0.0, sigma, 3)
        latitude, longitude, height = site.frame.to_geodetic(position)
        return encode_fix(stamp, latitude, longitude, height, covariance, Fix.RTK_FIXED)

    return measure


def heading_of(machine: Machine, state: SimState) -> float:
    """Where the heading sensor points, counter-clockwise from grid east [rad].

    On tracks: their yaw. On the upper body: the horizontal direction of its x axis, which at swing
    0 is the tracks'. The sidecar's offset is added to either.
    """
    x_root = np.array([1.0, 0.0, 0.0])
    if machine.heading_of == "upper":
        upper = next(i for i, link in enumerate(machine.links) if link.joint == 0)
        turned = link_poses(machine, state.q)[upper, :3, :3]
        rest = link_poses(machine, np.zeros_like(state.q))[upper, :3, :3]
        x_root = turned @ rest.T @ x_root
    # The offset turns about the body's own vertical axis, as the antennas are mounted.
    c, s = math.cos(machine.heading_offset), math.sin(machine.heading_offset)
    x_root = np.array([c * x_root[0] - s * x_root[1], s * x_root[0] + c * x_root[1], x_root[2]])
    x = from_attitude(state.yaw, state.pitch, state.roll) @ x_root
    return math.atan2(x[1], x[0])


def _heading(machine: Machine, site: Site, sigma: float) -> Measure:
    def measure(state: SimState, stamp: float, rng: np.random.Generator) -> bytes:
        heading = heading_of(machine, state) + sigma * rng.standard_normal()
        # The receiver adds the grid convergence to true-north headings: take it off here.
        correction = site.frame.grid_yaw(0.0, state.position)
        wire = math.remainder(heading - correction, 2.0 * math.pi)
        return encode_heading(stamp, wire, sigma**2)

    return measure
