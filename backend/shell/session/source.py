"""What every importer hands over: messages of our keys in order of time, and what went wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from backend.shell.session.format import Message

Progress: TypeAlias = Callable[[float], None]
"""Called with the fraction done, 0 to 1."""

MOST_KINDS = 50  # of problems that are told one by one
_JUMP = 100_000_000  # [ns] a clock that goes back further has been set


@dataclass(frozen=True)
class Problem:
    """One kind of problem: where it was met first, in words, and how often."""

    where: str
    text: str
    count: int


class Problems:
    """Collects problems by kind, so that a broken file of ten hours gives a few sentences."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[str, str]] = {}
        self._counts: dict[str, int] = {}

    def add(self, where: str, text: str, kind: str = "", count: int = 1) -> None:
        """kind: problems with the same one are counted together; default: the text itself."""
        key = kind or text
        if key not in self._first and len(self._first) >= MOST_KINDS:
            key, where, text = "others", "", "further kinds of problems"
        self._first.setdefault(key, (where, text))
        self._counts[key] = self._counts.get(key, 0) + count

    def found(self) -> tuple[Problem, ...]:
        return tuple(
            Problem(where, text, self._counts[key]) for key, (where, text) in self._first.items()
        )


@dataclass(frozen=True)
class Event:
    """Something at a time that a viewer should find on the timeline."""

    time: int  # [ns since 1970]
    machine: str
    text: str


@dataclass(frozen=True)
class Source:
    """What a file holds. Messages are read lazily; events and problems fill up meanwhile.

    origin: what it was, for Header.origin; note: what a viewer must know of how positions or
    angles came about; skipped: what is not of any machine of the site, with how often, filled up
    meanwhile.
    """

    path: Path
    origin: str
    note: str
    messages: Iterator[Message]
    problems: Problems
    events: list[Event] = field(default_factory=list)
    skipped: dict[str, int] = field(default_factory=dict)


class SteadyClock:
    """Times of a file [ns] to times that never go back, in the order of the file.

    A step back by more than 0.1 s is a clock that was set: it is told, and what follows is put
    right behind what came before. Smaller ones are messages that overtook each other.
    """

    def __init__(self, problems: Problems) -> None:
        self._problems = problems
        self._last: int | None = None
        self._shift = 0

    def place(self, time: int, where: str) -> int:
        if time < 0:
            self._problems.add(where, "times before 1970 count as its beginning")
        placed = max(time, 0) + self._shift
        if self._last is not None and placed < self._last:
            back = self._last - placed
            if back > _JUMP:
                self._problems.add(
                    where,
                    f"the clock goes back by {back / 1e9:.3f} s; what follows is put right behind "
                    "what came before",
                    kind="clock goes back",
                )
                self._shift += back
            placed = self._last
        self._last = placed
        return placed
