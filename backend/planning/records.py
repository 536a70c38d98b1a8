"""What the three methods are given and what they answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.types import Array, IntArray

Method = Literal["scaling", "potential", "constrained"]
"""A: Mäkinen's linear velocity scaling; B: his potential field; C: speeds under constraints."""

Projector = Literal["first joints", "position kept", "printed"]
"""What repulsion may do to the task, see `potential`."""


@dataclass(frozen=True)
class Thresholds:
    """upper p_u, lower p_l [m]: where a limit begins to be felt, and what is kept from it.

    Mäkinen 2021, Section 4.2: 0.8 m and 0.2 m.
    """

    upper: float = 0.8
    lower: float = 0.2

    def __post_init__(self) -> None:
        if not 0.0 <= self.lower < self.upper < np.inf:
            raise InputError(
                f"thresholds: 0 <= p_l < p_u is needed, not p_l = {self.lower} m and "
                f"p_u = {self.upper} m."
            )


@dataclass(frozen=True)
class Settings:
    """How the methods act.

    gain: mu of Eq. (3.13) [m^4/s]; damping: lambda of Eq. (3.9); rate: the damper's slope
    xi / (d_i - d_s) [1/s], by which a distance above p_l may shrink, None for the slowest of the
    joints' a / v (see `damper_rate`); retreat: speed asked for out of a limit, at most [m/s].
    accelerations: whether joint speeds change by the machine's accelerations at most; without, they
    follow at once, as in the thesis.
    """

    thresholds: Thresholds = field(default_factory=Thresholds)
    gain: float = 0.01
    damping: float = 0.1
    projector: Projector = "first joints"
    rate: float | None = None
    retreat: float = 0.3
    accelerations: bool = False


@dataclass(frozen=True)
class Wish:
    """What the operator or the task wants: joint rates (n,) [rad/s], or a twist (6,) of the tool,
    linear above angular [m/s, rad/s] in the site frame. Exactly one of them.
    """

    rates: Array | None = None
    twist: Array | None = None

    def __post_init__(self) -> None:
        if (self.rates is None) == (self.twist is None):
            raise InputError("wish: exactly one of joint rates and tool twist is needed.")


@dataclass(frozen=True)
class State:
    """Joint rates (n,) at which the machine moves now [rad/s]; T_site_root (4, 4) or None."""

    rates: Array
    T_site_root: Array | None = None


class Action(NamedTuple):
    """rates: (n,) [rad/s]; scale: the smallest factor by which a wish was cut, 1 where nothing was;
    why: in words what limited, the closest first; binding: (b,) the pairs that did, in that order.
    """

    rates: Array
    scale: float
    why: tuple[str, ...]
    binding: IntArray


def damper_rate(machine: Machine) -> float:
    """The largest slope [1/s] at which every joint's deceleration suffices to slow down along it.

    A distance that shrinks as d' = -rate d asks for the deceleration rate * v; at full speed that
    is a when rate = a / v. The slowest joint counts.
    """
    return float((machine.max_acceleration / machine.max_velocity).min())
