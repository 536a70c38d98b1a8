"""CDR round trips, and 20,000 broken messages that must do no harm."""

from __future__ import annotations

import dataclasses
import math
import random
import struct
import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.fusion.samples import (
    AttitudeSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    ProjectedSample,
)
from backend.shell.link import encode
from backend.shell.link.codec import DecodeError, decode, decode_clock, decode_limits, fix_quality
from backend.shell.link.messages import AgentStatus, Command, MotionLimits, TrueState
from backend.shell.link.typestore import TYPESTORE
from backend.spatial.angles import difference
from backend.spatial.rotation import from_attitude, to_quaternion

STAMP = 1_700_000_000.123456
finite = st.floats(-1e6, 1e6)

COMMAND = Command(
    "left", STAMP, 2.0, 17, 0.2, "ann", 4, ("swing", "boom"), np.array([0.1, -0.2]), 0.3, -0.3
)
LIMITS = MotionLimits(
    "left",
    STAMP,
    2.0,
    3,
    0.3,
    4,
    ("swing", "track_left"),
    np.array([0.1, 1.0]),
    np.array([0.0, 0.5]),
)
STATUS = AgentStatus("left", STAMP, 2.0, "remote", "ann", 4, 17, 0.03, 1.0, 18, 2)
TRUTH = TrueState(
    "left",
    STAMP,
    2.0,
    ("swing", "boom"),
    np.array([0.1, -0.2]),
    np.array([0.0, 0.5]),
    np.array([308605.0, 4129950.0, 1.5]),
    1.0,
    0.02,
    -0.01,
    0.1,
    0.2,
)
QUATERNION = to_quaternion(from_attitude(1.0, 0.1, -0.2))
GOOD = {
    "joint_states": encode.encode_joint_states(STAMP, ["a", "b"], np.array([1.0, 2.0]), np.ones(2)),
    "imu/base": encode.encode_imu(STAMP, "base", QUATERNION, np.ones(3), (0.01, 0.02, 0.5)),
    "gnss/fix": encode.encode_fix(STAMP, 37.0, 127.0, 50.0, np.diag([1e-4, 1e-4, 4e-4])),
    "gnss/heading": encode.encode_heading(STAMP, 2.5, 1e-4),
    "gnss/projected": encode.encode_projected(STAMP, np.array([308605.0, 4129950.0, 1.5])),
    "cmd": encode.encode_command(COMMAND),
    "status": encode.encode_status(STATUS),
    "truth": encode.encode_truth(TRUTH),
}


def assert_same(a, b):
    assert type(a) is type(b)
    for name in a.__dataclass_fields__:
        x, y = getattr(a, name), getattr(b, name)
        if name == "stamp":
            assert abs(x - y) < 1e-6
        elif isinstance(x, np.ndarray):
            np.testing.assert_array_equal(x, y)
        else:
            assert x == y, name


@pytest.mark.parametrize(
    ("suffix", "record"), [("cmd", COMMAND), ("status", STATUS), ("truth", TRUTH)]
)
def test_own_messages_round_trip(suffix, record):
    assert_same(decode("left", suffix, GOOD[suffix], 2.0), record)


def test_limits_round_trip_and_broken_ones_are_refused():
    payload = encode.encode_limits(LIMITS)
    assert_same(decode_limits("left", payload, 2.0), LIMITS)
    for cut in range(0, len(payload), 3):
        with pytest.raises(DecodeError):
            decode_limits("left", payload[:cut], 2.0)
    short = encode.encode_limits(dataclasses.replace(LIMITS, positive=np.zeros(1)))
    with pytest.raises(DecodeError, match="values of positive"):
        decode_limits("left", short, 2.0)


@given(
    st.dictionaries(st.text(min_size=1, max_size=12), st.tuples(finite, finite), min_size=1),
    st.booleans(),
)
def test_joint_states_round_trip(joints, with_velocity):
    position = np.array([p for p, _ in joints.values()])
    velocity = np.array([v for _, v in joints.values()]) if with_velocity else np.zeros(0)
    payload = encode.encode_joint_states(STAMP, list(joints), position, velocity)
    got = decode("left", "joint_states", payload, 3.0)
    assert isinstance(got, JointSample)
    assert (got.machine, got.names, got.arrival) == ("left", tuple(joints), 3.0)
    np.testing.assert_array_equal(got.position, position)
    np.testing.assert_array_equal(got.velocity, velocity)
    assert abs(got.stamp - STAMP) < 1e-6


@given(st.floats(-math.pi, math.pi), st.floats(0.0, 1.0))
def test_heading_round_trip(heading, variance):
    got = decode("left", "gnss/heading", encode.encode_heading(STAMP, heading, variance), 0.0)
    assert isinstance(got, HeadingSample)
    assert abs(float(difference(got.heading, heading))) < 1e-9
    assert got.variance == variance


def test_fix_projected_and_attitude():
    fix = decode("left", "gnss/fix", GOOD["gnss/fix"], 1.0)
    assert isinstance(fix, FixSample)
    assert (fix.latitude, fix.longitude, fix.altitude) == (37.0, 127.0, 50.0)
    assert fix.fix is Fix.RTK_FIXED
    np.testing.assert_array_equal(fix.covariance, np.diag([1e-4, 1e-4, 4e-4]))
    projected = decode("left", "gnss/projected", GOOD["gnss/projected"], 1.0)
    assert isinstance(projected, ProjectedSample)
    np.testing.assert_array_equal(projected.position, [308605.0, 4129950.0, 1.5])
    attitude = decode("left", "imu/base", GOOD["imu/base"], 1.0)
    assert isinstance(attitude, AttitudeSample)
    assert attitude.link == "base"
    assert attitude.variance == 0.02
    np.testing.assert_allclose(attitude.orientation, QUATERNION)


@pytest.mark.parametrize(
    ("status", "sigma", "known", "fix"),
    [
        (-1, 0.01, True, Fix.NONE),
        (0, 0.01, True, Fix.SINGLE),
        (1, 0.01, True, Fix.SBAS),
        (2, 0.02, True, Fix.RTK_FIXED),
        (2, 0.1, True, Fix.RTK_FIXED),
        (2, 0.4, True, Fix.RTK_FLOAT),
        (2, 0.02, False, Fix.RTK_FLOAT),  # unknown counts as the worse one
        (2, 0.0, True, Fix.RTK_FLOAT),
        (2, math.nan, True, Fix.RTK_FLOAT),
    ],
)
def test_fix_quality(status, sigma, known, fix):
    assert fix_quality(status, np.eye(3) * sigma**2, known) is fix


@pytest.mark.parametrize("fix", list(Fix))
def test_every_fix_survives_the_wire(fix):
    sigma = 0.02 if fix is Fix.RTK_FIXED else 0.5
    payload = encode.encode_fix(STAMP, 37.0, 127.0, 50.0, np.eye(3) * sigma**2, fix)
    assert decode("left", "gnss/fix", payload, 1.0).fix is fix


def test_clock_round_trip_and_garbage():
    assert abs(decode_clock(encode.encode_clock(STAMP)) - STAMP) < 1e-6
    for bad in (b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00" + b"\xff" * 8):
        with pytest.raises(DecodeError):
            decode_clock(bad)


def _joint_state(names, position, velocity=(), sec=1, nanosec=0):
    types = TYPESTORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](sec, nanosec), "")
    msg = types["sensor_msgs/msg/JointState"](
        header, names, np.array(position), np.array(velocity, dtype=float), np.zeros(0)
    )
    return bytes(TYPESTORE.serialize_cdr(msg, msg.__msgtype__))


@pytest.mark.parametrize(
    "payload",
    [
        _joint_state(["a", "b"], [1.0]),
        _joint_state(["a", "a"], [1.0, 2.0]),
        _joint_state(["a"], [1.0], [1.0, 2.0]),
        _joint_state([], np.zeros(0)),
        _joint_state([f"j{i}" for i in range(65)], np.zeros(65)),
        _joint_state(["x" * 300], [1.0]),
        _joint_state(["a"], [1.0], sec=-5),
        _joint_state(["a"], [1.0], nanosec=2_000_000_000),
    ],
)
def test_inconsistent_joint_states_are_refused(payload):
    with pytest.raises(DecodeError):
        decode("left", "joint_states", payload, 0.0)


def test_unknown_keys_and_wrong_types_are_refused():
    for suffix in ("nothing", "imu/", "imu/a/b", "clock", "points", ""):
        with pytest.raises(DecodeError):
            decode("left", suffix, GOOD["joint_states"], 0.0)
    for suffix in ("gnss/fix", "imu/base", "joint_states"):
        with pytest.raises(DecodeError):
            decode("left", suffix, GOOD["gnss/projected"], 0.0)
    nan = encode.encode_imu(STAMP, "b", np.full(4, np.nan), np.zeros(3), (0.0, 0.0, 0.0))
    zero = encode.encode_imu(STAMP, "b", np.zeros(4), np.zeros(3), (0.0, 0.0, 0.0))
    for payload in (nan, zero):
        with pytest.raises(DecodeError, match="orientation"):
            decode("left", "imu/base", payload, 0.0)


def _broken(random_: random.Random) -> tuple[str, bytes]:
    """One message of a stranger: noise, or a good one cut, flipped, or with absurd lengths."""
    suffix = random_.choice(list(GOOD))
    payload = bytearray(GOOD[random_.choice(list(GOOD)) if random_.random() < 0.1 else suffix])
    kind = random_.randrange(4)
    if kind == 0:
        payload = bytearray(b"\x00\x01\x00\x00") + random_.randbytes(random_.randrange(300))
    elif kind == 1:
        del payload[random_.randrange(len(payload)) :]
    elif kind == 2:
        for _ in range(random_.randrange(1, 6)):
            payload[random_.randrange(len(payload))] = random_.randrange(256)
    else:
        at = 4 * random_.randrange(len(payload) // 4)
        payload[at : at + 4] = struct.pack("<I", random_.choice([2**32 - 1, 2**31, 10**8, 70_000]))
    return suffix, bytes(payload)


def test_twenty_thousand_broken_messages():
    """Each gives a record or a DecodeError, never another error, and memory stays flat."""
    random_ = random.Random(20)
    refused = 0
    for i in range(20_000):
        if i == 500:
            tracemalloc.start()
        suffix, payload = _broken(random_)
        try:
            decode("left", suffix, payload, 0.0)
        except DecodeError:
            refused += 1
        if i == 3000:  # tracing is slow; after these the rest runs without it
            current, peak = tracemalloc.get_traced_memory()
            tracemalloc.stop()
            assert peak < 5e6
            assert current < 2e6
    assert 10_000 < refused < 20_000


def test_a_heading_that_says_it_has_no_orientation_is_refused() -> None:
    message = TYPESTORE.deserialize_cdr(
        encode.encode_heading(STAMP, 2.5, 1e-4), "sensor_msgs/msg/Imu"
    )
    message.orientation_covariance = np.array([-1.0] + [0.0] * 8)
    payload = bytes(TYPESTORE.serialize_cdr(message, "sensor_msgs/msg/Imu"))
    with pytest.raises(DecodeError, match="no orientation"):
        decode("left", "gnss/heading", payload, 0.0)
