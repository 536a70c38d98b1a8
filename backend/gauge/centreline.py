"""A track's centreline: what the rules ask of it, and one that runs through given points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from backend.errors import InputError
from backend.spatial.types import Array, frozen


class Stations(Protocol):
    """A centreline at k stations.

    xyz: (k, 3) midway between the rails at the height of their tops, as without cant [m]; heading:
    (k,) counter-clockwise from east [rad]; gradient: (k,) rise per horizontal metre; cant: (k,)
    [m], positive where the left rail is the higher one; curvature: (k,) [1/m], positive to the
    left.
    """

    @property
    def xyz(self) -> Array: ...

    @property
    def heading(self) -> Array: ...

    @property
    def gradient(self) -> Array: ...

    @property
    def cant(self) -> Array: ...

    @property
    def curvature(self) -> Array: ...


class Centreline(Protocol):
    """name; state: "existing", "proposed", ..., see backend.gauge.choose; gauge: between the inner
    sides of the rail heads [m]; length [m]; at: the stations s (k,) [m], from 0 to length.
    """

    @property
    def name(self) -> str: ...

    @property
    def state(self) -> str: ...

    @property
    def gauge(self) -> float: ...

    @property
    def length(self) -> float: ...

    def at(self, s: Array) -> Stations: ...


@dataclass(frozen=True)
class PointStations:
    """`Stations` as plain arrays. lift: (k,) how far cant raises the midpoint between the rails
    above xyz [m], where that is known.
    """

    xyz: Array
    heading: Array
    gradient: Array
    cant: Array
    curvature: Array
    lift: Array | None = None


class InFrame:
    """A centreline in another frame with parallel axes, such as the site's, and with a height where
    it has none.
    """

    def __init__(
        self,
        line: Centreline,
        origin: Array,
        height: float | None = None,
        assumed: bool = False,
    ) -> None:
        """origin: (3,) of the frame, in the line's [m]; height: in the frame [m], of stations whose
        own is not finite; assumed: whether that height is nobody's word.
        """
        self.name, self.state, self.gauge = line.name, line.state, line.gauge
        self.length, self.assumed = line.length, assumed
        self._line, self._origin, self._height = line, np.asarray(origin), height

    def at(self, s: Array) -> PointStations:
        """The stations s (k,) [m]."""
        at = self._line.at(s)
        xyz, gradient = at.xyz - self._origin, at.gradient
        if self._height is not None:
            unknown = ~np.isfinite(xyz[:, 2])
            xyz[:, 2] = np.where(unknown, self._height, xyz[:, 2])
            gradient = np.where(unknown, 0.0, gradient)
        lift = getattr(at, "lift", None)
        return PointStations(xyz, at.heading, gradient, at.cant, at.curvature, lift)

    def as_told(self) -> InFrame:
        """The same line, its height NaN where it has none of its own."""
        told = InFrame(self._line, self._origin)
        told.name, told.state = self.name, self.state
        return told


class LineThroughPoints:
    """A smooth centreline through points: a cubic spline over the length of the chords.

    Through points of a circle of radius R at distances h it is off by about h^4 / (384 R^3):
    0.02 mm for 20 m at 300 m, where the chords themselves are off by 167 mm. Through two points it
    is straight.
    """

    def __init__(
        self,
        name: str,
        points: Array,
        cant: Array | float = 0.0,
        gauge: float = 1.435,
        state: str = "existing",
    ) -> None:
        """points: (k, 3) [m], k >= 2; cant: (k,) or one for all, linear between the points [m].

        Raises InputError for too few points, points that coincide in plan, cants of another number.
        """
        try:
            points = frozen(points, (None, 3), "points")
            cants = np.zeros(len(points)) + np.asarray(cant, dtype=float)
        except ValueError as error:
            raise InputError(
                f"{name}: points and cants do not fit; allowed are points of three finite numbers "
                "and one cant, or one for every point."
            ) from error
        steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
        if len(points) < 2 or not (steps > 1e-3).all():
            raise InputError(
                f"{name}: has too few points, or the same one twice in a row; allowed are two or "
                "more, at least 1 mm apart in plan."
            )
        self.name, self.state, self.gauge = name, state, gauge
        self.length = float(steps.sum())
        self._knots = np.concatenate([[0.0], np.cumsum(steps)])
        self._cants = cants
        self._curve = CubicSpline(
            self._knots, points, bc_type="natural" if len(points) < 3 else "not-a-knot"
        )

    def at(self, s: Array) -> PointStations:
        """The stations s (k,) [m], counted along the chords."""
        first, second = self._curve(s, 1), self._curve(s, 2)
        speed = np.hypot(first[:, 0], first[:, 1])
        turn = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        return PointStations(
            xyz=np.asarray(self._curve(s)),
            heading=np.arctan2(first[:, 1], first[:, 0]),
            gradient=first[:, 2] / speed,
            cant=np.interp(s, self._knots, self._cants),
            curvature=turn / speed**3,
        )
