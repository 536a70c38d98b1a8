"""Integrals from a fixed start to many ends, by Gauss-Legendre panels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from backend.spatial.types import AnyArray, Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_HALF = (_NODES + 1.0) / 2.0


class Running:
    """∫ f from edges[0] to t, for f (k,) -> (k,) real or complex, analytic between edges.

    Twelve nodes a panel: to rounding when f turns by less than about a radian from edge to edge.
    """

    def __init__(self, f: Callable[[Array], AnyArray], edges: Array) -> None:
        self._f, self._edges = f, edges
        whole = self._panels(edges[:-1], np.diff(edges))
        self._base = np.concatenate([[0.0], np.cumsum(whole)])

    def __call__(self, t: Array) -> AnyArray:
        """The integral up to each of t (k,); beyond the last edge its panel is continued."""
        j = np.clip(np.searchsorted(self._edges, t, side="right") - 1, 0, len(self._edges) - 2)
        start = self._edges[j]
        return np.asarray(self._base[j] + self._panels(start, t - start))

    def _panels(self, start: Array, width: Array) -> AnyArray:
        nodes = start[:, None] + width[:, None] * _HALF[None, :]
        values: Any = self._f(nodes.ravel()).reshape(nodes.shape)
        return np.asarray(values @ _WEIGHTS * width / 2.0)


def edges_of(length: float, turn: float) -> Array:
    """Edges from 0 to length with a panel for every half radian of `turn` [rad], and one in the
    middle, where a law may be of two pieces."""
    half = 1 + int(abs(turn))
    return np.linspace(0.0, length, 2 * half + 1)
