"""PointCloud2 as others write it, by rosbags' own serializer, and clouds that are none."""

from __future__ import annotations

import math
import random
import struct
import tracemalloc
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.shell.link.cloud import Cloud, decode_cloud
from backend.shell.link.codec import DecodeError
from backend.shell.link.encode import encode_cloud
from backend.shell.link.typestore import TYPESTORE

STAMP = 1_700_000_000.25
POINTS = np.random.default_rng(0).uniform(-50.0, 50.0, (40, 3)).astype(np.float32)
SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8}  # of sensor_msgs/PointField's types
_types = TYPESTORE.types


def field(name: str, offset: int, datatype: int = 7, count: int = 1) -> Any:
    return _types["sensor_msgs/msg/PointField"](name, offset, datatype, count)


XYZ = [field(name, 4 * k) for k, name in enumerate("xyz")]


def message(data: bytes, **changes: Any) -> bytes:
    """A message of one row of points of 12 bytes, but for the changes."""
    header = _types["std_msgs/msg/Header"](
        _types["builtin_interfaces/msg/Time"](1_700_000_000, 250_000_000), "velodyne"
    )
    values = {
        "header": header,
        "height": 1,
        "width": len(data) // 12,
        "fields": XYZ,
        "is_bigendian": False,
        "point_step": 12,
        "row_step": len(data),
        "data": np.frombuffer(data, dtype=np.uint8),
        "is_dense": False,
    }
    msg = _types["sensor_msgs/msg/PointCloud2"](**{**values, **changes})
    return bytes(TYPESTORE.serialize_cdr(msg, msg.__msgtype__))


def test_own_clouds_survive_the_wire() -> None:
    got = decode_cloud(encode_cloud(STAMP, "lidar", POINTS), "left", 3.0)
    assert (got.machine, got.sensor, got.arrival) == ("left", "lidar", 3.0)
    assert abs(got.stamp - STAMP) < 1e-6
    assert got.points.dtype == np.float32
    np.testing.assert_array_equal(got.points, POINTS)


def test_own_clouds_are_standard_messages() -> None:
    payload = encode_cloud(STAMP, "roof", POINTS, np.arange(40.0))
    msg = TYPESTORE.deserialize_cdr(payload, "sensor_msgs/msg/PointCloud2")
    assert msg.header.frame_id == "roof"
    assert (msg.height, msg.width, msg.point_step, msg.row_step) == (1, 40, 16, 640)
    named = [(f.name, f.offset, f.datatype, f.count) for f in msg.fields]
    assert named == [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("intensity", 12, 7, 1)]
    for k, row in enumerate(struct.iter_unpack("<ffff", bytes(msg.data))):
        assert row == (*POINTS[k].tolist(), float(k))
    np.testing.assert_array_equal(decode_cloud(payload, "left", 0.0).points, POINTS)


@st.composite
def layouts(draw: st.DrawFn) -> dict[str, Any]:
    """Fields in any order with gaps between them, rows with paddings, either order of bytes."""
    names = draw(st.permutations(["x", "y", "z", *draw(st.sets(st.sampled_from("abcdef")))]))
    big, at, fields = draw(st.booleans()), draw(st.integers(0, 9)), []
    for name in names:
        kind = draw(st.sampled_from([7, 8] if name in "xyz" else list(SIZES)))
        fields.append(field(name, at, kind, draw(st.integers(0 if kind == 7 else 1, 1))))
        at += SIZES[kind] + draw(st.integers(0, 5))
    height, width = draw(st.integers(0, 4)), draw(st.integers(0, 5))
    return {
        "fields": fields,
        "is_bigendian": big,
        "point_step": at,
        "height": height,
        "width": width,
        "row_step": width * at + draw(st.integers(0, 7)),
    }


@settings(max_examples=50)
@given(layouts(), st.randoms(use_true_random=False))
def test_every_layout_is_read(layout: dict[str, Any], dice: random.Random) -> None:
    data = bytearray(dice.randbytes(layout["height"] * layout["row_step"]))
    order = ">" if layout["is_bigendian"] else "<"
    where = {f.name: f for f in layout["fields"]}
    wanted = []
    for row in range(layout["height"]):
        for column in range(layout["width"]):
            start = row * layout["row_step"] + column * layout["point_step"]
            point = [dice.uniform(-99.0, 99.0) for _ in range(3)]
            if dice.random() < 0.2:
                point[dice.randrange(3)] = dice.choice([math.nan, math.inf, -math.inf])
            else:
                wanted.append(point)
            for name, value in zip("xyz", point, strict=True):
                code = "f" if where[name].datatype == 7 else "d"
                struct.pack_into(order + code, data, start + where[name].offset, value)
    got = decode_cloud(message(bytes(data), **layout), "left", 0.0).points
    expected = np.array(wanted, dtype=np.float32).reshape(-1, 3)
    np.testing.assert_array_equal(got, expected)


def test_what_does_not_fit_a_float32_is_left_out() -> None:
    fields = [field(name, 8 * k, 8) for k, name in enumerate("xyz")]
    data = struct.pack("<6d", 1.0, 2.0, 3.0, 1e300, 0.0, 0.0)
    layout = {"fields": fields, "point_step": 24, "width": 2}
    np.testing.assert_array_equal(
        decode_cloud(message(data, **layout), "left", 0.0).points, [[1.0, 2.0, 3.0]]
    )


DATA = POINTS.tobytes()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"width": 41}, "do not fit into a row"),
        ({"height": 2}, "are not 2 rows"),
        ({"row_step": 470}, "are not 1 rows"),
        ({"row_step": 0, "height": 0}, "are not 0 rows"),
        ({"point_step": 8, "width": 60}, "outside of a point"),
        ({"point_step": 0}, "outside of a point"),
        ({"point_step": 2**32 - 1}, "do not fit into a row"),
        ({"width": 2**32 - 1, "point_step": 2**32 - 1}, "do not fit into a row"),
        ({"fields": XYZ[:2]}, "0 fields are called z"),
        ({"fields": [*XYZ, field("x", 0)]}, "2 fields are called x"),
        ({"fields": []}, "0 fields are called x"),
        ({"fields": [*XYZ[:2], field("z", 9)]}, "z at byte 9 is outside"),
        ({"fields": [*XYZ[:2], field("z", 2**32 - 1)]}, "is outside"),
        ({"fields": [*XYZ[:2], field("z", 8, 6)]}, "z is of type 6"),
        ({"fields": [*XYZ[:2], field("z", 8, 7, 2)]}, "z is of type 7"),
        ({"fields": [*XYZ, *(field(f"f{k}", 0) for k in range(70))]}, "73 fields"),
    ],
)
def test_inconsistent_clouds_are_refused(changes: dict[str, Any], words: str) -> None:
    decode_cloud(message(DATA), "left", 0.0)
    with pytest.raises(DecodeError, match=words):
        decode_cloud(message(DATA, **changes), "left", 0.0)


def test_wrong_stamps_names_and_types_are_refused() -> None:
    long = _types["std_msgs/msg/Header"](_types["builtin_interfaces/msg/Time"](1, 0), "x" * 300)
    late = _types["std_msgs/msg/Header"](_types["builtin_interfaces/msg/Time"](1, 2**31), "x")
    for header, words in ((long, "300 characters"), (late, "no time")):
        with pytest.raises(DecodeError, match=words):
            decode_cloud(message(DATA, header=header), "left", 0.0)
    for payload in (b"", b"\0\1\0\0", b"\0\1\0\0" + 100 * b"\xff"):
        with pytest.raises(DecodeError):
            decode_cloud(payload, "left", 0.0)


def test_a_cloud_without_points_is_a_cloud() -> None:
    got = decode_cloud(encode_cloud(STAMP, "lidar", np.zeros((0, 3))), "left", 0.0)
    assert got.points.shape == (0, 3)


def _broken(dice: random.Random, good: bytes) -> bytes:
    payload = bytearray(good)
    kind = dice.randrange(3)
    if kind == 0:
        del payload[dice.randrange(len(payload)) :]
    elif kind == 1:
        for _ in range(dice.randrange(1, 6)):
            payload[dice.randrange(len(payload) // 2)] = dice.randrange(256)
    else:
        at = 4 * dice.randrange(len(payload) // 8)
        payload[at : at + 4] = struct.pack("<I", dice.choice([2**32 - 1, 2**31, 10**8, 70_000]))
    return bytes(payload)


def test_broken_clouds_do_no_harm() -> None:
    """Each gives a cloud or a DecodeError, never another error, and no memory to speak of."""
    dice = random.Random(7)
    good = message(DATA[:240])
    for _ in range(100):  # what is imported and cached at first is none of theirs
        decode_cloud(good, "left", 0.0)
    refused = 0
    tracemalloc.start()
    try:
        for _ in range(3_000):
            try:
                got = decode_cloud(_broken(dice, good), "left", 0.0)
            except DecodeError:
                refused += 1
                continue
            assert isinstance(got, Cloud)
            assert got.points.shape[1:] == (3,)
            assert np.isfinite(got.points).all()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 500 < refused < 3_000
    assert peak < 2e6


@settings(max_examples=60)
@given(st.binary(max_size=300))
def test_noise_is_no_cloud(noise: bytes) -> None:
    with pytest.raises(DecodeError):
        decode_cloud(b"\x00\x01\x00\x00" + noise, "left", 0.0)


@pytest.mark.parametrize(
    ("name", "kind", "values"),
    [
        ("time", 7, [-0.1, -0.05, 0.0]),
        ("time", 8, [0.0, 0.05, 0.1]),
        ("t", 6, [0, 50_000_000, 100_000_000]),
        ("offset_time", 6, [0, 50_000_000, 100_000_000]),
        ("timestamp", 8, [1_700_000_000.15, 1_700_000_000.2, 1_700_000_000.25]),
    ],
)
@pytest.mark.parametrize("big", [False, True])
def test_times_of_points_as_drivers_write_them(
    name: str, kind: int, values: list[float], big: bool
) -> None:
    code = {6: "I", 7: "f", 8: "d"}[kind]
    order = ">" if big else "<"
    data = b"".join(struct.pack(f"{order}fff{code}", 1.0, 2.0, 3.0, value) for value in values)
    step = len(data) // 3
    fields = [*XYZ, field(name, 12, kind, 1)]
    layout = {"width": 3, "point_step": step, "row_step": len(data), "is_bigendian": big}
    got = decode_cloud(message(data, fields=fields, **layout), "left", 0.0)
    unit, since = (1e-9 if kind == 6 else 1.0), (1_700_000_000.25 if name == "timestamp" else 0.0)
    assert got.times is not None
    np.testing.assert_allclose(got.times, unit * np.array(values) - since, atol=1e-6)
    np.testing.assert_array_equal(got.points, np.tile([1.0, 2.0, 3.0], (3, 1)))


@pytest.mark.parametrize(
    ("name", "kind", "value"),
    [
        ("time", 7, np.nan),
        ("time", 7, 2.0),
        ("timestamp", 8, 5.0),
        ("time", 6, 5),
        ("when", 7, 0.1),
    ],
)
def test_what_is_no_time_is_left(name: str, kind: int, value: float) -> None:
    code = {6: "I", 7: "f", 8: "d"}[kind]
    data = struct.pack(f"<fff{code}", 1.0, 2.0, 3.0, value)
    fields = [*XYZ, field(name, 12, kind, 1)]
    got = decode_cloud(message(data, fields=fields, width=1, point_step=len(data)), "left", 0.0)
    assert got.times is None
    assert len(got.points) == 1


def test_own_clouds_keep_their_times() -> None:
    since = np.linspace(-0.1, 0.0, len(POINTS))
    got = decode_cloud(encode_cloud(STAMP, "lidar", POINTS, times=since), "left", 3.0)
    assert got.times is not None
    np.testing.assert_allclose(got.times, since, atol=1e-6)
    unfit = POINTS.copy()
    unfit[0] = np.nan
    got = decode_cloud(encode_cloud(STAMP, "lidar", unfit, times=since), "left", 3.0)
    assert got.times is not None
    np.testing.assert_allclose(got.times, since[1:], atol=1e-6)
