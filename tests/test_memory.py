"""What a benchmark says of memory: what is theirs counts for each process, a shared file once."""

from __future__ import annotations

import math
import mmap
import os
import subprocess
import sys
from pathlib import Path

from cockpit.memory import memory_of

MIB = 2**20
HOLD = """
import mmap, sys
data = bytearray({own} * 2**20)
data[::4096] = b"x" * len(data[::4096])
file = open(sys.argv[1], "rb")
shared = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
sum(shared[::4096])
print("ready", flush=True)
sys.stdin.read()
"""


def _child(file: Path, own: int) -> subprocess.Popen[str]:
    child = subprocess.Popen(
        [sys.executable, "-c", HOLD.format(own=own), str(file)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    return child


def test_what_children_hold_counts_and_a_file_of_all_counts_once(tmp_path: Path) -> None:
    file = tmp_path / "library"
    file.write_bytes(os.urandom(40 * MIB))
    before = memory_of(os.getpid())
    first = _child(file, 30)
    with_one = memory_of(os.getpid())
    alone = memory_of(first.pid)
    second = _child(file, 30)
    with_two = memory_of(os.getpid())
    with file.open("rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as here:
        assert sum(here[::4096]) > 0
        with_three = memory_of(os.getpid())
    for child in (first, second):
        child.communicate("")
    assert alone > 70.0
    assert with_one - before > 70.0
    assert 30.0 < with_two - with_one < 60.0
    assert abs(with_three - with_two) < 5.0


def test_nothing_is_known_of_a_process_that_is_gone() -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert math.isnan(memory_of(child.pid))
