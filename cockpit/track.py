"""`cockpit track`: recorded detections in, tracks and predictions out."""

from __future__ import annotations

import csv
import sys
from contextlib import nullcontext
from pathlib import Path

from backend.errors import InputError
from backend.tracking.kitti import read_kitti
from backend.tracking.records import Settings
from backend.tracking.table import HEADER, followed, read, rows_of


def run_track(
    source: Path,
    out: Path | None,
    sigma: float,
    settings: Settings,
    kitti: bool = False,
    period: float = 0.1,
) -> None:
    """Writes CSV to `out`, or prints it. Raises InputError for a file that is no such table.

    kitti: whether the file has KITTI tracking labels, `period` [s] from frame to frame; as has
    every file whose name ends with .txt.
    """
    try:
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"{source}: cannot be read: {error}; allowed is a CSV or KITTI file."
        ) from None
    if not 0.0 < sigma < 10.0:
        raise InputError(f"--sigma {sigma}: must be above 0 and below 10 m.")
    if not 0.0 < period < 1e6:
        raise InputError(f"--period {period}: must be above 0 and below 1000000 s.")
    if kitti or source.suffix == ".txt":
        scans = read_kitti(text, str(source), period, sigma)
    else:
        scans = read(text, str(source), sigma)
    try:
        opened = (
            nullcontext(sys.stdout) if out is None else out.open("w", encoding="utf-8", newline="")
        )
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {error}.") from None
    with opened as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for tracks in followed(scans, settings):
            writer.writerows(rows_of(tracks))
