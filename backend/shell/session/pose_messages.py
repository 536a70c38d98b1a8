"""A machine's pose to the messages that its sensors would have sent.

A pose is that of the base (the URDF's root); sensors sit elsewhere. The antenna's lever and the
heading sensor's axis are those of the machine's description, so that fusion gives the pose back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from backend.fusion.motion import tilt as root_tilt
from backend.fusion.rig import make_rig
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.shell.link.encode import (
    encode_fix,
    encode_heading,
    encode_imu,
    encode_joint_states,
)
from backend.shell.session.format import Message
from backend.site.site import Site
from backend.spatial.types import Array

SIGMA_POSITION = 0.02  # [m], where nothing else is stated: RTK, Sun 2020, Section 5.1
SIGMA_YAW = math.radians(0.2)  # [rad]
SIGMA_TILT = math.radians(0.1)  # [rad]


class PoseMessages:
    """Encodes the streams of one machine of a site."""

    def __init__(self, site: Site, name: str) -> None:
        self.name = name
        self.site = site
        described = site.machine(name)
        self.machine = _machine(described.model, described.sidecar, str(site.folder))
        self._prefix = described.prefix
        self._rig = make_rig(name, self.machine, site.frame)

    def joints(self, time: int, values: Mapping[str, float]) -> Message:
        """values: by role [rad], strokes by cylinder [m]; time: [ns since 1970]."""
        position = np.array(list(values.values()))
        data = encode_joint_states(time / 1e9, list(values), position, np.zeros(0))
        return self._message(time, "joint_states", data)

    def antenna(
        self, time: int, latitude: float, longitude: float, altitude: float, sigma: float
    ) -> Message:
        """Degrees, ellipsoidal height [m]; sigma: of one axis [m]."""
        data = encode_fix(time / 1e9, latitude, longitude, altitude, np.eye(3) * sigma**2)
        return self._message(time, "gnss/fix", data)

    def base(
        self,
        time: int,
        position: Array,
        attitude: tuple[float, float, float],
        swing: float,
        sigma: float,
    ) -> Message:
        """position: (3,) of the base in the site frame [m]; attitude: yaw, pitch, roll [rad]."""
        return self.antenna(time, *self.antenna_of(position, attitude, swing), sigma)

    def antenna_of(
        self, position: Array, attitude: tuple[float, float, float], swing: float
    ) -> tuple[float, float, float]:
        """Latitude, longitude [deg] and ellipsoidal height [m] of the antenna."""
        yaw, pitch, roll = attitude
        x, y, z = (root_tilt(pitch, roll) @ self._rig.antenna.at(np.array([swing]))[0]).tolist()
        c, s = math.cos(yaw), math.sin(yaw)
        lever = np.array([c * x - s * y, s * x + c * y, z])
        return self.site.frame.to_geodetic(np.asarray(position) + lever)

    def heading_sensor(
        self, time: int, heading: float, sigma: float, position: Array | None = None
    ) -> Message:
        """heading: of the sensor, counter-clockwise from grid east [rad]; position: (3,) site [m],
        for sites whose sensors count from true north."""
        where = np.zeros(3) if position is None else position
        wire = heading - self.site.frame.grid_yaw(0.0, where)
        data = encode_heading(time / 1e9, math.remainder(wire, math.tau), sigma**2)
        return self._message(time, "gnss/heading", data)

    def heading(
        self,
        time: int,
        attitude: tuple[float, float, float],
        swing: float,
        sigma: float,
        position: Array | None = None,
    ) -> Message:
        """The heading sensor's reading for a base of this attitude (yaw, pitch, roll) [rad]."""
        yaw, pitch, roll = attitude
        axis = root_tilt(pitch, roll) @ self._rig.forward.at(np.array([swing]))[0]
        heading = yaw + math.atan2(axis[1], axis[0])
        return self.heading_sensor(time, heading, sigma, position)

    def tilt(self, time: int, pitch: float, roll: float, yaw: float = 0.0) -> Message:
        """Pitch and roll of the tracks [rad], as an IMU on the base gives them."""
        variances = (SIGMA_TILT**2, SIGMA_TILT**2, math.pi**2)
        turn = _quaternion(yaw, pitch, roll)
        data = encode_imu(time / 1e9, "base", turn, np.zeros(3), variances)
        return self._message(time, "imu/base", data)

    def ground_altitude(self) -> float:
        """Ellipsoidal height of the antenna of a level machine at the height of the site's origin,
        for sources without heights [m]."""
        frame = self.site.frame
        lever = self._rig.antenna.at(np.zeros(1))[0]
        return float(frame.origin[2] + frame.geoid_offset + lever[2])

    def _message(self, time: int, suffix: str, data: bytes) -> Message:
        return Message(f"/{self._prefix}/{suffix}", time, data)


def _quaternion(yaw: float, pitch: float, roll: float) -> Array:
    """(4,) w, x, y, z of Rz(yaw) Ry(-pitch) Rx(roll), written out: tables have many rows."""
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    cp, sp = math.cos(-pitch / 2), math.sin(-pitch / 2)
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


@lru_cache(maxsize=16)
def _machine(model: str, sidecar: str | None, folder: str) -> Machine:
    return load_machine(model, sidecar, Path(folder))
