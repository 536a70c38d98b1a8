"""Binary frames of the page's websocket: a JSON header and aligned arrays.

uint32 little-endian header length | UTF-8 JSON | zeros to a multiple of 8 | payload. The header's
`arrays` maps each name to dtype ("f4", "f8", "u1", "i4"), shape and offset in the payload.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from backend.spatial.types import AnyArray

_TYPES = {"float32": "f4", "float64": "f8", "uint8": "u1", "int32": "i4"}


def encode(header: Mapping[str, Any], arrays: Mapping[str, AnyArray] | None = None) -> bytes:
    """One frame. Arrays keep their dtype; only those of the format are accepted."""
    entries: dict[str, dict[str, Any]] = {}
    blobs: list[bytes] = []
    offset = 0
    for name, array in (arrays or {}).items():
        kind = _TYPES.get(array.dtype.name)
        if kind is None:
            raise TypeError(f"array {name!r} has dtype {array.dtype}, not one of {sorted(_TYPES)}")
        blob = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()
        blob += b"\0" * (-len(blob) % 8)
        entries[name] = {"dtype": kind, "shape": list(array.shape), "offset": offset}
        blobs.append(blob)
        offset += len(blob)
    text = dumps({**header, "arrays": entries}).encode()
    start = struct.pack("<I", len(text)) + text
    return b"".join([start, b"\0" * (-len(start) % 8), *blobs])


def decode(frame: bytes) -> tuple[dict[str, Any], dict[str, AnyArray]]:
    """Header and arrays of one frame."""
    (length,) = struct.unpack_from("<I", frame)
    header = json.loads(frame[4 : 4 + length])
    start = (4 + length + 7) // 8 * 8
    arrays = {
        name: np.frombuffer(
            frame,
            np.dtype(f"<{entry['dtype']}"),
            count=math.prod(entry["shape"]),
            offset=start + entry["offset"],
        ).reshape(entry["shape"])
        for name, entry in header.pop("arrays").items()
    }
    return header, arrays


def dumps(document: Any) -> str:
    """JSON in which what is not a number (NaN, infinity) is null, as JSON has no word for it."""
    return msgspec.json.encode(document, enc_hook=_plain).decode()


def _plain(value: Any) -> Any:
    """What only numpy knows, as plain Python."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in a JSON document")
