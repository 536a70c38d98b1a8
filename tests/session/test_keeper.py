"""What the writing process does with its orders, without a process."""

from __future__ import annotations

import os
import resource
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path

import pytest
from recordings import header, messages, read
from rosbags.highlevel import AnyReader

from backend.shell.session import keeper
from backend.shell.session.format import Message
from backend.shell.session.keeper import Keeper, Order, Plan, Record
from backend.shell.session.ring import Limits, in_use, parts_of
from backend.shell.session.rosbag2 import contents
from backend.shell.session.writer import type_of

SENT = list(messages(400))
RECORDS = [Record(k, m.topic, type_of(m.topic), m.time, m.data) for k, m in enumerate(SENT)]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The keeper's monotonic clock, moved by hand."""
    now = [1000.0]
    monkeypatch.setattr(keeper.time, "monotonic", lambda: now[0])
    return now


class Parent:
    """Sends records up to a number; after trouble all again that is not durable."""

    def __init__(self, writing: Keeper) -> None:
        self._keeper = writing
        self._sent = 0
        self.durable = -1

    def send(self, until: int) -> str:
        answer = self._keeper.write(Order(RECORDS[self._sent : until]))
        self.durable = -1 if answer.durable is None else answer.durable
        self._sent = self.durable + 1 if answer.trouble else until
        return answer.trouble


def plan(tmp_path: Path, **limits: float) -> Plan:
    return Plan(tmp_path / "demo", header(), Limits(**limits))  # type: ignore[arg-type]


def orders(size: int = 50) -> Iterator[Order]:
    for k in range(0, len(RECORDS), size):
        yield Order(RECORDS[k : k + size])


def everything(folder: Path) -> list[Message]:
    return [m for part in parts_of(folder) for m in read(part.path)]


@pytest.fixture
def file_limit() -> Iterator[list[int]]:
    """Files of this process cannot grow beyond it: a stand-in for a full disk."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)

    class Limit(list[int]):
        def set(self, size: int | None) -> None:
            wanted = old[0] if size is None else size
            resource.setrlimit(resource.RLIMIT_FSIZE, (wanted, old[1]))

    limit = Limit()
    yield limit
    limit.set(None)


def test_parts_follow_each_other_by_time_and_by_size(tmp_path: Path, clock: list[float]) -> None:
    writing = Keeper(plan(tmp_path, part_seconds=10.0, part_bytes=30_000))
    writing.begin()
    for order in orders():
        answer = writing.write(order)
        assert answer.trouble == ""
        clock[0] += 1.0
    folder = tmp_path / "demo" / header().recording
    assert in_use(folder)
    writing.close()
    assert not in_use(folder)
    parts = parts_of(folder)
    assert len(parts) >= 4
    assert all(part.size < 45_000 for part in parts)
    assert everything(folder) == SENT
    with AnyReader([folder]) as bag:
        expected = sum(type_of(m.topic) != "" for m in SENT)
        assert len(list(bag.messages())) == bag.message_count == expected


def test_a_chunk_closes_after_half_a_second(tmp_path: Path, clock: list[float]) -> None:
    writing = Keeper(plan(tmp_path))
    for k in range(30):
        answer = writing.write(Order(RECORDS[2 * k : 2 * k + 2]))
        clock[0] += 0.1
        # Everything that is older than half a second and an order is durable.
        assert (answer.durable or -1) >= 2 * k + 1 - 12
    writing.close()


def test_when_writing_fails_it_is_told_and_nothing_is_lost(
    tmp_path: Path, clock: list[float], file_limit: list[int]
) -> None:
    writing = Keeper(plan(tmp_path))
    folder = tmp_path / "demo" / header().recording
    parent, troubles = Parent(writing), []
    for k in range(70):
        if k == 20:
            file_limit.set(parts_of(folder)[-1].size + 300)  # type: ignore[attr-defined]
        if k == 40:
            file_limit.set(None)  # type: ignore[attr-defined]
        troubles.append(parent.send(30 * (k + 1)))
        clock[0] += 0.2
    writing.close()
    assert set(troubles[:20]) == {""}
    assert "file too large" in troubles[20:40]
    assert set(troubles[45:]) == {""}
    assert everything(folder) == SENT  # all parts are whole, also the one that could not grow


def test_it_stops_before_the_disk_is_full(
    tmp_path: Path, clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    free = [2**40]
    disk = namedtuple("disk", "f_bavail f_frsize")
    monkeypatch.setattr(keeper.os, "statvfs", lambda _: disk(free[0], 1))
    writing = Keeper(plan(tmp_path, free_bytes=100 * 2**20))
    parent, troubles = Parent(writing), []
    for k in range(30):
        free[0] = 50 * 2**20 if 10 <= k < 20 else 2**40
        troubles.append(parent.send(40 * (k + 1)))
        clock[0] += 0.6
        if k == 15:  # finished while there was room for it
            found = everything(tmp_path / "demo" / header().recording)
            assert found == SENT[: parent.durable + 1]
    writing.close()
    assert troubles == [""] * 10 + ["disk full, 50 MiB left"] * 10 + [""] * 10
    assert everything(tmp_path / "demo" / header().recording) == SENT[: 40 * 30]


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "demo").write_text("in the way")
    writing = Keeper(plan(tmp_path))
    assert writing.begin().trouble == "not a directory"
    assert writing.write(Order(RECORDS[:5])).trouble != ""
    (tmp_path / "demo").unlink()
    assert writing.write(Order(RECORDS[:5])).trouble == ""
    writing.close()
    assert everything(tmp_path / "demo" / header().recording) == SENT[:5]


def test_a_recording_deleted_under_it_goes_on_in_a_new_part(
    tmp_path: Path, clock: list[float]
) -> None:
    import shutil

    writing = Keeper(plan(tmp_path))
    writing.write(Order(RECORDS[:50]))
    shutil.rmtree(tmp_path / "demo")
    writing.write(Order(RECORDS[50:60], rotate=True))
    answer = writing.write(Order(RECORDS[60:100]))
    writing.close()
    assert answer.trouble == ""
    assert everything(tmp_path / "demo" / header().recording) == SENT[60:100]


def cut(path: Path, by: int) -> None:
    os.truncate(path, path.stat().st_size - by)


def test_what_a_killed_process_left_is_made_whole_and_continued(
    tmp_path: Path, clock: list[float]
) -> None:
    first = Keeper(plan(tmp_path))
    for k in range(10):
        first.write(Order(RECORDS[40 * k : 40 * k + 40]))
        clock[0] += 0.6
    # Killed: no summary, and half of its last chunk.
    first._writer.abandon()  # type: ignore[union-attr]
    first._closing.close()
    folder = tmp_path / "demo" / header().recording
    cut(parts_of(folder)[0].path, 100)
    second = Keeper(plan(tmp_path))
    answer = second.begin()
    assert answer.trouble == ""
    assert answer.durable is not None
    assert 300 <= answer.durable < 400
    assert everything(folder) == SENT[: answer.durable + 1]
    second.write(Order(RECORDS[answer.durable + 1 :]))
    second.close()
    assert len(parts_of(folder)) == 2
    assert everything(folder) == SENT


def test_what_an_earlier_cockpit_left_is_made_whole(tmp_path: Path, clock: list[float]) -> None:
    old = Keeper(Plan(tmp_path / "demo", header(recording="20250101T000000Z"), Limits()))
    for k in range(4):
        old.write(Order(RECORDS[40 * k : 40 * k + 40]))
        clock[0] += 0.6
    old._writer.abandon()  # type: ignore[union-attr]
    folder = tmp_path / "demo" / "20250101T000000Z"
    before = parts_of(folder)[0].end
    other = Keeper(plan(tmp_path))
    other.begin()
    assert contents(parts_of(folder)[0].path) is None  # still locked: somebody writes
    other.close()
    old._closing.close()  # it has died
    Keeper(plan(tmp_path)).begin()
    assert len(everything(folder)) >= 120
    assert parts_of(folder)[0].end == before  # its age is what it was
