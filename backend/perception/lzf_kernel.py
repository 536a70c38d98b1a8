"""LZF, the compression of PCD files: literal runs, and copies of what was there before.

A byte below 32 begins a run of that many and one more literals; another one a copy: its upper three
bits are the length less two (seven: plus the next byte), the rest and the next byte how far back.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import AnyArray


@njit(cache=True, nogil=True)
def expanded_size(data: AnyArray) -> int:
    """How many bytes `data` (n,) uint8 expands to; less than 0 where it is damaged, by the position
    of the damage from 1.
    """
    at, size, n = 0, 0, len(data)
    while at < n:
        begun, control = at, int(data[at])
        at += 1
        if control < 32:
            at += control + 1
            size += control + 1
            if at > n:
                return -begun - 1
            continue
        length = control >> 5
        if length == 7:
            if at >= n:
                return -begun - 1
            length += int(data[at])
            at += 1
        if at >= n:
            return -begun - 1
        back = ((control & 31) << 8) + int(data[at]) + 1
        at += 1
        if back > size:
            return -begun - 1
        size += length + 2
    return size


@njit(cache=True, nogil=True)
def expanded(data: AnyArray, size: int) -> AnyArray:
    """(size,) uint8; `size` as `expanded_size` found it."""
    out = np.empty(size, np.uint8)
    at, to = 0, 0
    while at < len(data):
        control = int(data[at])
        at += 1
        if control < 32:
            for _ in range(control + 1):
                out[to] = data[at]
                at += 1
                to += 1
            continue
        length = control >> 5
        if length == 7:
            length += int(data[at])
            at += 1
        source = to - ((control & 31) << 8) - int(data[at]) - 1
        at += 1
        for k in range(length + 2):
            out[to] = out[source + k]
            to += 1
    return out
