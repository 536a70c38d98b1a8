"""What is in the folder of recordings, for `cockpit recordings`."""

from __future__ import annotations

import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from backend.documents.recordings import RecordingRow, RecordingsDocument
from backend.errors import InputError
from backend.shell.session.ring import (
    in_use,
    parts_of,
    pin,
    pins_of,
    recordings_of,
    recordings_root,
)
from backend.shell.session.rosbag2 import contents


def run_list(folder: Path | None, as_json: bool) -> None:
    """Print all recordings, site by site."""
    root = folder or recordings_root()
    document = RecordingsDocument(root=str(root), recordings=rows(root))
    if as_json:
        print(document.model_dump_json(indent=2))
        return
    if not document.recordings:
        print(f"There are no recordings in {root}.")
        return
    table = Table(title=str(root))
    for column in ("site", "recording", "began", "ended", "parts", "MiB", ""):
        table.add_column(column, justify="right" if column in ("parts", "MiB") else "left")
    for row in document.recordings:
        note = "pinned" if row.pinned else "being written" if row.live else ""
        begin = "" if row.begin is None else _local(row.begin)
        size = f"{row.bytes / 2**20:.1f}"
        table.add_row(row.site, row.name, begin, _local(row.end), str(row.parts), size, note)
    Console().print(table)


def run_pin(name: str, minutes: float, site: str, folder: Path | None) -> None:
    """Pin the last minutes of a site, by default of the one that was recorded last."""
    root = folder or recordings_root()
    found = rows(root)
    sites = sorted({row.site for row in found})
    if site and site not in sites:
        known = ", ".join(sites) or "none, as nothing was recorded"
        raise InputError(f'--site "{site}" has no recordings in {root}; allowed are {known}.')
    if not found:
        raise InputError(f"{root}: there are no recordings to pin.")
    site = site or max((row for row in found if not row.pinned), key=lambda row: row.end).site
    print(f"Pinned: {pin(root / site, name, 60.0 * minutes)}")


def rows(root: Path) -> list[RecordingRow]:
    """One row for every recording and pin, the oldest of a site first."""
    if not root.is_dir():
        return []
    found = []
    for site in sorted(entry for entry in root.iterdir() if entry.is_dir()):
        found += [_row(site.name, recording, pinned=False) for recording in recordings_of(site)]
        found += [_row(site.name, pinned, pinned=True) for pinned in pins_of(site)]
    return [row for row in found if row is not None]


def _row(site: str, folder: Path, pinned: bool) -> RecordingRow | None:
    parts = parts_of(folder)
    if not parts:
        return None
    first = contents(parts[0].path)
    return RecordingRow(
        site=site,
        name=folder.name,
        folder=str(folder),
        pinned=pinned,
        live=not pinned and in_use(folder),
        parts=len(parts),
        bytes=sum(part.size for part in parts),
        begin=first.begin / 1e9 if first is not None and first.messages else None,
        end=max(part.end for part in parts),
    )


def _local(seconds: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))
