"""Records and plain values to bytes: ROS 2 messages in CDR, as machines publish them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from backend.fusion.samples import Fix
from backend.shell.link.messages import AgentStatus, Command, MotionLimits, TrueState
from backend.shell.link.typestore import TYPESTORE
from backend.spatial.types import AnyArray, Array

_Time = TYPESTORE.types["builtin_interfaces/msg/Time"]
_Header = TYPESTORE.types["std_msgs/msg/Header"]
_Point = TYPESTORE.types["geometry_msgs/msg/Point"]
_Vector3 = TYPESTORE.types["geometry_msgs/msg/Vector3"]
_Quaternion = TYPESTORE.types["geometry_msgs/msg/Quaternion"]
_JointState = TYPESTORE.types["sensor_msgs/msg/JointState"]
_Imu = TYPESTORE.types["sensor_msgs/msg/Imu"]
_NavSatFix = TYPESTORE.types["sensor_msgs/msg/NavSatFix"]
_NavSatStatus = TYPESTORE.types["sensor_msgs/msg/NavSatStatus"]
_Picture = TYPESTORE.types["sensor_msgs/msg/CompressedImage"]
_PointCloud2 = TYPESTORE.types["sensor_msgs/msg/PointCloud2"]
_PointField = TYPESTORE.types["sensor_msgs/msg/PointField"]
_PointStamped = TYPESTORE.types["geometry_msgs/msg/PointStamped"]
_Command = TYPESTORE.types["cockpit_msgs/msg/JointVelocityCommand"]
_Limits = TYPESTORE.types["cockpit_msgs/msg/MotionLimits"]
_Status = TYPESTORE.types["cockpit_msgs/msg/AgentStatus"]
_Truth = TYPESTORE.types["cockpit_msgs/msg/TrueState"]

NAVSAT_STATUS = {Fix.NONE: -1, Fix.SINGLE: 0, Fix.SBAS: 1, Fix.RTK_FLOAT: 2, Fix.RTK_FIXED: 2}
"""NavSatStatus.status of a Fix; RTK float and fixed differ by their covariance only."""


def _time(stamp: float) -> Any:
    nanoseconds = round(stamp * 1e9)
    return _Time(nanoseconds // 1_000_000_000, nanoseconds % 1_000_000_000)


def _header(stamp: float, frame: str) -> Any:
    return _Header(_time(stamp), frame)


def _bytes(message: Any) -> bytes:
    return bytes(TYPESTORE.serialize_cdr(message, message.__msgtype__))


def _vector(values: Sequence[float] | Array) -> Any:
    return np.ascontiguousarray(values, dtype=np.float64)


def encode_clock(time: float) -> bytes:
    """builtin_interfaces/Time of `time` [s]."""
    return _bytes(_time(time))


def encode_picture(stamp: float, frame: str, jpeg: bytes) -> bytes:
    """sensor_msgs/CompressedImage of a JPEG that shows the time `stamp` [s]."""
    return _bytes(_Picture(_header(stamp, frame), "jpeg", np.frombuffer(jpeg, dtype=np.uint8)))


def encode_cloud(
    stamp: float,
    sensor: str,
    points: AnyArray,
    intensity: AnyArray | None = None,
    times: AnyArray | None = None,
) -> bytes:
    """sensor_msgs/PointCloud2 of float32. stamp: moment of the turn [s]; sensor: the mount's name;
    points: (n, 3) in the sensor's frame [m]; intensity: (n,); times: (n,) when each point was
    measured, since the stamp [s]; both left out when None.
    """
    more = {
        name: values
        for name, values in (("intensity", intensity), ("time", times))
        if values is not None
    }
    names = ("x", "y", "z", *more)
    n, step = len(points), 4 * len(names)
    columns = np.empty((n, len(names)), dtype="<f4")
    columns[:, :3] = points
    for k, values in enumerate(more.values()):
        columns[:, 3 + k] = values
    fields = [_PointField(name, 4 * k, 7, 1) for k, name in enumerate(names)]  # 7: FLOAT32
    data = columns.reshape(-1).view(np.uint8)
    return _bytes(
        _PointCloud2(_header(stamp, sensor), 1, n, fields, False, step, n * step, data, True)
    )


def encode_joint_states(
    stamp: float, names: Sequence[str], position: Array, velocity: Array
) -> bytes:
    """sensor_msgs/JointState. position: (n,) [rad]; velocity: (n,) [rad/s] or empty."""
    nothing = np.zeros(0)
    header = _header(stamp, "")
    return _bytes(_JointState(header, list(names), _vector(position), _vector(velocity), nothing))


def encode_fix(
    stamp: float,
    latitude: float,
    longitude: float,
    altitude: float,
    covariance: Array,
    fix: Fix = Fix.RTK_FIXED,
) -> bytes:
    """sensor_msgs/NavSatFix. Degrees, ellipsoidal height [m]; covariance: (3, 3) ENU [m^2]."""
    status = _NavSatStatus(NAVSAT_STATUS[fix], 1)
    flat = _vector(covariance).reshape(9)
    known = 3 if flat.any() else 0
    return _bytes(
        _NavSatFix(_header(stamp, "gnss"), status, latitude, longitude, altitude, flat, known)
    )


def encode_projected(stamp: float, position: Array) -> bytes:
    """geometry_msgs/PointStamped. position: (3,) in the site's projected CRS [m]."""
    x, y, z = (float(value) for value in position)
    return _bytes(_PointStamped(_header(stamp, "projected"), _Point(x, y, z)))


def encode_imu(
    stamp: float, frame: str, orientation: Array, rate: Array, variances: Sequence[float]
) -> bytes:
    """sensor_msgs/Imu without accelerations.

    orientation: (4,) w, x, y, z of the link in ENU; rate: (3,) in the link [rad/s]; variances:
    of roll, pitch, yaw [rad^2].
    """
    w, x, y, z = (float(value) for value in orientation)
    p, q, r = (float(value) for value in rate)
    unknown = np.zeros(9)
    absent = np.array([-1.0] + [0.0] * 8)  # sensor_msgs/Imu: this part is not measured
    return _bytes(
        _Imu(
            _header(stamp, frame),
            _Quaternion(x, y, z, w),
            np.diag(_vector(variances)).reshape(9),
            _Vector3(p, q, r),
            unknown,
            _Vector3(0.0, 0.0, 0.0),
            absent,
        )
    )


def encode_heading(stamp: float, heading: float, variance: float) -> bytes:
    """A heading [rad, counter-clockwise from east] as sensor_msgs/Imu; variance [rad^2].

    Roll and pitch are not measured: their variances are those of any angle, pi^2.
    """
    orientation = np.array([np.cos(heading / 2.0), 0.0, 0.0, np.sin(heading / 2.0)])
    anything = float(np.pi**2)
    return encode_imu(stamp, "heading", orientation, np.zeros(3), (anything, anything, variance))


def encode_command(command: Command) -> bytes:
    """cockpit_msgs/JointVelocityCommand."""
    return _bytes(
        _Command(
            _header(command.stamp, ""),
            command.sequence,
            command.time_to_live,
            command.holder,
            command.token,
            list(command.names),
            _vector(command.velocity),
            command.travel_left,
            command.travel_right,
        )
    )


def encode_limits(limits: MotionLimits) -> bytes:
    """cockpit_msgs/MotionLimits."""
    return _bytes(
        _Limits(
            _header(limits.stamp, ""),
            limits.sequence,
            limits.time_to_live,
            limits.token,
            list(limits.names),
            _vector(limits.negative),
            _vector(limits.positive),
        )
    )


def encode_status(status: AgentStatus) -> bytes:
    """cockpit_msgs/AgentStatus."""
    return _bytes(
        _Status(
            _header(status.stamp, ""),
            status.mode,
            status.holder,
            status.token,
            status.sequence,
            status.command_age,
            status.limit,
            status.accepted,
            status.refused,
        )
    )


def encode_truth(truth: TrueState) -> bytes:
    """cockpit_msgs/TrueState."""
    x, y, z = (float(value) for value in truth.base)
    return _bytes(
        _Truth(
            _header(truth.stamp, ""),
            list(truth.names),
            _vector(truth.position),
            _vector(truth.velocity),
            _Point(x, y, z),
            truth.yaw,
            truth.pitch,
            truth.roll,
            truth.travel_left,
            truth.travel_right,
        )
    )
