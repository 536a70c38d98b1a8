"""The folder of recordings: what is in it, what must go when it is full, and what is pinned.

ROOT/SITE/RECORDING/part-0000.mcap …    a recording of one run of the cockpit
ROOT/SITE/pinned/NAME/part-0000.mcap …  kept until someone deletes it
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import shutil
import time
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from backend.errors import InputError
from backend.shell.session.rosbag2 import METADATA_FILE, write_metadata

PINNED = "pinned"
LOCK = "lock"
VARIABLE = "EXCAVATOR_COCKPIT_RECORDINGS"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}")
_PART = re.compile(r"part-(\d{4,})\.mcap")


@dataclass(frozen=True)
class Limits:
    """What a site's recordings may take. max_bytes, max_age [s]: of all that is not pinned;
    free_bytes: never used of the disk; part_bytes, part_seconds: of one file.
    """

    max_bytes: int = 4 * 2**30
    max_age: float = 24 * 3600.0
    free_bytes: int = 512 * 2**20
    part_bytes: int = 64 * 2**20
    part_seconds: float = 60.0


@dataclass(frozen=True)
class Part:
    """One file. number: in its recording; size [bytes]; end: last change, seconds since 1970."""

    path: Path
    number: int
    size: int
    end: float


def recordings_root(folder: str = "", base: Path | None = None) -> Path:
    """Where recordings are: `folder` (against `base`) if any, else by the environment, else in the
    XDG state folder.
    """
    if folder:
        return (base or Path.cwd()) / Path(folder).expanduser()
    if told := os.environ.get(VARIABLE):
        return Path(told)
    state = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(state) / "excavator-cockpit" / "recordings"


def part_name(number: int) -> str:
    return f"part-{number:04}.mcap"


def parts_of(folder: Path) -> list[Part]:
    """The parts in one recording's folder, in their order; empty when there is no such folder."""
    found = []
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            name = _PART.fullmatch(entry.name)
            if name is None:
                continue
            with contextlib.suppress(OSError):  # deleted this moment
                stat = entry.stat()
                found.append(Part(Path(entry.path), int(name[1]), stat.st_size, stat.st_mtime))
    return sorted(found, key=lambda part: part.number)


def recordings_of(site_folder: Path) -> list[Path]:
    """Folders of a site's recordings that are not pinned, by name, which is by time."""
    with contextlib.suppress(OSError):
        folders = [entry for entry in site_folder.iterdir() if entry.is_dir()]
        return sorted(folder for folder in folders if folder.name != PINNED and parts_of(folder))
    return []


def pins_of(site_folder: Path) -> list[Path]:
    """Folders of a site's pinned recordings, by name."""
    with contextlib.suppress(OSError):
        return sorted(entry for entry in (site_folder / PINNED).iterdir() if entry.is_dir())
    return []


def make_room(
    site_folder: Path, limits: Limits, now: float, keep: Collection[Path] = ()
) -> list[Path]:
    """Deletes the oldest parts beyond the limits; returns them. Never what is pinned, in `keep`,
    or being written by another process. now: seconds since 1970.
    """
    parts: list[Part] = []
    for folder in recordings_of(site_folder):
        own = parts_of(folder)
        if own and in_use(folder):
            keep = {*keep, own[-1].path}
        parts += own
    parts.sort(key=lambda part: part.end)
    total = sum(part.size for part in parts)
    gone = []
    for part in parts:
        if total <= limits.max_bytes and now - part.end <= limits.max_age:
            break
        if part.path in keep:
            continue
        with contextlib.suppress(OSError):
            part.path.unlink()
            gone.append(part.path)
            total -= part.size
    for folder in {path.parent for path in gone}:
        with contextlib.suppress(OSError):
            if parts_of(folder):
                write_metadata(folder, [part.path for part in parts_of(folder)])
            elif not in_use(folder):
                for name in (METADATA_FILE, LOCK):
                    (folder / name).unlink(missing_ok=True)
                folder.rmdir()
    return gone


def pin(site_folder: Path, name: str, seconds: float, now: float | None = None) -> Path:
    """Keeps the last `seconds` of a site's recordings for good, as hard links in pinned/NAME.

    A part that is being written is pinned whole, as it will be when it is finished. Raises
    InputError for a name that is taken or impossible, and when nothing was recorded then.
    """
    if not _NAME.fullmatch(name) or name.strip(" .") != name:
        raise InputError(
            f'the name "{name}" cannot be a folder\'s; allowed are up to 64 letters, digits, '
            "spaces, dots, - and _."
        )
    folder = site_folder / PINNED / name
    if folder.exists():
        raise InputError(f'"{name}" is pinned already; allowed is a new name.')
    since = (time.time() if now is None else now) - seconds
    chosen = [
        part
        for recording in recordings_of(site_folder)
        for part in parts_of(recording)
        if part.end >= since and part.size > 0
    ]
    if not chosen:
        raise InputError(f"{site_folder}: nothing was recorded in the last {seconds / 60:g} min.")
    several = len({part.path.parent for part in chosen}) > 1
    partial = folder.with_name(f".{name}.partial")
    try:
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        for k, part in enumerate(chosen):
            # Parts of several runs are counted anew, or their names would collide.
            with contextlib.suppress(FileNotFoundError):  # the ring was quicker
                _link(part.path, partial / (part_name(k) if several else part.path.name))
        write_metadata(partial, [part.path for part in parts_of(partial)])
        partial.rename(folder)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}).") from error
    return folder


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except FileNotFoundError:
        raise
    except OSError:  # another file system, or one without hard links
        shutil.copy2(source, target)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Marks a recording as being written, until the process ends at the latest."""
    with (folder / LOCK).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def in_use(folder: Path) -> bool:
    """Whether some process, this one included, has the recording locked."""
    try:
        with (folder / LOCK).open("r") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
