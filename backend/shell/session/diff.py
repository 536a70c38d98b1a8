"""As it was against as we would judge it now, moment by moment."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from backend.documents.session import (
    DiffResult,
    DistanceDifference,
    FirstWarning,
    LevelDifference,
    LevelsModel,
    PairDifference,
)
from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.safety.record import Level
from backend.shell.session.cycles import Portion, Topics, document
from backend.shell.session.evaluate import Progress, evaluate
from backend.shell.session.format import SNAPSHOT
from backend.shell.session.reader import Session
from backend.shell.session.series import Row, row_of_document, row_of_snapshot
from backend.shell.session.tracks import sources

KEPT = 100  # evaluated cycles in which the one of a recorded snapshot is looked for
SAME = 2_000_000_000  # a cycle's number means the same cycle only this near in time [ns]


def diff(
    session: Session, topics: Topics, config: Config, progress: Progress | None = None
) -> DiffResult:
    """Evaluates the whole session and compares. Raises InputError where there are not both."""
    if sources(session, topics) != ("recorded", "evaluated"):
        raise InputError(
            f"{session.path}: a diff needs recorded snapshots and poses; it has only "
            f"{', '.join(sources(session, topics)) or 'neither'}."
        )
    comparison = Comparison(session.begin)
    for time, recorded, snapshot in _matched(session, topics, config, progress):
        names = _warnings_of_document(recorded)
        ours = {(c.machine, c.name): c.level.name for c in snapshot.concerns}
        comparison.add(
            row_of_document(time, recorded), row_of_snapshot(time, snapshot, config), names, ours
        )
    return comparison.result()


def _warnings_of_document(recorded: dict[str, Any]) -> dict[tuple[str, str], str]:
    return {(c["machine"], c["name"]): c["level"] for c in recorded["concerns"]}


def _matched(
    session: Session, topics: Topics, config: Config, progress: Callable[[float], None] | None
) -> Iterator[tuple[int, dict[str, Any], Snapshot]]:
    """(time, recorded document, evaluated snapshot) of the same cycles."""
    kept: deque[tuple[Portion, Snapshot]] = deque(maxlen=KEPT)
    evaluated = evaluate(session, topics, config, progress=progress)
    for message in session.messages(topics=[SNAPSHOT]):
        try:
            recorded = document(message.data)
            number = int(recorded["cycle"])
        except (ValueError, TypeError, KeyError):
            session.note("some recorded snapshots cannot be read and are left out")
            continue
        while not kept or kept[-1][0].time < message.time:
            following = next(evaluated, None)
            if following is None:
                break
            kept.append(following)
        same = [
            one for one in kept if one[0].cycle == number and abs(one[0].time - message.time) < SAME
        ]
        before = [one for one in kept if one[0].cycle is None and one[0].time <= message.time]
        chosen = same[-1:] or before[-1:]
        if chosen:
            yield message.time, recorded, chosen[0][1]


@dataclass
class _Pair:
    largest: float = -1.0
    at: int = 0
    squares: float = 0.0
    both: int = 0
    one: int = 0


@dataclass
class Comparison:
    """Collects moments. begin: of the session [ns]."""

    begin: int
    _count: int = 0
    _pairs: dict[str, _Pair] = field(default_factory=dict)
    _levels: int = 0
    _agree: int = 0
    _open: dict[str, LevelDifference] = field(default_factory=dict)
    _differences: list[LevelDifference] = field(default_factory=list)
    _first: dict[tuple[str, str, str], list[float | None]] = field(default_factory=dict)

    def add(
        self,
        recorded: Row,
        evaluated: Row,
        warnings: dict[tuple[str, str], str],
        ours: dict[tuple[str, str], str],
    ) -> None:
        """One moment. warnings, ours: level by machine and concern, recorded and evaluated."""
        self._count += 1
        at = (recorded.time - self.begin) / 1e9
        for key in recorded.values.keys() | evaluated.values.keys():
            then = recorded.values.get(key, math.nan)
            now = evaluated.values.get(key, math.nan)
            if key[0] == "clearance":
                self._distance(key[1], then, now, recorded.time)
            elif key[0] == "level" and then == then and now == now:
                self._level(key[1], Level(int(then)).name, Level(int(now)).name, at)
        for side, levels in enumerate((warnings, ours)):
            for (machine, name), level in levels.items():
                if level != Level.CLEAR.name:
                    first = self._first.setdefault((machine, name, level), [None, None])
                    if first[side] is None:
                        first[side] = at

    def result(self) -> DiffResult:
        pairs = {}
        for name, pair in sorted(self._pairs.items()):
            known = pair.both > 0
            pairs[name] = PairDifference(
                max_abs=pair.largest if known else None,
                at=(pair.at - self.begin) / 1e9 if known else None,
                rms=math.sqrt(pair.squares / pair.both) if known else None,
                compared=pair.both,
                known_once=pair.one,
            )
        differences = sorted([*self._differences, *self._open.values()], key=lambda d: d.start)
        return DiffResult(
            compared=self._count,
            distance=DistanceDifference(pairs=pairs),
            levels=LevelsModel(
                agree=self._agree / self._levels if self._levels else 1.0, differences=differences
            ),
            first_warnings=[
                FirstWarning(
                    machine=machine, name=name, level=level, recorded=times[0], evaluated=times[1]
                )
                for (machine, name, level), times in sorted(
                    self._first.items(), key=lambda one: min(t for t in one[1] if t is not None)
                )
            ],
        )

    def _distance(self, name: str, then: float, now: float, time: int) -> None:
        pair = self._pairs.setdefault(name, _Pair())
        if math.isfinite(then) and math.isfinite(now):
            pair.both += 1
            pair.squares += (then - now) ** 2
            if abs(then - now) > pair.largest:
                pair.largest, pair.at = abs(then - now), time
        elif math.isfinite(then) != math.isfinite(now):
            pair.one += 1

    def _level(self, machine: str, then: str, now: str, at: float) -> None:
        self._levels += 1
        self._agree += then == now
        before = self._open.get(machine)
        if before is not None and (before.recorded, before.evaluated) == (then, now):
            before.end = at
            return
        if before is not None:
            self._differences.append(self._open.pop(machine))
        if then != now:
            self._open[machine] = LevelDifference(
                machine=machine, start=at, end=at, recorded=then, evaluated=now
            )
