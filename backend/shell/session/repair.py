"""Making whole what a killed process left cut."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from backend.errors import InputError
from backend.shell.session.damaged import Damaged
from backend.shell.session.recover import NothingSaved, recover
from backend.shell.session.ring import parts_of
from backend.shell.session.rosbag2 import contents, write_metadata

NOTHING = 2**20  # a cut part without a whole chunk that is smaller is of no use [bytes]


def repair_last(folder: Path, shared: bool = False) -> None:
    """Whole files of the last parts, back to the first that is whole, in a folder that nobody
    writes to. shared: its parts may be other names of parts that are being written, as a pin's are.
    """
    repaired = False
    for part in reversed(parts_of(folder)):
        if contents(part.path) is not None:
            break
        if not shared or part.path.stat().st_nlink == 1:
            repair(part.path)
            repaired = True
    if repaired:
        list_parts(folder)


def list_parts(folder: Path) -> None:
    """Bring the folder's list of parts up to date."""
    with contextlib.suppress(OSError):
        write_metadata(folder, [part.path for part in parts_of(folder)])


def repair(path: Path) -> None:
    """A whole file in the place of a cut one. One that was cut before its first chunk was written
    holds nothing, and goes.
    """
    if contents(path) is not None:
        return
    whole = path.with_name(path.name + ".whole")
    whole.unlink(missing_ok=True)
    try:
        recover([path], whole)
    except NothingSaved:
        if path.stat().st_size < NOTHING:
            path.unlink()
        return
    stat = path.stat()
    os.utime(whole, ns=(stat.st_atime_ns, stat.st_mtime_ns))  # its age counts in the ring
    whole.replace(path)


def last_sequence(path: Path) -> int | None:
    """Sequence number of a file's last message; None when it has none."""
    try:
        damaged = Damaged(path)
    except InputError:
        return None
    try:
        for _ in damaged.messages():
            pass
        return damaged.saved.last
    finally:
        damaged.close()
