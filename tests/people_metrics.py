"""How well tracks fit the truth: GOSPA (Rahmathullah et al. 2017), OSPA (Schuhmacher et al. 2008)
and changes of identity (CLEAR MOT, Bernardin and Stiefelhagen 2008).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment


def gospa(found: np.ndarray, true: np.ndarray, c: float = 1.0, p: float = 2.0) -> float:
    """With alpha = 2. found: (n, 2), true: (m, 2) places [m]; c: cut off [m]."""
    off = distances(found, true)
    i, j = linear_sum_assignment(np.minimum(off, c) ** p)
    paired = off[i, j][off[i, j] < c]
    alone = len(found) + len(true) - 2 * len(paired)
    return float(((paired**p).sum() + 0.5 * c**p * alone) ** (1.0 / p))


def ospa(found: np.ndarray, true: np.ndarray, c: float = 1.0, p: float = 2.0) -> float:
    """found: (n, 2), true: (m, 2) places [m]; c: cut off [m]."""
    most = max(len(found), len(true))
    if not most:
        return 0.0
    off = np.minimum(distances(found, true), c) ** p
    i, j = linear_sum_assignment(off)
    alone = most - min(len(found), len(true))
    return float(((off[i, j].sum() + c**p * alone) / most) ** (1.0 / p))


def switches(
    scans: list[tuple[np.ndarray, np.ndarray]], true: list[np.ndarray], near: float = 0.5
) -> int:
    """How often somebody is followed under another number than before. scans: ids (n,) and places
    (n, 2) of each scan; true: (m, 2) by scan; near: what is farther apart is not the same [m].
    """
    last: dict[int, int] = {}
    count = 0
    for (ids, places), truth in zip(scans, true, strict=True):
        off = distances(places, truth)
        free = off < near
        for who, known in last.items():  # who is followed already stays so
            rows = np.flatnonzero((ids == known) & free[:, who]) if len(ids) else []
            if len(rows):
                free[rows[0]], free[:, who] = False, False
                free[rows[0], who] = True
        cost = np.where(free, off, 1e6)
        for i, j in zip(*linear_sum_assignment(cost), strict=True):
            if free[i, j]:
                count += last.get(int(j), int(ids[i])) != ids[i]
                last[int(j)] = int(ids[i])
    return count


def distances(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(n, m) [m]."""
    return np.linalg.norm(found[:, None] - true[None], axis=2)
