"""The files of a session: which they are, what is odd about them, and the one being read."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import IO

from backend.errors import InputError
from backend.shell.session.chunks import ALLOWED, File
from backend.shell.session.format import Header
from backend.shell.session.timeline import Record, Stretch


def paths_of(path: Path) -> list[Path]:
    """A file, or the MCAP files of a folder in their order. Raises InputError."""
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise InputError(f"{path}: there is no such file or folder; {ALLOWED}.")
    found = sorted(path.glob("*.mcap"), key=_natural)
    if not found:
        raise InputError(f"{path}: holds no .mcap file; {ALLOWED}.")
    return found


def _natural(path: Path) -> list[tuple[int, str]]:
    """part-2 before part-10."""
    pieces = re.split(r"(\d+)", path.name)
    return [(int(piece), "") if piece.isdigit() else (-1, piece) for piece in pieces]


def missing(headers: list[Header | None]) -> list[str]:
    """Parts that are not there, and parts of other recordings."""
    numbers = [header.part for header in headers if header is not None]
    names = {header.recording for header in headers if header is not None}
    found = []
    if numbers and len(numbers) > 1:
        absent = sorted(set(range(numbers[0], numbers[-1] + 1)) - set(numbers))
        if absent:
            found.append(f"parts {', '.join(map(str, absent))} are missing")
    if len(names) > 1:
        found.append(f"parts of {len(names)} recordings stand in one folder")
    return found


def shared(files: list[File]) -> list[str]:
    """Topics that several senders published on: two machines may go by one name."""
    found = set()
    for file in files:
        names = Counter(topic for topic, _, _ in file.topics.values())
        found |= {topic for topic, senders in names.items() if senders > 1}
    return [
        f"{topic}: several senders shared this topic; are there two machines with one name?"
        for topic in sorted(found)
    ]


class Streams:
    """The file that is read, opened when its turn comes."""

    def __init__(self, files: list[File]) -> None:
        self._files = files
        self._opened: tuple[int, IO[bytes]] | None = None

    def __enter__(self) -> Streams:
        return self

    def __exit__(self, *_: object) -> None:
        if self._opened is not None:
            self._opened[1].close()

    def messages(self, stretch: Stretch) -> list[Record]:
        """Raises Damaged and OSError."""
        if self._opened is None or self._opened[0] != stretch.file:
            self.__exit__()
            self._opened = None
            self._opened = stretch.file, self._files[stretch.file].path.open("rb")
        return self._files[stretch.file].messages(self._opened[1], stretch.chunk)
