"""Chunks of consecutive files on one time line that never runs backward.

Where the recording's clock was set back, what follows is moved to after what stands before. A
foreign file that merely is not in the order of time (its topics written one after the other, say)
is told apart by this: none of its topics runs backward. Such a file is read in the order of time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from operator import itemgetter
from typing import TypeAlias

from backend.shell.session.chunks import Chunk, Damaged, File

JUMP = 1_000_000_000  # a clock this far back was set; less is messages that overtook others [ns]

Record: TypeAlias = tuple[int, int, bytes]
"""Channel id, log time [ns], data."""


@dataclass(frozen=True)
class Stretch:
    """A chunk on the time line, which it covers from start to end [ns].

    shifts: (index of a message, [ns] added to its log time and to those after it).
    """

    file: int
    chunk: Chunk
    start: int
    end: int
    shifts: tuple[tuple[int, int], ...]

    def moved(self, records: list[Record]) -> list[Record]:
        """The chunk's messages with their places on the time line."""
        if self.shifts == ((0, 0),):
            return records
        found: list[Record] = []
        bounds = [*(index for index, _ in self.shifts[1:]), len(records)]
        for (first, shift), after in zip(self.shifts, bounds, strict=True):
            found += [(channel, time + shift, data) for channel, time, data in records[first:after]]
        return found


@dataclass
class Timeline:
    """stretches: in file order; reached: newest time up to each one's end [ns]; unsorted: files
    whose messages must be sorted; notes: in words; shift: of what comes next [ns].
    """

    stretches: list[Stretch] = field(default_factory=list)
    reached: list[int] = field(default_factory=list)
    unsorted: set[int] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    shift: int = 0

    def add(self, number: int, file: File, ours: bool) -> tuple[int, int]:
        """Appends a file; returns when it begins and ends [ns].

        ours: written by a cockpit, whose order is the order of processing and stays.
        """
        first, before = len(self.stretches), self.shift
        if not ours and _disordered(file):
            self.unsorted.add(number)
            self.notes.append(
                f"{file.path.name}: messages are not in the order of time; they are sorted"
            )
        for k, chunk in enumerate(file.chunks):
            late = self.reached and chunk.start + self.shift < self.reached[-1] - JUMP
            at_an_end = k in (0, len(file.chunks) - 1)
            if number not in self.unsorted and (late or at_an_end):
                stretch = self._examined(number, file, chunk)
            else:
                stretch = self._plain(number, chunk)
            self.stretches.append(stretch)
            self.reached.append(max([stretch.end, *self.reached[-1:]]))
            self.shift = stretch.shifts[-1][1]
        if self.shift > before:
            self.notes.append(
                f"{file.path.name}: the clock jumps back, by {(self.shift - before) / 1e9:.1f} s "
                "in all; what follows is shown after what stands before"
            )
        mine = self.stretches[first:]
        return min(s.start for s in mine), max(s.end for s in mine)

    def _plain(self, number: int, chunk: Chunk, more: int = 0) -> Stretch:
        shift = self.shift + more
        return Stretch(number, chunk, chunk.start + shift, chunk.end + shift, ((0, shift),))

    def _examined(self, number: int, file: File, chunk: Chunk) -> Stretch:
        """A chunk in which the clock may have been set back."""
        newest = self.reached[-1] if self.reached else None
        times = [time for _, time, _ in _records(file, chunk)]
        if not times:  # damaged: by what its index says
            back = 0 if newest is None else newest - (chunk.start + self.shift)
            return self._plain(number, chunk, back if back > JUMP else 0)
        shifts, moved = [(0, self.shift)], []
        for index, time in enumerate(times):
            at = time + shifts[-1][1]
            if newest is not None and at < newest - JUMP:
                shifts.append((index, shifts[-1][1] + newest - at))
                at = newest
            newest = at if newest is None else max(newest, at)
            moved.append(at)
        if len(shifts) > 1 and shifts[1][0] == 0:
            del shifts[0]
        return Stretch(number, chunk, min(moved), max(moved), tuple(shifts))


def in_order(
    stretches: list[Stretch], read: Callable[[Stretch], list[Record]]
) -> Iterator[tuple[Stretch, list[Record]]]:
    """Stretches of a file that is not in the order of time, sorted, with their messages.

    Neighbours in time are joined, so that no more than what overlaps is held at once.
    """
    by_start = sorted(stretches, key=lambda s: s.start)
    reach = list(accumulate((s.end for s in by_start), max))
    group: list[Record] = []
    for k, stretch in enumerate(by_start):
        group += read(stretch)
        if k + 1 == len(by_start) or by_start[k + 1].start > reach[k]:
            yield stretch, sorted(group, key=itemgetter(1))
            group = []


def _records(file: File, chunk: Chunk) -> list[Record]:
    try:
        with file.path.open("rb") as stream:
            return file.messages(stream, chunk)
    except (Damaged, OSError):
        return []  # told of when it is read


def _disordered(file: File) -> bool:
    """Whether times run backward in the file as it stands, but in none of its topics."""
    ends = [[time for _, time, _ in _records(file, c)] for c in (file.chunks[0], file.chunks[-1])]
    reach = accumulate((chunk.end for chunk in file.chunks), max)
    back = any(c.start < r - JUMP for r, (_, c) in zip(reach, pairwise(file.chunks), strict=False))
    if not back and not any(_backward(times) for times in ends):
        return False
    newest: dict[int, int] = {}
    for chunk in file.chunks:
        for channel, time, _ in _records(file, chunk):
            if time < newest.get(channel, time) - JUMP:
                return False
            newest[channel] = max(time, newest.get(channel, time))
    return True


def _backward(times: list[int]) -> bool:
    return any(time < newest - JUMP for time, newest in zip(times, accumulate(times, max)))  # noqa: B905
