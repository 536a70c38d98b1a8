"""A whole manoeuvre: reach, sequence 1, turn, sequences 2-1 and 2-2, stow; or down again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.planning.trajectory.sweep import Sweep
from backend.spatial.types import Array
from backend.surmount.judge import Sequence, judge
from backend.surmount.machine import Climber
from backend.surmount.moves import Move, move, on_edge, on_ground, timed
from backend.surmount.records import MOVES, Motion, Parameters, Phase, Spline, Step, Verdict
from backend.surmount.run import fine


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """verdict: of the sequences; moves: of the arm alone; motion: None where it cannot be; margins:
    by phase's name, the least [m]; why: in words what cannot be, empty where all can.
    """

    parameters: Parameters
    verdict: Verdict
    sequences: tuple[Sequence, ...]
    moves: tuple[Move, ...]
    motion: Motion | None
    margins: dict[str, float]
    kind: str = ""
    why: str = ""

    @property
    def margin(self) -> float:
        """The least of all phases [m]."""
        return min(self.margins.values(), default=float("nan"))


def manoeuvre(
    climber: Climber,
    step: Step,
    parameters: Parameters,
    start: Array | None,
    dt: float,
    spline: Spline | None = None,
    own: Sweep | None = None,
) -> Manoeuvre:
    """Up a step. start: (n,) posture from which the bucket is put onto it, the one in which it is
    there already when None; rows of the motion are dt [s] apart."""
    verdict, sequences = judge(climber, step, parameters, spline, own=own)
    if not verdict.holds:
        return Manoeuvre(parameters, verdict, sequences, (), None, {}, verdict.kind, verdict.why)
    one, two, three = sequences
    front, back = one.joints.q, _unwound(one.joints.q[-1], (two.joints.q, three.joints.q))
    stances = (
        on_ground(climber, -parameters.p1, 0.0),
        on_edge(climber, step, one),
        on_ground(climber, parameters.p4, step.height),
    )
    if start is not None:
        front = front + _turns(start[0] - front[0, 0], climber)
        back = tuple(rows + _turns(front[-1, 0] - rows[0, 0], climber) for rows in back)
    moves = [
        None
        if start is None
        else move(climber, step, stances[0], start, front[0], (False, True), own),
        move(climber, step, stances[1], front[-1], back[0][0], (True, True), own),
        move(climber, step, stances[2], back[1][-1], None, (True, False), own),
    ]
    margins = {s.name: float(s.margin.min()) for s in sequences}
    for name, made in zip(MOVES, moves, strict=True):
        if made is not None:
            margins[name] = made.margin
    for name, made in zip(MOVES, moves, strict=True):
        if made is not None and made.why:
            kind = "stability" if "tipping" in made.why else "collision"
            kept = tuple(x for x in moves if x is not None)
            why = f"{name}: {made.why}"
            return Manoeuvre(parameters, verdict, sequences, kept, None, margins, kind, why)
    loaded = [s.loads.torques for s in sequences]
    parts: list[Motion] = []
    if moves[0] is not None:
        parts.append(timed(climber, stances[0], "reach", moves[0], (None, loaded[0][0]), dt))
    parts.append(_with(fine(climber, step, parameters, one, dt, spline), front))
    assert moves[1] is not None
    assert moves[2] is not None
    parts.append(timed(climber, stances[1], "turn", moves[1], (loaded[0][-1], loaded[1][0]), dt))
    parts.append(_with(fine(climber, step, parameters, two, dt), back[0]))
    parts.append(_with(fine(climber, step, parameters, three, dt), back[1]))
    parts.append(timed(climber, stances[2], "stow", moves[2], (loaded[2][-1], None), dt))
    kept = tuple(x for x in moves if x is not None)
    motion = joined(parts, dt)
    return Manoeuvre(parameters, verdict, sequences, kept, motion, margins)


def joined(parts: list[Motion], dt: float) -> Motion:
    """One after the other, each beginning where the one before rests."""
    times, phases, at = [], [], 0.0
    for part in parts:
        times.append(at + part.time)
        phases += [Phase(p.name, at + p.start, at + p.end) for p in part.phases]
        at = float(times[-1][-1]) + dt
    first = parts[0]

    def rows(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    names = ("q", "rates", "belts", "T_step_root", "support", "held", "torques")
    return replace(
        first,
        time=np.concatenate(times),
        phases=tuple(phases),
        **{name: rows(name) for name in names},
    )


def _with(part: Motion, q: Array) -> Motion:
    """The same turns of the swing as in q (m, n)."""
    off = q[0, 0] - part.q[0, 0]
    turned = part.q.copy()
    turned[:, 0] += off
    return replace(part, q=turned)


def _turns(off: float, climber: Climber) -> Array:
    """(n,) whole turns of the swing that bring it nearest."""
    shift = np.zeros(len(climber.machine.joints))
    if climber.machine.joints[0].continuous:
        shift[0] = 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    return shift


def _unwound(last: Array, rows: tuple[Array, ...]) -> tuple[Array, ...]:
    """The same with the swing within half a turn of the one before."""
    found = []
    for q in rows:
        turned = q.copy()
        turned[:, 0] += 2.0 * np.pi * np.round((last[0] - q[0, 0]) / (2.0 * np.pi))
        found.append(turned)
        last = turned[-1]
    return tuple(found)
