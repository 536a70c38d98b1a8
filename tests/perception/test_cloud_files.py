"""Points come back from every format; what is damaged is one sentence, and costs no memory."""

from __future__ import annotations

import io
import tracemalloc

import cloud_files as files
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from backend.errors import InputError
from backend.perception.cloud import read_cloud
from backend.perception.lzf_kernel import expanded, expanded_size

RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-40.0, 40.0, (300, 3)).astype(np.float32).astype(float)
POINTS[7] = np.nan
SOLID = np.delete(POINTS, 7, axis=0)
GEO = np.array([500_000.0, 4_000_000.0, 100.0])

WHOLE = {
    **{f"pcd {d}": files.pcd(SOLID, d) for d in ("ascii", "binary", "binary_compressed")},
    **{
        f"ply {f}": files.ply(SOLID, f)
        for f in ("ascii", "binary_little_endian", "binary_big_endian")
    },
    **{f"las 1.{v}": files.las(SOLID + GEO, v) for v in (2, 3, 4)},
}


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_pcd(data: str) -> None:
    cloud = read_cloud(files.pcd(POINTS, data, "1 2 3 1 0 0 0"), "a.pcd")
    np.testing.assert_array_equal(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.origin, [1.0, 2.0, 3.0])
    assert cloud.format == f"PCD {data}"


def test_pcd_of_another_order_and_with_counts() -> None:
    header = (
        "VERSION .5\nCOLUMNS z normal y x\nSIZE 8 4 2 4\nTYPE F F I F\nCOUNT 1 3 1 1\n"
        "WIDTH 1\nHEIGHT 2\nDATA binary\n"
    )
    kinds = [("z", "<f8"), ("normal", "<f4", 3), ("y", "<i2"), ("x", "<f4")]
    rows = np.array([(0.5, (1, 2, 3), -4, 7.0), (1.5, (1, 2, 3), 9, 8.0)], kinds)
    cloud = read_cloud(header.encode() + rows.tobytes(), "a.pcd")
    np.testing.assert_array_equal(cloud.points, [[7.0, -4.0, 0.5], [8.0, 9.0, 1.5]])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_as_trimesh_reads_it(form: str) -> None:
    content = files.ply(SOLID, form)
    found = read_cloud(content, "a.ply").points
    np.testing.assert_array_equal(found, SOLID)
    mesh = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
    np.testing.assert_allclose(found, mesh.vertices, atol=1e-5)


def test_ply_of_trimesh_itself() -> None:
    for encoding in ("ascii", "binary"):
        written = trimesh.PointCloud(SOLID).export(file_type="ply", encoding=encoding)
        content = written.encode() if isinstance(written, str) else written
        np.testing.assert_allclose(read_cloud(content, "a.ply").points, SOLID, atol=1e-5)


def test_ply_with_an_element_before() -> None:
    before = "element camera 2\nproperty float focal\n"
    text = files.ply(SOLID, "ascii", before)
    at = text.index(b"end_header\n") + len(b"end_header\n")
    found = read_cloud(text[:at] + b"1.5\n1.6\n" + text[at:], "a.ply").points
    np.testing.assert_array_equal(found, SOLID)
    packed = files.ply(SOLID, "binary_big_endian", before)
    at = packed.index(b"end_header\n") + len(b"end_header\n")
    found = read_cloud(packed[:at] + bytes(8) + packed[at:], "a.ply").points
    np.testing.assert_array_equal(found, SOLID)


@pytest.mark.parametrize(("version", "form", "step"), [(0, 0, 20), (2, 3, 40), (4, 6, 30)])
def test_las(version: int, form: int, step: int) -> None:
    cloud = read_cloud(files.las(SOLID + GEO, version, form, step), "a.las")
    np.testing.assert_allclose(cloud.points, SOLID + GEO, atol=0.51e-3)
    assert cloud.format == f"LAS 1.{version}, point format {form}"


@pytest.mark.parametrize("what", list(WHOLE))
def test_none_at_all(what: str) -> None:
    kind, _, form = what.partition(" ")
    none = np.zeros((0, 3))
    content = files.las(none) if kind == "las" else getattr(files, kind)(none, form)
    assert read_cloud(content, "a").points.shape == (0, 3)


@given(st.binary(max_size=2_000), st.integers(1, 40))
def test_lzf_there_and_back(data: bytes, repeats: int) -> None:
    plain = data * repeats
    packed = np.frombuffer(files.lzf(plain), np.uint8)
    assert expanded_size(packed) == len(plain)
    assert expanded(packed, len(plain)).tobytes() == plain


def test_lzf_by_hand() -> None:
    # "abc", then seven bytes from three back, then 18 from one back: a run of the last.
    packed = bytes([2, *b"abc", 5 << 5, 2, 7 << 5, 9, 0])
    data = np.frombuffer(packed, np.uint8)
    assert expanded_size(data) == 28
    assert expanded(data, 28).tobytes() == b"abcabcabca" + b"a" * 18
    for damaged, at in ((packed[:3], 1), (packed[:5], 5), (bytes([0, 65, 32, 1]), 3)):
        assert expanded_size(np.frombuffer(damaged, np.uint8)) == -at


def judged(content: bytes) -> None:
    """Points, or one sentence."""
    said, points = "cloud.", np.zeros((0, 3))
    try:
        points = read_cloud(content, "cloud").points
    except InputError as error:
        said = str(error)
    assert points.ndim == 2
    assert points.shape[1] == 3
    assert said.startswith("cloud")
    assert said.endswith(".")
    assert "\n" not in said


@given(st.sampled_from(sorted(WHOLE)), st.floats(0.0, 1.0))
def test_a_file_cut_anywhere(what: str, share: float) -> None:
    content = WHOLE[what]
    judged(content[: int(share * len(content))])


@given(
    st.sampled_from(sorted(WHOLE)),
    st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 255)), min_size=1, max_size=8),
    st.booleans(),
)
def test_a_file_with_damaged_bytes(
    what: str, changes: list[tuple[float, int]], in_header: bool
) -> None:
    content = bytearray(WHOLE[what])
    size = 380 if in_header else len(content)
    for share, value in changes:
        content[min(int(share * size), size - 1)] = value
    judged(bytes(content))


@given(st.binary(max_size=400), st.sampled_from([b"", b"ply\n", b"# .PCD", b"LASF", b"VERSION"]))
def test_anything_at_all(rest: bytes, begin: bytes) -> None:
    judged(begin + rest)


HUGE = 10**12


@pytest.mark.parametrize(
    "content",
    [
        *(files.pcd_header(HUGE, data) + b"1 2 3 4 5\n" * 9 for data in ("ascii", "binary")),
        files.pcd_header(HUGE, "binary_compressed") + bytes([9, 0, 0, 0] + [255] * 4 + [0] * 9),
        # A literal byte and copies of it, 264 bytes each, that the header does not know of.
        files.pcd_header(2, "binary_compressed")
        + bytes([2 + 3 * 9_000 & 255, 2 + 3 * 9_000 >> 8, 0, 0, 255, 255, 255, 255, 0, 0])
        + bytes([7 << 5, 255, 0]) * 9_000,
        files.pcd_header(5, "binary").replace(b"COUNT 1 1", b"COUNT 1 999999999999999"),
        *(
            files.ply(SOLID[:0], form).replace(b"vertex 0", f"vertex {HUGE}".encode())
            for form in ("ascii", "binary_big_endian")
        ),
        files.ply(SOLID[:3], "ascii", f"element a {HUGE}\nproperty list int int b\n"),
        files.las(SOLID[:3] + GEO, 4)[:247] + HUGE.to_bytes(8, "little") + bytes(400),
    ],
)
def test_claims_cost_no_memory(content: bytes) -> None:
    with pytest.raises(InputError):  # once before: kernels are loaded
        read_cloud(content, "cloud")
    tracemalloc.start()
    with pytest.raises(InputError) as error:
        read_cloud(content, "cloud")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty; allowed are PCD, PLY and LAS files"),
        (b"x,y,z\n1,2,3\n", "begins with 'x,y,z"),
        (files.pcd_header(1, "zip"), "line 11: DATA is 'zip'; allowed are ascii, binary"),
        (files.pcd_header(2, "ascii") + b"1 2 3 4 5\n" + b" " * 20, "ends after 1 points, but"),
        (files.pcd_header(1, "ascii") + b"1 2 3 4\n     ", "line 12: has 4 numbers"),
        (files.pcd_header(1, "ascii") + b"1 2 o 4 5\n", "line 12: 'o' is no number"),
        (files.pcd_header(1, "binary") + bytes(17), "17 bytes follow, enough for 0"),
        (files.pcd_header(1, "ascii").replace(b"WIDTH 1", b"WIDTH 2"), "WIDTH x HEIGHT is 2"),
        (files.pcd_header(1, "ascii").replace(b"x y z", b"a y z"), "needed are x, y and z"),
        (files.pcd_header(1, "ascii").replace(b"F F F F U", b"F F F F"), "has 4 entries"),
        (files.pcd_header(1, "ascii").replace(b"F F F F U", b"F F F Q U"), "'Q4'; allowed are F4"),
        (files.pcd_header(1, "ascii", "1 2"), "VIEWPOINT is '1 2'"),
        (b"VERSION 0.7\nDATA ascii\n", "has no line FIELDS"),
        (b"VERSION 0.7\nFEELDS x\n", "line 2: 'FEELDS' is not known"),
        (b"VERSION 0.7\n\xff\n", "line 2: is no text"),
        (b"VERSION 0.7\n", "line 2: the header has no end"),
        (b"ply\nformat ascii 2.0\n", "line 2: 'format ascii 2.0' is not allowed there"),
        (b"ply\nformat ascii 1.0\nend_header\n", "has no element vertex"),
        (files.ply(SOLID).replace(b"double x", b"double a"), "needed are x, y and z, each once"),
        (
            files.ply(SOLID, before="element f 1\nproperty list uchar int i\n"),
            "'f' has a list; lists are allowed behind the vertices only",
        ),
        (files.las(SOLID + GEO)[:200], "ends within its header of 227 bytes"),
        (files.las(SOLID + GEO, form=129), "compressed (LAZ)"),
        (files.las(SOLID + GEO, form=3), "format 3 with 28 bytes"),
        (files.las(SOLID + GEO, version=9), "is LAS 1.9"),
        (files.las(SOLID + GEO, shifts=(np.inf, 0.0, 0.0)), "allowed are finite numbers"),
    ],
)
def test_what_is_wrong_is_said(content: bytes, says: str) -> None:
    with pytest.raises(InputError) as error:
        read_cloud(content, "cloud")
    assert says in str(error.value)
