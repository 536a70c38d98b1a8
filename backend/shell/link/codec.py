"""Bytes to records: CDR as ROS 2 writes it, decoded into `backend.fusion.samples`.

Structure is checked here: type, lengths, sizes, names. Values (NaN, implausible, late) are judged
by the fusion, which counts them per stream.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from backend.fusion.samples import (
    AttitudeSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    ProjectedSample,
    Sample,
)
from backend.shell.link.messages import AgentStatus, Command, MotionLimits, TrueState
from backend.shell.link.topics import Topic, match, topic
from backend.spatial.rotation import from_quaternion, to_attitude
from backend.spatial.types import Array

MAX_NAMES = 64
MAX_TEXT = 256

Message: TypeAlias = Sample | Command | AgentStatus | TrueState
_Reader: TypeAlias = Callable[[Any, str, float, dict[str, str]], Message]


class DecodeError(Exception):
    """Bytes that are not the message that their key promises."""


def decode(machine: str, suffix: str, payload: bytes, arrival: float) -> Message:
    """The record in `payload`, published by `machine` under `{prefix}/{suffix}`.

    arrival: local clock [s]. Raises DecodeError for unknown keys and for anything malformed; the
    memory used is bounded by the payload's size.
    """
    found = match(suffix)
    if found is None:
        raise DecodeError(f"no topic is called {suffix!r}")
    row, fields = found
    reader = _READERS.get(row.name)
    if reader is None:
        raise DecodeError(f"{suffix} is not decoded into a record")
    try:
        return reader(message_of(row, payload), machine, arrival, fields)
    except DecodeError:
        raise
    except Exception as error:  # whatever strangers' bytes provoke in the decoder
        raise DecodeError(f"{suffix}: {error}") from error


def message_of(row: Topic, payload: bytes) -> Any:
    """The ROS 2 message in `payload`. Raises DecodeError, and for broken bytes anything else."""
    if not 4 < len(payload) <= row.max_bytes:
        raise DecodeError(f"{row.name}: {len(payload)} bytes, allowed are 5 to {row.max_bytes}")
    from backend.shell.link.typestore import TYPESTORE

    return TYPESTORE.deserialize_cdr(payload, row.type)


def stamp_of(msg: Any) -> float:
    """[s] of a message's header. Raises DecodeError."""
    stamp = msg.header.stamp
    if stamp.sec < 0 or stamp.nanosec >= 1_000_000_000:
        raise DecodeError(f"stamp {stamp.sec} s + {stamp.nanosec} ns is no time")
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _names(
    names: list[str], arrays: dict[str, Any], may_be_empty: tuple[str, ...]
) -> tuple[str, ...]:
    """Names that agree with the arrays beside them."""
    if not 0 < len(names) <= MAX_NAMES or len(set(names)) != len(names):
        raise DecodeError(f"{len(names)} names, allowed are 1 to {MAX_NAMES} different ones")
    for what, values in arrays.items():
        if len(values) != len(names) and not (what in may_be_empty and len(values) == 0):
            raise DecodeError(f"{len(values)} values of {what} for {len(names)} names")
    for name in names:
        text_of(name)
    return tuple(names)


def text_of(text: str) -> str:
    """`text` as it is. Raises DecodeError when it is too long."""
    if len(text) > MAX_TEXT:
        raise DecodeError(f"a text of {len(text)} characters, allowed are {MAX_TEXT}")
    return text


def _array(values: Any) -> Array:
    """A copy that no longer holds on to the message's buffer."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _joints(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> JointSample:
    arrays = {"position": msg.position, "velocity": msg.velocity, "effort": msg.effort}
    names = _names(msg.name, arrays, may_be_empty=("velocity", "effort"))
    return JointSample(
        machine, stamp_of(msg), arrival, names, _array(msg.position), _array(msg.velocity)
    )


# NavSatStatus.status, by REP 145 and the comments of sensor_msgs: -1 none, 0 unaugmented, 1
# satellite-based augmentation, 2 ground-based augmentation, which RTK drivers report for both the
# fixed and the float solution. Covariance tells these apart: float is worse than 0.1 m (1 sigma,
# horizontal), and unknown covariance counts as float, the worse of the two.
RTK_FIXED_SIGMA = 0.1


def fix_quality(status: int, covariance: Array, covariance_known: bool) -> Fix:
    """Fix of NavSatFix.status.status and position_covariance (3, 3) [m^2]."""
    if status < 0:
        return Fix.NONE
    if status == 0:
        return Fix.SINGLE
    if status == 1:
        return Fix.SBAS
    variance = max(float(covariance[0, 0]), float(covariance[1, 1]))
    if covariance_known and 0.0 < variance <= RTK_FIXED_SIGMA**2:
        return Fix.RTK_FIXED
    return Fix.RTK_FLOAT


def _fix(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> FixSample:
    known = msg.position_covariance_type != 0
    covariance = _array(msg.position_covariance).reshape(3, 3)
    fix = fix_quality(int(msg.status.status), covariance, known)
    if not known:  # the standard says: to be ignored then
        covariance = np.zeros((3, 3))
    return FixSample(
        machine,
        stamp_of(msg),
        arrival,
        float(msg.latitude),
        float(msg.longitude),
        float(msg.altitude),
        covariance,
        fix,
    )


def _projected(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> ProjectedSample:
    position = _array([msg.point.x, msg.point.y, msg.point.z])
    return ProjectedSample(machine, stamp_of(msg), arrival, position, np.zeros((3, 3)))


def _orientation(msg: Any) -> Array:
    """(4,) w, x, y, z; a unit quaternion up to the sender's rounding."""
    q = msg.orientation
    wxyz = _array([q.w, q.x, q.y, q.z])
    length = math.hypot(q.w, q.x, q.y, q.z)
    if not abs(length - 1.0) < 0.05:  # also refuses NaN
        raise DecodeError(f"an orientation of length {length:.3g}, allowed is 1")
    return wxyz


def _variance(covariance: Any, *indices: int) -> float:
    """The largest of the diagonal entries; 0 when unknown, which sensor_msgs/Imu marks by -1."""
    if float(covariance[0]) == -1.0:
        return 0.0
    return max(float(covariance[i]) for i in indices)


def _heading(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> HeadingSample:
    if float(msg.orientation_covariance[0]) == -1.0:
        raise DecodeError("gnss/heading: covariance -1 says that there is no orientation")
    yaw = to_attitude(from_quaternion(_orientation(msg)))[0]
    variance = _variance(msg.orientation_covariance, 8)
    return HeadingSample(machine, stamp_of(msg), arrival, float(yaw), variance)


def _attitude(msg: Any, machine: str, arrival: float, fields: dict[str, str]) -> AttitudeSample:
    rate = msg.angular_velocity
    return AttitudeSample(
        machine,
        stamp_of(msg),
        arrival,
        text_of(fields["link"]),
        _orientation(msg),
        _array([rate.x, rate.y, rate.z]),
        _variance(msg.orientation_covariance, 0, 4),
    )


def _command(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> Command:
    if len(msg.name) == 0 and len(msg.velocity) == 0:
        names: tuple[str, ...] = ()  # travel only
    else:
        names = _names(msg.name, {"velocity": msg.velocity}, may_be_empty=())
    return Command(
        machine,
        stamp_of(msg),
        arrival,
        int(msg.sequence),
        float(msg.time_to_live),
        text_of(msg.holder),
        int(msg.token),
        names,
        _array(msg.velocity),
        float(msg.travel_left),
        float(msg.travel_right),
    )


def _status(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> AgentStatus:
    return AgentStatus(
        machine,
        stamp_of(msg),
        arrival,
        text_of(msg.mode),
        text_of(msg.holder),
        int(msg.token),
        int(msg.sequence),
        float(msg.command_age),
        float(msg.limit),
        int(msg.accepted),
        int(msg.refused),
    )


def _truth(msg: Any, machine: str, arrival: float, _: dict[str, str]) -> TrueState:
    arrays = {"position": msg.position, "velocity": msg.velocity}
    names = _names(msg.name, arrays, may_be_empty=())
    return TrueState(
        machine,
        stamp_of(msg),
        arrival,
        names,
        _array(msg.position),
        _array(msg.velocity),
        _array([msg.base.x, msg.base.y, msg.base.z]),
        float(msg.yaw),
        float(msg.pitch),
        float(msg.roll),
        float(msg.travel_left),
        float(msg.travel_right),
    )


_READERS: dict[str, _Reader] = {
    "joint_states": _joints,
    "imu": _attitude,
    "gnss_fix": _fix,
    "gnss_heading": _heading,
    "gnss_projected": _projected,
    "cmd": _command,
    "status": _status,
    "truth": _truth,
}


def decode_clock(payload: bytes) -> float:
    """The machine's clock [s] from the answer to a clock query. Raises DecodeError."""
    from backend.shell.link.typestore import TYPESTORE

    try:
        time = TYPESTORE.deserialize_cdr(payload, "builtin_interfaces/msg/Time")
    except Exception as error:
        raise DecodeError(f"clock: {error}") from error
    if time.sec < 0 or time.nanosec >= 1_000_000_000:
        raise DecodeError(f"clock: {time.sec} s + {time.nanosec} ns is no time")
    return float(time.sec + 1e-9 * time.nanosec)


def decode_limits(machine: str, payload: bytes, arrival: float) -> MotionLimits:
    """The motion limits in `payload`; arrival: local clock [s]. Raises DecodeError."""
    try:
        msg = message_of(topic("limits"), payload)
        arrays = {"negative": msg.negative, "positive": msg.positive}
        names = _names(msg.name, arrays, may_be_empty=())
        return MotionLimits(
            machine,
            stamp_of(msg),
            arrival,
            int(msg.sequence),
            float(msg.time_to_live),
            int(msg.token),
            names,
            _array(msg.negative),
            _array(msg.positive),
        )
    except DecodeError:
        raise
    except Exception as error:  # whatever strangers' bytes provoke in the decoder
        raise DecodeError(f"limits: {error}") from error


def decode_picture(payload: bytes) -> tuple[float, bytes]:
    """The stamp [s] and the JPEG of an answer to a question for a picture. Raises DecodeError."""
    try:
        msg = message_of(topic("camera"), payload)
        stamp, jpeg = stamp_of(msg), bytes(msg.data)
    except DecodeError:
        raise
    except Exception as error:  # whatever strangers' bytes provoke in the decoder
        raise DecodeError(f"camera: {error}") from error
    if not jpeg.startswith(b"\xff\xd8"):
        raise DecodeError(f"camera: {len(jpeg)} bytes that are no JPEG")
    return stamp, jpeg
