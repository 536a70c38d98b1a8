"""How much memory processes take, from what Linux tells of them."""

from __future__ import annotations

import os
from pathlib import Path


def memory_of(pid: int) -> float:
    """Of a process and of those that it started [MiB]; NaN where the system does not tell.

    What is theirs alone counts for each. A file that several of them map, such as a library, lies
    in memory once: it counts once, as what they have of it together or as all of it, whichever is
    less.
    The sum is never too small.
    """
    own, mapped = 0.0, dict[str, float]()
    processes = _with_children(pid)
    for process in processes:
        for name, rest, file in _mappings(process):
            own += rest
            if file:
                mapped[name] = mapped.get(name, 0.0) + file
    if not processes:
        return float("nan")
    return (own + sum(min(held, _size(name)) for name, held in mapped.items())) / 1024.0


def _with_children(pid: int) -> list[int]:
    if not Path(f"/proc/{pid}/smaps").is_file():
        return []
    found = [pid]
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in children.read_text().split():
            found += _with_children(int(child))
    return found


def _mappings(pid: int) -> list[tuple[str, float, float]]:
    """(file, KiB that are the process's own, KiB of the file) of every mapping in memory."""
    found: list[tuple[str, float, float]] = []
    name, held = "", 0.0
    for line in Path(f"/proc/{pid}/smaps").read_text().splitlines():
        first, *others = line.split(maxsplit=5)
        if first == "Rss:":
            held = float(others[0])
        elif first == "Anonymous:":
            own = float(others[0]) if name.startswith("/") else held
            found.append((name, own, held - own))
        elif not first.endswith(":"):
            name = others[4] if len(others) > 4 else ""
    return found


def _size(name: str) -> float:
    """[KiB], in whole pages; a file that is gone is as large as what is held of it."""
    try:
        return float(-(-os.stat(name).st_size // 4096) * 4)
    except OSError:
        return float("inf")
