"""Which few of many sets cover everything: a local search that weights what is hard to cover."""

from __future__ import annotations

import numpy as np
from numba import njit

from backend.spatial.types import Array, BoolArray, IntArray


def cover(
    holds: BoolArray, weights: Array, start: IntArray, size: int, steps: int, seed: int
) -> tuple[IntArray, int]:
    """`size` rows of holds (n, m) that together have as many columns as found; (rows, missing).

    weights: (m,) of the columns; raised in place for those that stay uncovered, so that a later
    call knows what is hard. start: rows to begin with, at most `size`; the rest is added greedily.
    Row weighting local search (Gao, Weise and Li 2015), with the number of rows fixed.
    """
    n, m = holds.shape
    rows, columns = np.nonzero(holds)
    first_column = np.searchsorted(rows, np.arange(n + 1))
    back_columns, back_rows = np.nonzero(holds.T)
    first_row = np.searchsorted(back_columns, np.arange(m + 1))
    best, missing = _search(
        first_column, columns, first_row, back_rows, weights, start, size, steps, seed
    )
    return best, int(missing)


@njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _search(
    first_column: IntArray,
    columns: IntArray,
    first_row: IntArray,
    rows: IntArray,
    weights: Array,
    start: IntArray,
    size: int,
    steps: int,
    seed: int,
) -> tuple[IntArray, int]:
    """One run. Row r has columns[first_column[r] : first_column[r + 1]], and the other way round.

    gain: of a row outside the set what it would add, of one inside what would be lost without it.
    """
    np.random.seed(seed)  # noqa: NPY002 - compiled code has no other generator
    n, m = len(first_column) - 1, len(first_row) - 1
    count, stamp = np.zeros(m, np.int64), np.zeros(n, np.int64)
    chosen, gain = np.zeros(n, np.bool_), np.zeros(n)
    for r in range(n):
        for e in range(first_column[r], first_column[r + 1]):
            gain[r] += weights[columns[e]]
    open_, place, missing = np.arange(m), np.arange(m), m  # open_[:missing] are not covered
    current, best, least = np.full(size, -1), np.zeros(size, np.int64), m + 1
    last = -1
    for t in range(-size, steps + 1):
        if t < 0:
            slot, gone = t + size, -1
        else:
            if missing <= least:
                least = missing
                best[:] = current
            if missing == 0 or t == steps:
                break
            slot = -1
            for s in range(size):
                r = current[s]
                if r == last:
                    continue
                if slot < 0 or (gain[r], stamp[r]) < (gain[current[slot]], stamp[current[slot]]):
                    slot = s
            gone = current[slot]
            chosen[gone], stamp[gone], gain[gone] = False, t, 0.0
            for e in range(first_column[gone], first_column[gone + 1]):
                c = columns[e]
                count[c] -= 1
                if count[c] == 0:
                    place[c], open_[missing] = missing, c
                    missing += 1
                    for g in range(first_row[c], first_row[c + 1]):
                        gain[rows[g]] += weights[c]
                elif count[c] == 1:
                    for g in range(first_row[c], first_row[c + 1]):
                        if chosen[rows[g]]:
                            gain[rows[g]] += weights[c]
                            break
        new = -1
        if t < 0 and slot < len(start):
            new = start[slot]
        elif t >= 0:
            c = open_[np.random.randint(missing)]  # noqa: NPY002
            for g in range(first_row[c], first_row[c + 1]):
                r = rows[g]
                if chosen[r] or r == gone:
                    continue
                if new < 0 or (gain[r], -stamp[r]) > (gain[new], -stamp[new]):
                    new = r
        if new < 0:
            for r in range(n):
                if not chosen[r] and r != gone and (new < 0 or gain[r] > gain[new]):
                    new = r
        if new < 0:
            new = gone
        chosen[new], stamp[new], current[slot], last = True, t, new, new
        added = 0.0
        for e in range(first_column[new], first_column[new + 1]):
            c = columns[e]
            count[c] += 1
            if count[c] == 1:
                added += weights[c]
                missing -= 1
                open_[place[c]] = open_[missing]
                place[open_[missing]] = place[c]
                for g in range(first_row[c], first_row[c + 1]):
                    gain[rows[g]] -= weights[c]
            elif count[c] == 2:
                for g in range(first_row[c], first_row[c + 1]):
                    if chosen[rows[g]] and rows[g] != new:
                        gain[rows[g]] -= weights[c]
                        break
        gain[new] = added
        if t >= 0:
            for i in range(missing):
                c = open_[i]
                weights[c] += 1.0
                for g in range(first_row[c], first_row[c + 1]):
                    gain[rows[g]] += 1.0
    return best, least
