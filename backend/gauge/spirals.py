"""Transition curves in a frame of their own, from their curvature laws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from backend.gauge.quadrature import Running, edges_of
from backend.gauge.transitions import Law
from backend.spatial.types import Array

MAX_TURN = 4 * np.pi  # [rad]
MAX_SLOPE = 1.0  # y' of a direct spiral at its round end: beyond, y(x) is no track


class Shape(Protocol):
    """A curve along its arc length t (k,) in [0, length] [m], in some frame of its own."""

    @property
    def length(self) -> float: ...

    def local(self, t: Array) -> tuple[Array, Array, Array]:
        """Position (k, 2) [m], heading (k,) [rad] and curvature (k,) [1/m], left positive."""
        ...


@dataclass(frozen=True)
class IntegratedSpiral:
    """Curvature from k0 to k1 [1/m, left positive] by `law` along the arc length. Raises
    ValueError when it would turn by more than 4π."""

    law: Law
    length: float
    k0: float
    k1: float

    def __post_init__(self) -> None:
        if not self._turn() <= MAX_TURN:
            raise ValueError("it turns by more than two circles")

    def local(self, t: Array) -> tuple[Array, Array, Array]:
        """See Shape; starts at the origin along x."""
        z = self._running(t)
        bend = self.law.bend(np.clip(t / self.length, 0.0, 1.0))
        return _pairs(z), self._heading(t), self.k0 + (self.k1 - self.k0) * bend

    def _heading(self, t: Array) -> Array:
        u = t / self.length
        return np.asarray(self.k0 * t + (self.k1 - self.k0) * self.length * self.law.slope(u))

    def _turn(self) -> float:
        return self.length * max(abs(self.k0), abs(self.k1))

    @cached_property
    def _running(self) -> Running:
        edges = edges_of(self.length, self._turn())
        return Running(lambda t: np.exp(1j * self._heading(t)), edges)


@dataclass(frozen=True)
class DirectSpiral:
    """y'' = k f(x / P) over the tangent at its straight end, which is the first unless `reverse`.

    k: curvature at the round end as one travels [1/m, left positive]; over_tangent: P is the
    tangent's length X, else the arc length. Raises ValueError when it is too sharp to be one.
    """

    law: Law
    length: float
    k: float
    reverse: bool
    over_tangent: bool

    def __post_init__(self) -> None:
        if not abs(self.k) * self.length / 2 <= MAX_SLOPE:
            raise ValueError("it turns by more than 45 degrees, where y(x) is no transition curve")

    def local(self, t: Array) -> tuple[Array, Array, Array]:
        """See Shape; the straight end lies at the origin along x."""
        arc = self.length - t if self.reverse else t
        x = arc.copy()
        for _ in range(8):  # Newton; s(x) is nearly x
            x += (arc - self._arc(x)) / np.hypot(1.0, self._slope(x))
        slope = self._slope(x)
        u, P, k = x / self._period, self._period, self._signed
        y = k * P * P * self.law.offset(u)
        curvature = k * self.law.bend(np.clip(u, 0.0, 1.0)) / (1 + slope * slope) ** 1.5
        heading = np.arctan(slope)
        if self.reverse:
            heading, curvature = heading + np.pi, -curvature
        return np.stack([x, y], axis=1), heading, curvature

    @property
    def _signed(self) -> float:
        return (
            -self.k if self.reverse else self.k
        )  # a curve travelled backwards bends the other way

    def _slope(self, x: Array) -> Array:
        P = self._period
        return np.asarray(self._signed * P * self.law.slope(x / P))

    @cached_property
    def _period(self) -> float:
        if not self.over_tangent:
            return self.length
        X = self.length
        for _ in range(40):  # X s(X)/X = L, and s(X)/X hardly depends on X
            unit = Running(lambda u, X=X: np.hypot(1, self.k * X * self.law.slope(u)), _UNIT)  # type: ignore[misc]
            X = self.length / float(unit(np.ones(1))[0])
        return X

    @cached_property
    def _arc(self) -> Running:
        return Running(lambda x: np.hypot(1.0, self._slope(x)), self._period * _UNIT)


_UNIT = edges_of(1.0, 4.0)


def _pairs(z: Array) -> Array:
    return np.stack([z.real, z.imag], axis=1)
