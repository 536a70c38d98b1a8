"""PCD files of the Point Cloud Library, versions 0.5 to 0.7: ascii, binary, binary_compressed.

Compressed points stand field by field, all x, then all y, and so on; else point by point.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.perception.cloud_columns import (
    Cloud,
    ascii_rows,
    column,
    fits,
    header_lines,
    whole,
)
from backend.perception.lzf_kernel import expanded, expanded_size
from backend.spatial.types import Array

_KINDS = {
    **{f"F{size}": f"<f{size}" for size in (4, 8)},
    **{f"I{size}": f"<i{size}" for size in (1, 2, 4, 8)},
    **{f"U{size}": f"<u{size}" for size in (1, 2, 4, 8)},
}
_WORDS = (
    *("VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT"),
    *("POINTS", "DATA"),
)


@dataclass(frozen=True)
class _Field:
    """kind: of numpy; size: bytes of one number; count: of numbers; offset: bytes before it in a
    point; place: numbers before it.
    """

    kind: str
    size: int
    count: int
    offset: int
    place: int


class _Header(NamedTuple):
    """lines: by word, (number, words behind it); end: where the points begin."""

    lines: dict[str, tuple[int, list[str]]]
    end: int


def read_pcd(content: bytes, name: str) -> Cloud:
    """Raises InputError with the line, the field or the byte of what is wrong."""
    header = _header(content, name)
    fields, step, wide = _fields(header, name)
    count = _count(header, name)
    origin = _origin(header, name)
    line, words = header.lines["DATA"]
    data = words[0] if len(words) == 1 else " ".join(words)
    axes = [fields[axis] for axis in "xyz"]
    if data == "ascii":
        places = tuple(field.place for field in axes)
        points = ascii_rows(content, header.end, line + 1, count, places, wide, name)
    elif data == "binary":
        fits(count, step, header.end, content, name)
        points = np.stack(
            [column(content, count, f.kind, header.end + f.offset, step) for f in axes], axis=1
        )
    elif data == "binary_compressed":
        plain = _expanded(content, header.end, count * step, name)
        points = np.stack(
            [column(plain, count, f.kind, count * f.offset, f.size * f.count) for f in axes], axis=1
        )
    else:
        raise InputError(
            f"{name}, line {line}: DATA is '{data[:40]}'; allowed are ascii, binary and "
            "binary_compressed."
        )
    return Cloud(points, origin, f"PCD {data}")


def _header(content: bytes, name: str) -> _Header:
    lines: dict[str, tuple[int, list[str]]] = {}
    for line in header_lines(content, name):
        if not line.words or line.words[0].startswith("#"):
            continue
        word = line.words[0]
        if word not in _WORDS or word in lines:
            why = "stands there twice" if word in lines else "is not known"
            raise InputError(
                f"{name}, line {line.number}: '{word[:40]}' {why}; a header has "
                f"{', '.join(_WORDS)}, each once."
            )
        lines["FIELDS" if word == "COLUMNS" else word] = line.number, line.words[1:]
        if word == "DATA":
            break
    for needed in ("FIELDS", "SIZE", "TYPE"):
        if needed not in lines:
            raise InputError(f"{name}: the header has no line {needed}, which is required.")
    return _Header(lines, line.end)


def _fields(header: _Header, name: str) -> tuple[dict[str, _Field], int, int]:
    """By name; the bytes of a point; the numbers of a point."""
    _, names = header.lines["FIELDS"]
    parts = {}
    for word in ("SIZE", "TYPE", "COUNT"):
        line, words = header.lines.get(word, (0, ["1"] * len(names)))
        if len(words) != len(names):
            raise InputError(
                f"{name}, line {line}: {word} has {len(words)} entries, but there are "
                f"{len(names)} FIELDS."
            )
        parts[word] = line, words
    fields: dict[str, _Field] = {}
    offset = place = 0
    for k, field in enumerate(names):
        kind = parts["TYPE"][1][k] + parts["SIZE"][1][k]
        if kind not in _KINDS:
            raise InputError(
                f"{name}, line {parts['TYPE'][0]}: the field '{field[:40]}' is of TYPE and SIZE "
                f"'{kind[:40]}'; allowed are {', '.join(_KINDS)}."
            )
        size, count = int(kind[1:]), whole(parts["COUNT"][1][k], "COUNT", parts["COUNT"][0], name)
        if field in ("x", "y", "z"):
            if field in fields or count != 1:
                raise InputError(
                    f"{name}, line {header.lines['FIELDS'][0]}: {field} must be there once, with "
                    "one number."
                )
            fields[field] = _Field(_KINDS[kind], size, count, offset, place)
        offset, place = offset + size * count, place + count
    if len(fields) < 3:
        raise InputError(
            f"{name}, line {header.lines['FIELDS'][0]}: the FIELDS are '{' '.join(names)[:80]}'; "
            "needed are x, y and z."
        )
    return fields, offset, place


def _count(header: _Header, name: str) -> int:
    counts = {}
    for word in ("POINTS", "WIDTH", "HEIGHT"):
        if word in header.lines:
            line, words = header.lines[word]
            counts[word] = whole(" ".join(words), word, line, name)
    product = counts["WIDTH"] * counts.get("HEIGHT", 1) if "WIDTH" in counts else None
    count = counts.get("POINTS", product)
    if count is None:
        raise InputError(f"{name}: the header has neither POINTS nor WIDTH.")
    if product is not None and product != count:
        raise InputError(
            f"{name}, line {header.lines['POINTS'][0]}: POINTS is {count}, but WIDTH x HEIGHT is "
            f"{product}."
        )
    return count


def _origin(header: _Header, name: str) -> Array:
    line, words = header.lines.get("VIEWPOINT", (0, ["0"] * 7))
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != 7 or not all(map(math.isfinite, values)):
        raise InputError(
            f"{name}, line {line}: VIEWPOINT is '{' '.join(words)[:60]}'; allowed are seven "
            "numbers, place and quaternion."
        )
    return np.array(values[:3])


def _expanded(content: bytes, start: int, wanted: int, name: str) -> memoryview:
    if len(content) < start + 8:
        raise InputError(f"{name}, byte {start}: the file ends before its compressed points.")
    packed, size = struct.unpack_from("<II", content, start)
    if packed > len(content) - start - 8:
        raise InputError(
            f"{name}, byte {start}: {packed} compressed bytes are claimed, but "
            f"{len(content) - start - 8} follow."
        )
    data = np.frombuffer(content, np.uint8, packed, start + 8)
    found = int(expanded_size(data))
    if found < 0:
        raise InputError(f"{name}, byte {start + 7 - found}: the compressed points are damaged.")
    if found != size or size != wanted:
        raise InputError(
            f"{name}, byte {start}: the compressed points are {found} bytes, but {size} are "
            f"claimed there, and the header's fields and points need {wanted}."
        )
    return memoryview(expanded(data, found))
