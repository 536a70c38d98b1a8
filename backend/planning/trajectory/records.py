"""What is asked of a trajectory, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array, frozen


@dataclass(frozen=True)
class Obstacles:
    """boxes: in the machine's root frame; names: one each; ground: the root's plane z = 0 is one,
    too, for all that moves.
    """

    boxes: Boxes = NO_BOXES
    names: tuple[str, ...] = ()
    ground: bool = True

    def __post_init__(self) -> None:
        if len(self.names) != len(self.boxes):
            raise ValueError(f"{len(self.boxes)} boxes have {len(self.names)} names")


@dataclass(frozen=True)
class Cylindrical:
    """Highest speeds and accelerations (3,) of the end point along theta [rad/s, rad/s^2], r and z
    [m/s, m/s^2] about the swing axis; infinite where none is set.
    """

    speed: Array = field(default_factory=lambda: np.full(3, np.inf))
    acceleration: Array = field(default_factory=lambda: np.full(3, np.inf))

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration"):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=float))
            if getattr(self, name).shape != (3,) or not (getattr(self, name) > 0.0).all():
                raise InputError(f"limits: {name} along theta, r, z must be three numbers above 0.")


@dataclass(frozen=True)
class Task:
    """From q (n,) [rad] at rest to the end point p_root (3,) [m], root frame, at rest.

    attitude: of the bucket at the goal [rad], see `machine.inverse`; None keeps the present one or,
    where that cannot be, takes the nearest that can. band: how far the attitude may leave those of
    start and goal on the way [rad]. payload [kg]. clearance: to obstacles [m]. lift: how far
    above the higher of start and goal the end point is carried [m]. share: of the way from the
    support polygon's centre to its edges that the ZMP leaves free. speeds, accelerations: (n,)
    lower than the machine's own [rad/s, rad/s^2]. T_site_root: (4, 4), of which only the slope
    counts; level when None.
    """

    q: Array
    p_root: Array
    attitude: float | None = None
    band: float = 0.0
    payload: float = 0.0
    clearance: float = 0.2
    lift: float = 0.0
    share: float = 0.1
    speeds: Array | None = None
    accelerations: Array | None = None
    cylindrical: Cylindrical = field(default_factory=Cylindrical)
    T_site_root: Array | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", frozen(self.q, (None,), "q"))
        object.__setattr__(self, "p_root", frozen(self.p_root, (3,), "p_root"))
        if not (np.isfinite(self.q).all() and np.isfinite(self.p_root).all()):
            raise InputError("task: joint values and goal must be finite numbers.")
        for name, low, high in (
            ("band", 0.0, np.pi),
            ("payload", 0.0, 1e6),
            ("clearance", 0.01, 5.0),
            ("lift", 0.0, 20.0),
            ("share", 0.0, 0.95),
        ):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError(f"task: {name} is {value:g}; allowed is {low:g} to {high:g}.")

    def max_velocity(self, machine: Machine) -> Array:
        """(n,) [rad/s]: the machine's, and lower where the task says so."""
        return _lower(machine.max_velocity, self.speeds, "speeds")

    def max_acceleration(self, machine: Machine) -> Array:
        """(n,) [rad/s^2]."""
        return _lower(machine.max_acceleration, self.accelerations, "accelerations")


@dataclass(frozen=True)
class Checks:
    """Judged apart from what planned: min_clearance: to obstacles by python-fcl at dense samples
    [m], infinite where there are none; min_own: of the machine's own bodies [m]; min_ground: of
    what moves to the ground, infinite where that is no obstacle, only the sign counts where it
    touches [m]; min_stability_margin: of the full ZMP to the support polygon's edge [m], NaN where
    the masses are not known; worst_rate, worst_acceleration: shares of the joints' limits; samples:
    judged.
    """

    min_clearance: float
    min_own: float
    min_ground: float
    min_stability_margin: float
    worst_rate: float
    worst_acceleration: float
    samples: int


@dataclass(frozen=True)
class Trajectory:
    """time: (m,) [s]; q, rates, accelerations: (m, n); method: of the timing, or penalty; way: in
    words how it was found; notes: what was not judged, in words; violations: what the re-check
    found, in words. Only the penalty method's results have any: they are to be compared with, and
    no machine may follow them.
    """

    time: Array
    q: Array
    rates: Array
    accelerations: Array
    method: str
    way: str
    checks: Checks
    notes: tuple[str, ...] = ()
    violations: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        return float(self.time[-1])


@dataclass(frozen=True)
class Refusal:
    """why: one sentence; kind: start, goal, blocked, "not found", tips, timing, check; blockers:
    names of what is in the way; proven: that no way exists, not only that none was found.
    """

    kind: str
    why: str
    blockers: tuple[str, ...] = ()
    proven: bool = False


def _lower(most: Array, asked: Array | None, what: str) -> Array:
    if asked is None:
        return most
    asked = np.asarray(asked, dtype=float)
    if asked.shape != most.shape:
        raise InputError(f"task: {what} needs {len(most)} values, one a joint.")
    if not (asked > 0.0).all():
        raise InputError(f"task: {what} must be above 0.")
    return np.asarray(np.minimum(most, asked))
