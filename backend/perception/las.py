"""LAS files, versions 1.0 to 1.4 (ASPRS): x, y, z of all points, whatever their record's format.

Every format begins with x, y and z as whole numbers, which the header scales and shifts.
"""

from __future__ import annotations

import struct

import numpy as np

from backend.errors import InputError
from backend.perception.cloud_columns import Cloud, column, fits

_SHORTEST = (20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67)
"""Bytes of a point by the number of its format."""
_HEADER, _HEADER_14 = 227, 375


def read_las(content: bytes, name: str) -> Cloud:
    """Raises InputError with the byte of what is wrong. Compressed files (LAZ) are refused."""
    if len(content) < _HEADER:
        raise InputError(
            f"{name}, byte {len(content)}: the file ends within its header of {_HEADER} bytes."
        )
    version = content[24], content[25]
    if version not in ((1, 0), (1, 1), (1, 2), (1, 3), (1, 4)):
        raise InputError(
            f"{name}, byte 24: is LAS {version[0]}.{version[1]}; allowed are versions 1.0 to 1.4."
        )
    start = struct.unpack_from("<I", content, 96)[0]
    form, step, count = struct.unpack_from("<BHI", content, 104)
    if form & 0xC0:
        raise InputError(
            f"{name}, byte 104: the points are compressed (LAZ); allowed is LAS, as laszip writes "
            "it of a LAZ file."
        )
    if form >= len(_SHORTEST) or step < _SHORTEST[form]:
        raise InputError(
            f"{name}, byte 104: points of format {form} with {step} bytes; allowed are the formats "
            f"0 to {len(_SHORTEST) - 1} with at least {', '.join(map(str, _SHORTEST))} bytes."
        )
    if version == (1, 4) and len(content) >= _HEADER_14:
        count = struct.unpack_from("<Q", content, 247)[0] or count
    least = _HEADER_14 if version == (1, 4) else _HEADER
    if start < least:
        raise InputError(
            f"{name}, byte 96: the points begin at byte {start}; allowed is {least} or more, "
            "behind the header."
        )
    scales = np.array(struct.unpack_from("<3d", content, 131))
    shifts = np.array(struct.unpack_from("<3d", content, 155))
    sane = np.isfinite(shifts).all() and (np.abs(scales) < 1e6).all() and (scales != 0.0).all()
    if not (sane and (np.abs(shifts) < 1e12).all()):
        raise InputError(
            f"{name}, byte 131: the scales are {scales.tolist()} and the offsets "
            f"{shifts.tolist()}; allowed are finite numbers, scales not 0."
        )
    fits(count, step, start, content, name)
    whole = [column(content, count, "<i4", start + 4 * axis, step) for axis in range(3)]
    points = np.stack(whole, axis=1) * scales + shifts
    return Cloud(points, np.zeros(3), f"LAS {version[0]}.{version[1]}, point format {form}")
