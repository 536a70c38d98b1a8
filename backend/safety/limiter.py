"""From what an operator wishes to what the machine is told.

Only motion that approaches is limited, per joint and direction, tracks too; moving away is free at
full speed. After a limit has brought a direction to zero, the stick must return to neutral before
that joint may approach again. What is unknown or old allows nothing. See `limits` for the formulas
and their sources.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.safety.braking import full_speeds
from backend.safety.limits import FREE, Cause, Delay, at_once, ends, limits
from backend.safety.record import Concern
from backend.spatial.types import Array, BoolArray

LOCKED_ABOVE = 0.4
"""No motion when commands and data take longer than this there and back [s]."""
OVERRIDE_FRACTION = 0.15
"""Share of full speed that an override allows where a concern allows less."""
STANDING = 0.01
"""Share of full speed below which a limited motion is brought to zero."""
SUPERVISOR = "supervisor"


@dataclass(frozen=True)
class Wish:
    """What the sticks ask for. joints: (n,) [rad/s]; tracks: (2,) left, right [m/s]. Zero is a
    stick in neutral.
    """

    joints: Array
    tracks: Array


@dataclass(frozen=True)
class Override:
    """A supervisor's hold-to-run: given anew with every command while it is held. by: who."""

    by: str
    role: str
    reason: str

    def __post_init__(self) -> None:
        if self.role != SUPERVISOR:
            raise ValueError(f"role: {self.role!r} may not override; allowed is {SUPERVISOR}")
        if not self.reason.strip() or not self.by.strip():
            raise ValueError("an override names who overrides, and a reason")


@dataclass(frozen=True)
class Latch:
    """shut: (m, 2) directions that wait for their stick's neutral."""

    shut: BoolArray


def open_latch(machine: Machine) -> Latch:
    return Latch(np.zeros((len(machine.joints) + 2, 2), dtype=bool))


@dataclass(frozen=True)
class Decision:
    """joints: (n,) [rad/s]; tracks: (2,) [m/s]: the command. fraction: (m, 2) of full speed that
    each motion alone may have, (negative, positive); causes: why, by motion and direction; cut: why
    the command is less than that, by motion; locked: why nothing moves at all, else empty;
    override: who overrides and why, None without.
    """

    joints: Array
    tracks: Array
    fraction: Array
    causes: tuple[tuple[Cause, Cause], ...]
    cut: dict[int, Cause]
    locked: str
    override: Override | None
    latch: Latch

    @property
    def free(self) -> BoolArray:
        """(m, 2) directions that are free at full speed."""
        return np.asarray(self.fraction >= 1.0)


def limit(
    name: str,
    machine: Machine,
    q: Array,
    wish: Wish,
    concerns: tuple[Concern, ...],
    delay: Delay,
    latch: Latch,
    now: float,
    override: Override | None = None,
    sticks: Wish | None = None,
) -> Decision:
    """The command for the machine `name` at `now` [s].

    q: (n,) joint values [rad]; concerns: of the newest snapshot, of all machines; delay: of the
    radio; latch: what the last call returned; override: while it is held; sticks: what the sticks
    ask for where `wish` was shaped from it: they alone say what is in neutral. None: the wish does.
    """
    n = len(machine.joints)
    full = full_speeds(machine)
    asked = _asked(wish, full)
    held = asked if sticks is None else _asked(sticks, full)
    locked = _locked(delay)
    own = tuple(c for c in concerns if c.machine == name)
    lift = OVERRIDE_FRACTION if override else 0.0
    found = limits(machine, own, delay, now, lift)
    fraction, causes = found.fraction.copy(), [list(pair) for pair in found.causes]
    # A stick that now points the other way has passed its neutral.
    shut = latch.shut & np.stack([held < 0.0, held > 0.0], axis=1)
    if override is None:
        for k, side in np.argwhere(shut):
            fraction[k, side] = 0.0
            if causes[k][side] == FREE:
                causes[k][side] = Cause("neutral", "return the stick to neutral first")
    age = max((c.approach.age for c in own if c.approach is not None), default=0.0)
    stops = ends(machine, q, delay.total(n, age)[:n])
    for k, side in np.argwhere(stops < fraction[:n]):
        fraction[k, side] = stops[k, side]
        causes[k][side] = Cause("end", f"end of the {machine.joints[k].role}'s travel")
    if locked:
        fraction[:] = 0.0
        causes = [[Cause("link", locked)] * 2 for _ in causes]

    side = (asked > 0.0).astype(int)
    most = np.take_along_axis(fraction, side[:, None], axis=1)[:, 0] * full
    speed = np.sign(asked) * np.minimum(np.abs(asked), most)
    cut: dict[int, Cause] = {}
    if override is None:
        speed, cut = at_once(machine, speed, found)
    standing = (np.abs(speed) < STANDING * full) & (np.abs(speed) < np.abs(asked))
    speed = np.where(standing, 0.0, speed)
    shut = shut | _closed(asked, standing, causes, cut)
    return Decision(
        joints=speed[:n],
        tracks=speed[n:],
        fraction=fraction,
        causes=tuple((a, b) for a, b in causes),
        cut=cut,
        locked=locked,
        override=override,
        latch=Latch(shut),
    )


def _asked(wish: Wish, full: Array) -> Array:
    """(m,) [rad/s, m/s]; what is not a number is nothing."""
    asked = np.concatenate([wish.joints, wish.tracks])
    return np.asarray(np.clip(np.where(np.isfinite(asked), asked, 0.0), -full, full))


def _locked(delay: Delay) -> str:
    if delay.round_trip <= LOCKED_ABOVE:
        return ""
    if not math.isfinite(delay.round_trip):
        return "round trip is unknown: motion is locked"
    return (
        f"round trip {1e3 * delay.round_trip:.0f} ms: "
        f"motion is locked above {1e3 * LOCKED_ABOVE:.0f} ms"
    )


def _closed(
    asked: Array, standing: BoolArray, causes: list[list[Cause]], cut: dict[int, Cause]
) -> BoolArray:
    """(m, 2) directions that are asked for and that a concern has brought to a stand.

    The end of a joint's travel is none: there is nothing to approach there.
    """
    shut = np.zeros((len(asked), 2), dtype=bool)
    for k in np.flatnonzero(standing):
        side = int(asked[k] > 0.0)
        shut[k, side] = k in cut or causes[k][side].concern not in ("", "end")
    return shut
