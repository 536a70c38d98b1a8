"""The queue and its process: nobody waits for the disk, and operators hear of trouble at once."""

from __future__ import annotations

import os
import resource
import signal
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from recordings import header, messages, read

from backend.shell.session import feeder as feeding
from backend.shell.session.feeder import Feeder
from backend.shell.session.format import Message
from backend.shell.session.keeper import Keeper, Order, Plan, run
from backend.shell.session.ring import Limits, parts_of
from backend.shell.session.writer import type_of

SENT = list(messages(4000))


def limited_run(connection: Connection, plan: Plan) -> None:
    """No file may grow beyond 40 kB until a file says that there is room: a full disk's errors."""
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    keeper = Keeper(plan)
    connection.send(keeper.begin())
    while (order := connection.recv()) is not None:
        room = (plan.site_folder.parent / "room").exists()
        resource.setrlimit(resource.RLIMIT_FSIZE, (old[0] if room else 40_000, old[1]))
        connection.send(keeper.write(order))
    keeper.close()


class SlowKeeper(Keeper):
    def write(self, order: Order) -> object:  # type: ignore[override]
        while (self._plan.site_folder.parent / "slow").exists():
            time.sleep(0.01)
        return super().write(order)


def slow_run(connection: Connection, plan: Plan) -> None:
    """The disk answers nothing while there is a file that says so."""
    keeper = SlowKeeper(plan)
    connection.send(keeper.begin())
    while (order := connection.recv()) is not None:
        connection.send(keeper.write(order))
    keeper.close()


def dying_run(connection: Connection, plan: Plan) -> None:
    """Ends at once."""
    os._exit(1)


# A computer that runs tests may be busy: campaign and benchmark measure, tests see that nothing
# waits for a disk that is stuck for seconds.
BUSY = 2.0  # [s]
NEVER_WAITED = 0.4  # [s]


class Fed:
    """A feeder that is fed a message every millisecond, timed."""

    def __init__(
        self, folder: Path, target: Callable[[Connection, Plan], None] = run, **limits: float
    ) -> None:
        self.plan = Plan(folder / "demo", header(), Limits(**limits))  # type: ignore[arg-type]
        self.folder = self.plan.folder
        self.feeder = Feeder(self.plan, target=target)
        self.feeder.start()
        self.slowest = 0.0
        self.sent: list[Message] = []
        self._messages = iter(SENT)
        self.until(lambda: self.feeder.ready or target is dying_run, 30.0)

    def put(self, message: Message | None = None) -> None:
        message = message or next(self._messages)
        begun = time.monotonic()
        self.feeder.put([(message.topic, type_of(message.topic), message.time, message.data)])
        self.slowest = max(self.slowest, time.monotonic() - begun)
        self.sent.append(message)

    def feed(self, seconds: float) -> set[str]:
        """The lines that were told meanwhile."""
        until = time.monotonic() + seconds
        told = set()
        while time.monotonic() < until:
            self.put()
            told.add(self.feeder.line())
            time.sleep(0.004)
        return told

    def until(self, condition: Callable[[], bool], seconds: float) -> float:
        """Feeds until the condition holds; how long it took [s]."""
        begun = time.monotonic()
        while not condition():
            assert time.monotonic() - begun < seconds, self.feeder.line()
            if self.sent:
                self.put()
            time.sleep(0.004)
        return time.monotonic() - begun

    def close(self) -> list[Message]:
        self.feeder.close()
        return [m for part in parts_of(self.folder) for m in read(part.path)]


@pytest.fixture
def fed(tmp_path: Path) -> Iterator[Callable[..., Fed]]:
    made: list[Fed] = []

    def make(target: Callable[[Connection, Plan], None] = run, **limits: float) -> Fed:
        made.append(Fed(tmp_path, target, **limits))
        return made[-1]

    yield make
    for one in made:
        one.feeder.close()


def test_everything_arrives_in_order_and_calls_are_quick(fed: Callable[..., Fed]) -> None:
    recording = fed(part_seconds=1.0)
    told = recording.feed(3.0)
    assert told == {""}
    assert recording.close() == recording.sent
    assert len(parts_of(recording.folder)) >= 2
    assert recording.slowest < NEVER_WAITED


def test_a_killed_process_is_told_started_again_and_nothing_is_lost(
    fed: Callable[..., Fed],
) -> None:
    recording = fed()
    for _ in range(2):
        recording.feed(0.8)
        pid = recording.feeder.pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        before = recording.feeder._restarted
        took = recording.until(lambda n=before: recording.feeder._restarted > n, 5.0)
        assert took < 1.0
        assert "ended and was started again" in recording.feeder.line()
        recording.until(lambda: bool(recording.feeder.ready), 30.0)
        assert recording.feeder.pid != pid
    recording.feed(1.0)
    found = recording.close()
    assert found == recording.sent  # each message once
    assert len(parts_of(recording.folder)) == 3
    assert recording.feeder._lost == 0


def test_a_full_disk_is_told_within_a_second_and_what_was_written_stays(
    fed: Callable[..., Fed], tmp_path: Path
) -> None:
    recording = fed(limited_run)
    # Noise does not compress: the limit is reached soon.
    noise = [Message("/left/points", SENT[0].time + k, os.urandom(4000)) for k in range(30)]
    recording.feed(0.7)
    begun = time.monotonic()
    for cloud in noise:
        recording.put(cloud)
    recording.until(lambda: "file too large" in recording.feeder.line(), 5.0)
    assert (
        time.monotonic() - begun < 1.0 + 0.5 + BUSY
    )  # half a second may pass until a chunk is full
    assert "not recorded since" in recording.feeder.line()
    recording.feed(0.5)
    (tmp_path / "room").touch()
    took = recording.until(lambda: recording.feeder.line() == "", 5.0)
    assert took < 2.0 + BUSY
    recording.feed(0.5)
    assert recording.close() == recording.sent  # what waited was written as soon as there was room


def test_a_slow_disk_is_told_within_a_second_and_caught_up(
    fed: Callable[..., Fed], tmp_path: Path
) -> None:
    recording = fed(slow_run)
    recording.feed(0.5)
    (tmp_path / "slow").touch()
    took = recording.until(lambda: "disk slow" in recording.feeder.line(), 5.0)
    assert took < 1.0 + BUSY
    recording.feed(0.5)
    assert recording.slowest < NEVER_WAITED
    (tmp_path / "slow").unlink()
    recording.until(lambda: recording.feeder.line() == "", 5.0)
    assert recording.close() == recording.sent


def test_a_full_queue_loses_the_newest_and_says_how_many(
    fed: Callable[..., Fed], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeding, "QUEUE_BYTES", 150_000)
    recording = fed(slow_run)
    recording.feed(0.1)
    (tmp_path / "slow").touch()
    recording.until(lambda: recording.feeder._lost > 10, 30.0)
    assert f"{recording.feeder._lost} messages lost" in recording.feeder.line()
    (tmp_path / "slow").unlink()
    recording.until(lambda: "disk slow" not in recording.feeder.line(), 5.0)
    recording.until(lambda: recording.feeder._bytes < 100_000, 5.0)
    lost = recording.feeder._lost
    recording.feed(0.5)
    assert f"{lost} messages lost, the last at" in recording.feeder.line()
    found = recording.close()
    assert len(found) == len(recording.sent) - recording.feeder._lost
    assert recording.feeder._lost == lost
    kept = iter(recording.sent)
    assert all(message in kept for message in found)  # in order, nothing twice


def test_a_process_that_cannot_live_is_told_and_not_started_all_the_time(
    fed: Callable[..., Fed],
) -> None:
    recording = fed(dying_run)
    recording.until(lambda: "ended" in recording.feeder.line(), 10.0)
    pids = set()
    until = time.monotonic() + 3.0
    while time.monotonic() < until:
        pids.add(recording.feeder.pid)
        time.sleep(0.01)
    assert len(pids - {None}) <= 3


def test_the_process_ends_with_its_parent_and_finishes_the_file(tmp_path: Path) -> None:
    import subprocess
    import sys

    program = """
import os, sys, time
sys.path[:0] = sys.argv[2:]
from pathlib import Path
from test_feeder import Fed
if __name__ == "__main__":
    recording = Fed(Path(sys.argv[1]))
    recording.feed(1.0)
    time.sleep(0.5)
    print(recording.feeder.pid, len(recording.sent), flush=True)
    os.kill(os.getpid(), 9)
"""
    script = tmp_path / "program.py"
    script.write_text(program)
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path), str(here), str(here.parent)],
        stdout=subprocess.PIPE,
        text=True,
        timeout=120,
    )
    assert done.returncode == -signal.SIGKILL
    pid, sent = (int(word) for word in done.stdout.split())
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline and Path(f"/proc/{pid}").exists():
        time.sleep(0.05)
    assert not Path(f"/proc/{pid}").exists()
    (part,) = parts_of(tmp_path / "demo" / header().recording)
    assert read(part.path) == SENT[:sent]
