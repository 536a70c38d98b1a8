"""Alignments laid out by other means than the reader's: ordinary differential equations for spirals
by curvature, y(x) and its arc length for the others. Writes them as LandXML in any units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

LANDXML = "http://www.landxml.org/schema/LandXML-1.2"
INFRAMODEL = "http://www.inframodel.fi/inframodel"

# Curvature over u = t / L, written out from the literature.
CURVATURE: dict[str, Callable[[float], float]] = {
    "clothoid": lambda u: u,
    "bloss": lambda u: 3 * u**2 - 2 * u**3,
    "cosine": lambda u: 0.5 - 0.5 * math.cos(math.pi * u),
    "sinusoid": lambda u: u - math.sin(2 * math.pi * u) / (2 * math.pi),
    "biquadratic": lambda u: 2 * u**2 if u < 0.5 else -1 + 4 * u - 2 * u**2,
}


def _biquadratic_parabola(x: float, L: float) -> tuple[float, float]:
    if x < L / 2:
        return x**4 / (6 * L**2), 2 * x**3 / (3 * L**2)
    # y'' = -1 + 4 u - 2 u², integrated twice with y and y' continuous at L / 2
    h = L / 2
    y0, s0 = h**4 / (6 * L**2), 2 * h**3 / (3 * L**2)
    slope = (
        s0
        + (-x + 2 * x**2 / L - 2 * x**3 / (3 * L**2))
        - (-h + 2 * h**2 / L - 2 * h**3 / (3 * L**2))
    )
    first = lambda v: -(v**2) / 2 + 2 * v**3 / (3 * L) - v**4 / (6 * L**2)  # noqa: E731
    at_half = -h + 2 * h**2 / L - 2 * h**3 / (3 * L**2)
    return y0 + (s0 - at_half) * (x - h) + first(x) - first(h), slope


# y(x) R and y'(x) R; P is the stated length, or the tangent's length where `True`.
OFFSET: dict[str, tuple[Callable[[float, float], tuple[float, float]], bool]] = {
    "cubicParabola": (lambda x, P: (x**3 / (6 * P), x**2 / (2 * P)), False),
    "biquadraticParabola": (_biquadratic_parabola, False),
    "japaneseCubic": (lambda x, P: (x**3 / (6 * P), x**2 / (2 * P)), True),
    "sineHalfWave": (
        lambda x, P: (
            x**2 / 4 - P**2 / (2 * math.pi**2) * (1 - math.cos(math.pi * x / P)),
            x / 2 - P / (2 * math.pi) * math.sin(math.pi * x / P),
        ),
        True,
    ),
}

Pose = tuple[float, float, float]


def step(kind: str, L: float, k0: float, k1: float) -> Pose:
    """Where a piece of length L ends that starts at the origin along x: x, y, heading."""
    if kind in ("line", "curve"):
        kind = "clothoid"
    if kind in CURVATURE:
        bend = CURVATURE[kind]

        def f(t: float, s: np.ndarray) -> list[float]:
            k = k0 + (k1 - k0) * bend(t / L)
            return [math.cos(s[2]), math.sin(s[2]), k]

        half = solve_ivp(f, (0, L / 2), [0, 0, 0], rtol=1e-12, atol=1e-12, method="DOP853")
        end = solve_ivp(f, (L / 2, L), half.y[:, -1], rtol=1e-12, atol=1e-12, method="DOP853")
        x, y, heading = end.y[:, -1]
        return float(x), float(y), float(heading)
    if k1 != 0.0:
        return _direct(kind, L, k1)
    x, y, heading = _direct(kind, L, -k0)  # backwards along its mirror image
    c, s = math.cos(heading + math.pi), math.sin(heading + math.pi)
    return -(c * x + s * y), -(-s * x + c * y), -heading


def _direct(kind: str, L: float, k: float) -> Pose:
    offset, over_tangent = OFFSET[kind]

    def excess(X: float) -> float:
        P = X if over_tangent else L
        arc = quad(lambda x: math.hypot(1, k * offset(x, P)[1]), 0, X, points=[X / 2], epsabs=1e-12)
        return float(arc[0]) - L

    X = float(brentq(excess, 0.9 * L, L, xtol=1e-12))
    y, slope = offset(X, X if over_tangent else L)
    return X, k * y, math.atan(k * slope)


@dataclass
class Course:
    """Pieces (kind, length, k0, k1) from a start pose; `poses` are those at the joints."""

    pieces: list[tuple[str, float, float, float]]
    start: Pose = (25_496_000.0, 6_673_000.0, 1.1)
    poses: list[Pose] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.poses = [self.start]
        for piece in self.pieces:
            e, n, h = self.poses[-1]
            x, y, turn = step(*piece)
            c, s = math.cos(h), math.sin(h)
            self.poses.append((e + c * x - s * y, n + s * x + c * y, h + turn))

    @property
    def joints(self) -> list[float]:
        """Distances of the joints, the end included."""
        return [0.0, *np.cumsum([p[1] for p in self.pieces]).tolist()]


@dataclass(frozen=True)
class Unit:
    """How a file writes lengths and directions."""

    element: str
    metres: float
    bearing: Callable[[float], str]


def _degrees(bearing: float) -> float:
    return math.degrees(bearing) % 360.0


def _dms(bearing: float) -> str:
    total = _degrees(bearing) * 3600
    d, rest = divmod(total, 3600)
    m, s = divmod(rest, 60)
    return (
        f"{int(d)}.{int(m):02d}{s * 1e6:08.0f}"
        if s < 59.9999995
        else f"{int(d)}.{int(m):02d}59999999"
    )


UNITS = {
    "grads": Unit(
        '<Metric linearUnit="meter" directionUnit="grads" angularUnit="grads"/>',
        1.0,
        lambda b: f"{_degrees(b) / 0.9:.8f}",
    ),
    "radians": Unit(
        '<Metric linearUnit="meter"/>', 1.0, lambda b: f"{math.radians(_degrees(b)):.9f}"
    ),
    "survey feet": Unit(
        '<Imperial linearUnit="USSurveyFoot" directionUnit="decimal degrees"/>',
        1200 / 3937,
        lambda b: f"{_degrees(b):.8f}",
    ),
    "feet": Unit('<Imperial linearUnit="foot" directionUnit="decimal dd.mm.ss"/>', 0.3048, _dms),
}


def document(body: str, unit: str = "grads", space: str = LANDXML, crs: str = "") -> bytes:
    """A whole file around a body."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<LandXML xmlns="{space}" version="1.2">\n'
        f"<Units>{UNITS[unit].element}</Units>\n{crs}\n{body}\n</LandXML>\n"
    ).encode()


def alignment(
    course: Course, unit: str = "grads", extra: str = "", start: float = 0.0, name: str = "A"
) -> str:
    """<Alignments> with the course's plan and whatever else."""
    u = UNITS[unit]
    parts = []
    for (kind, L, k0, k1), s, a, b in zip(
        course.pieces, course.joints, course.poses, course.poses[1:], strict=False
    ):
        sta = f'staStart="{(s + start) / u.metres:.6f}" length="{L / u.metres:.6f}"'
        ends = f"<Start>{_point(a, u)}</Start>", f"<End>{_point(b, u)}</End>"
        rot = "ccw" if k0 + k1 > 0 else "cw"
        dirs = (
            f'dirStart="{u.bearing(math.pi / 2 - a[2])}" dirEnd="{u.bearing(math.pi / 2 - b[2])}"'
        )
        if kind == "line":
            parts.append(
                f'<Line {sta} dir="{u.bearing(math.pi / 2 - a[2])}">{ends[0]}{ends[1]}</Line>'
            )
        elif kind == "curve":
            center = (a[0] - math.sin(a[2]) / k0, a[1] + math.cos(a[2]) / k0, 0.0)
            chord = math.dist(a[:2], b[:2]) / u.metres
            parts.append(
                f'<Curve rot="{rot}" {sta} radius="{1 / abs(k0) / u.metres:.6f}" '
                f'chord="{chord:.6f}" {dirs}>{ends[0]}<Center>{_point(center, u)}</Center>'
                f"{ends[1]}</Curve>"
            )
        else:
            radii = [f"{1 / abs(k) / u.metres:.6f}" if k else "INF" for k in (k0, k1)]
            parts.append(
                f'<Spiral spiType="{kind}" rot="{rot}" {sta} radiusStart="{radii[0]}" '
                f'radiusEnd="{radii[1]}" {dirs}>{ends[0]}<PI>{_point(_crossing(a, b), u)}</PI>'
                f"{ends[1]}</Spiral>"
            )
    length = course.joints[-1] / u.metres
    return (
        f'<Alignments><Alignment name="{name}" length="{length:.6f}" '
        f'staStart="{start / u.metres:.6f}"><CoordGeom>{"".join(parts)}</CoordGeom>{extra}'
        "</Alignment></Alignments>"
    )


def _crossing(a: Pose, b: Pose) -> Pose:
    """Where the tangents at two poses meet."""
    A = np.array([[math.cos(a[2]), -math.cos(b[2])], [math.sin(a[2]), -math.sin(b[2])]])
    t = np.linalg.solve(A, [b[0] - a[0], b[1] - a[1]])[0]
    return a[0] + t * math.cos(a[2]), a[1] + t * math.sin(a[2]), 0.0


def _point(pose: Pose, unit: Unit) -> str:
    """North before east."""
    return f"{pose[1] / unit.metres:.7f} {pose[0] / unit.metres:.7f}"
