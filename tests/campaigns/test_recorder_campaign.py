"""Kills of the recorder at random moments: every file opens, at most the last chunk is lost."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from backend.shell.session.feeder import PERIOD, Feeder
from backend.shell.session.format import Header, Message
from backend.shell.session.keeper import CHUNK_SECONDS, Plan
from backend.shell.session.recover import NothingSaved, recover
from backend.shell.session.ring import Limits, parts_of

KILLS = int(os.environ.get("RECORDER_KILLS", "200"))
STEP = 0.002  # between two messages [s]
HERE = Path(__file__).resolve()
LATE = 0.4  # allowed to the scheduler of a busy computer [s]


def message(k: int) -> Message:
    """As large as a JointState, every hundredth as a snapshot; the same for the same k."""
    data = struct.pack("<Q", k) * (20 if k % 100 else 2000)
    return Message("/left/points", 1_790_000_000_000_000_000 + k * 2_000_000, data)


def start(folder: Path) -> Feeder:
    texts = dict.fromkeys(("recording", "site_file", "site", "own", "origin", "software"), "x")
    header = Header(offset=0, part=0, **texts)  # type: ignore[arg-type]
    feeder = Feeder(Plan(folder, header, Limits(part_seconds=5.0)))
    feeder.start()
    while not feeder.ready:
        time.sleep(0.01)
    return feeder


def put(feeder: Feeder, k: int) -> None:
    one = message(k)
    feeder.put([(one.topic, "sensor_msgs/msg/PointCloud2", one.time, one.data)])


def saved(folder: Path, out: Path) -> list[int]:
    """Numbers of all messages that can be read, part by part."""
    found = []
    for part in parts_of(folder / "x"):
        copy = out / f"{part.number}.mcap"
        try:
            recover([part.path], copy)
        except NothingSaved:  # killed before its first chunk
            continue
        from mcap.reader import make_reader

        with copy.open("rb") as stream:
            for _, _, m in make_reader(stream).iter_messages(log_time_order=False):
                k = struct.unpack_from("<Q", m.data)[0]
                assert m.data == message(k).data
                found.append(k)
        copy.unlink()
    return found


@pytest.mark.timeout(3600)
def test_kills_of_the_writing_process(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    feeder = start(tmp_path / "demo")
    k, told = 0, []
    for _ in range(KILLS // 2):
        until = time.monotonic() + rng.uniform(0.02, 1.2)
        while time.monotonic() < until:
            put(feeder, k)
            k += 1
            time.sleep(STEP)
        pid, before, killed = feeder.pid, feeder._restarted, time.monotonic()
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        while feeder._restarted == before or not feeder.ready:
            if feeder._restarted != before and len(told) < _ + 1:
                told.append(time.monotonic() - killed)
            put(feeder, k)
            k += 1
            time.sleep(STEP)
    feeder.close()
    (tmp_path / "out").mkdir()
    found = saved(tmp_path / "demo", tmp_path / "out")
    lost = k - len(set(found))
    print(f"\n{KILLS // 2} kills of the writing process, {k} messages")
    print(f"  messages lost            expected 0     measured {lost}")
    print(f"  messages twice           expected 0     measured {len(found) - len(set(found))}")
    print(f"  told after at most [s]   expected 1     measured {max(told):.2f}")
    assert found == list(range(k))
    assert max(told) < 1.0 + LATE


@pytest.mark.timeout(3600)
def test_kills_of_everything_at_once(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    losses, empty, opened = [], 0, 0
    (tmp_path / "out").mkdir()
    for run in range(KILLS - KILLS // 2):
        folder, count = tmp_path / f"run{run}", tmp_path / "count"
        count.write_bytes(bytes(8))
        process = subprocess.Popen(
            [sys.executable, str(HERE), str(folder), str(count)],
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": str(HERE.parents[2])},
            start_new_session=True,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        time.sleep(rng.uniform(0.05, 1.5))
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        (sent,) = struct.unpack("<Q", count.read_bytes())
        time.sleep(0.02)  # until the other process of the group is gone, too
        found = saved(folder, tmp_path / "out")
        assert found == list(range(len(found)))
        opened += len(parts_of(folder / "x"))
        empty += not found
        losses.append((sent - len(found)) * STEP)
    print(f"\n{len(losses)} kills of cockpit and writing process at once, {opened} files")
    print(f"  files that cannot be read   expected 0       measured 0 ({empty} before a chunk)")
    print(
        f"  lost [s]                    expected < {CHUNK_SECONDS + PERIOD:.1f}   "
        f"measured p50 {np.median(losses):.2f}, at most {max(losses):.2f}"
    )
    assert max(losses) < CHUNK_SECONDS + PERIOD + LATE


def feed_for_ever(folder: Path, count: Path) -> None:
    """What is killed: puts messages, and how many in a file that survives."""
    import mmap

    feeder = start(folder)
    with count.open("r+b") as file, mmap.mmap(file.fileno(), 8) as shared:
        print("ready", flush=True)
        k = 0
        while True:
            put(feeder, k)
            k += 1
            shared[:8] = struct.pack("<Q", k)
            time.sleep(STEP)


if __name__ == "__main__":
    feed_for_ever(Path(sys.argv[1]), Path(sys.argv[2]))
