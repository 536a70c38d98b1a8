"""What is to be surmounted, by which parameters, and what comes of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array

SEQUENCES = ("sequence 1", "sequence 2-1", "sequence 2-2")
MOVES = ("reach", "turn", "stow")
"""Of the arm alone: onto the step, from the front to the back, and off the ground at the end."""


@dataclass(frozen=True)
class Step:
    """height [m] over the ground before it; depth of its top across the edge; before: length of the
    level ground before it; beyond: height over the top of another step where the top ends, 0 where
    the ground falls or nothing is known [m].

    Step frame: x across the edge towards the top, y along it to the left, z up; the edge E is at
    x = 0, z = height. Raises InputError unless height, depth and before are above 0.
    """

    height: float
    depth: float = math.inf
    before: float = math.inf
    beyond: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.height) and self.height > 0.0):
            raise InputError(f"a step's height is {self.height:g} m; allowed is more than 0.")
        for name in ("depth", "before"):
            if not getattr(self, name) > 0.0:
                value = getattr(self, name)
                raise InputError(f"a step's {name} is {value:g} m; allowed is more than 0.")

    @property
    def risers(self) -> tuple[tuple[float, float], ...]:
        """(x, height) of this edge and of the one beyond [m]."""
        own = (0.0, self.height)
        if self.beyond > 0.0 and math.isfinite(self.depth):
            return own, (self.depth, self.height + self.beyond)
        return (own,)


@dataclass(frozen=True)
class Parameters:
    """Jayasekara and Arisumi 2015, Fig. 2. p1: from the crawler's middle P_b to the edge E at the
    start; p2: from E to the bucket on the top; p3: from E to the bucket on the ground behind; p4:
    from E to P_b at the end [m]; alpha_f: the lean after sequence 1 [rad].
    """

    p1: float
    p2: float
    p3: float
    p4: float
    alpha_f: float

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in astuple(self)):
            raise InputError("parameters: p1, p2, p3, p4 and alpha_f must be finite numbers.")

    @property
    def free(self) -> Array:
        """(4,) of the search: p1, p2, p3 [m], alpha_f [rad]."""
        return np.array([self.p1, self.p2, self.p3, self.alpha_f])

    def with_free(self, values: Array) -> Parameters:
        """The same with other values of p1, p2, p3, alpha_f (4,)."""
        p1, p2, p3, alpha_f = (float(v) for v in values)
        return Parameters(p1, p2, p3, self.p4, alpha_f)


@dataclass(frozen=True)
class Spline:
    """How sequence 1 rises, instead of the cubic (7): shares of the whole height at a third and at
    two thirds of the way; the cubic has 7/27 and 20/27.
    """

    low: float = 7.0 / 27.0
    high: float = 20.0 / 27.0


@dataclass(frozen=True)
class Demands:
    """What every manoeuvre has to keep. payload [kg]; friction of the ground; clearance: of bodies
    to step and ground, but tracks and bucket [m]; margin: of the zero-moment point to the edge of
    what bears the machine [m]; pace: share of the joints' and tracks' full speed; torques: (n,) of
    the joints, infinite where not known [N m]; facing: 1 with the tracks' front first, -1 with
    their rear; attitude: of the bucket on the ground, of the line from its pivot to its edge above
    the horizontal [rad].
    """

    payload: float
    friction: float
    clearance: float
    margin: float
    pace: float
    torques: Array
    facing: int = 1
    attitude: float = -0.5 * math.pi


@dataclass(frozen=True)
class Phase:
    """One part of a manoeuvre: from start to end [s]."""

    name: str
    start: float
    end: float


@dataclass(frozen=True, eq=False)
class Motion:
    """time: (m,) from 0 [s]; q, rates: (m, n) [rad, rad/s]; belts: (m,) speed of both over the
    crawler, along x of the frame [m/s]; T_step_root: (m, 4, 4); support: (m, 2, 2), each of
    the two lines that bear it: x [m] and half width [m], rear one first; held: (m, 2) which point
    the bucket's edge keeps, x and z [m], NaN where none; torques: (m, n) to be expected [N m];
    phases: in order.
    """

    time: Array
    q: Array
    rates: Array
    belts: Array
    T_step_root: Array
    support: Array
    held: Array
    torques: Array
    phases: tuple[Phase, ...]

    @property
    def duration(self) -> float:
        return float(self.time[-1])

    def phase_index(self) -> Array:
        """(m,) of every row, as an index of `phases`."""
        ends = np.array([phase.end for phase in self.phases])
        return np.minimum(np.searchsorted(ends, self.time - 1e-9), len(ends) - 1)


LEFT = ("room", "reach", "joints", "crawler", "bodies", "margin", "torque", "slip")


@dataclass(frozen=True)
class Verdict:
    """How well parameters keep to what is demanded: of each of LEFT what is left, negative where it
    does not hold. room: of the ground before the edge and of the top, for tracks and bucket [m];
    reach: of the triangle's lengths, as a share of the arm (22), (23); joints: to the joints' ends
    [rad]; crawler: of the belts to the step [m]; bodies: of the other bodies to step and ground
    beyond the clearance [m]; margin: beyond the one demanded [m]; torque: share of the joints'
    limits that is left (20); slip: of the friction that is left at belts and bucket. energy:
    quasi-static [J]; kind, why: what does not hold first, in words, empty where all does.
    """

    left: Mapping[str, float]
    energy: float = math.nan
    kind: str = ""
    why: str = ""

    @property
    def holds(self) -> bool:
        return not self.why

    @property
    def values(self) -> Array:
        """(8,) in the order of LEFT."""
        return np.array([self.left[name] for name in LEFT])
