"""Files of points, written by hand as their formats' descriptions say."""

from __future__ import annotations

import struct

import numpy as np

FIELDS = "x y z intensity ring"


def records(points: np.ndarray) -> np.ndarray:
    """As a LiDAR's driver writes them: float32 places, an intensity, a ring of two bytes."""
    kinds = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2")]
    rows = np.zeros(len(points), kinds)
    for k, axis in enumerate("xyz"):
        rows[axis] = points[:, k]
    rows["intensity"], rows["ring"] = 7.0, np.arange(len(points)) % 16
    return rows


def pcd_header(count: int, data: str, viewpoint: str = "0 0 0 1 0 0 0") -> bytes:
    return (
        f"# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {FIELDS}\n"
        "SIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 1 1 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS {count}\nDATA {data}\n"
    ).encode()


def pcd(points: np.ndarray, data: str = "binary", viewpoint: str = "0 0 0 1 0 0 0") -> bytes:
    rows = records(points)
    if data == "ascii":
        body = "".join(f"{x!r} {y!r} {z!r} 7 3\n" for x, y, z in points.tolist()).encode()
    elif data == "binary":
        body = rows.tobytes()
    else:
        plain = b"".join(rows[name].tobytes() for name in rows.dtype.names or ())
        packed = lzf(plain)
        body = struct.pack("<II", len(packed), len(plain)) + packed
    return pcd_header(len(points), data, viewpoint) + body


def lzf(plain: bytes) -> bytes:
    """Copies where three bytes were there before, as in Marc Lehmann's library."""
    out, literal, seen, at = bytearray(), bytearray(), dict[bytes, int](), 0

    def flush() -> None:
        for k in range(0, len(literal), 32):
            run = literal[k : k + 32]
            out.extend([len(run) - 1, *run])
        literal.clear()

    while at < len(plain):
        key = plain[at : at + 3]
        before = seen.get(key)
        if len(key) == 3:
            seen[key] = at
        if before is None or at - before > 8192:
            literal.append(plain[at])
            at += 1
            continue
        length = 3
        while length < 264 and at + length < len(plain):
            if plain[before + length] != plain[at + length]:
                break
            length += 1
        flush()
        back, code = at - before - 1, length - 2
        if code < 7:
            out.extend([code << 5 | back >> 8, back & 255])
        else:
            out.extend([7 << 5 | back >> 8, code - 7, back & 255])
        at += length
    flush()
    return bytes(out)


def ply(points: np.ndarray, form: str = "binary_little_endian", before: str = "") -> bytes:
    header = (
        f"ply\nformat {form} 1.0\ncomment by hand\n{before}element vertex {len(points)}\n"
        "property uchar red\nproperty double x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = "".join(f"9 {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
        return header + rows.encode() + b"3 0 1 2\n"
    order = "<" if form == "binary_little_endian" else ">"
    packed = (struct.pack(order + "Bdff", 9, *point) for point in points.tolist())
    return header + b"".join(packed) + struct.pack(order + "B3i", 3, 0, 1, 2)


def las(
    points: np.ndarray,
    version: int = 2,
    form: int = 1,
    step: int = 28,
    shifts: tuple[float, float, float] = (500_000.0, 4_000_000.0, 100.0),
) -> bytes:
    """points: (n, 3) in millimetres about the shifts."""
    size, n = (375 if version == 4 else 227), len(points)
    header = bytearray(size)
    header[:4], header[24:26] = b"LASF", bytes([1, version])
    struct.pack_into("<HI", header, 94, size, size)
    struct.pack_into("<BHI", header, 104, form, step, 0 if version == 4 else n)
    struct.pack_into("<6d", header, 131, 1e-3, 1e-3, 1e-3, *shifts)
    if version == 4:
        struct.pack_into("<Q", header, 247, n)
    rows = np.zeros((n, step), np.uint8)
    near = np.clip(np.nan_to_num(points - shifts), -1e6, 1e6)
    whole = np.ascontiguousarray(np.round(near * 1e3).astype("<i4"))
    rows[:, :12] = whole.view(np.uint8).reshape(n, 12)
    return bytes(header) + rows.tobytes()
