"""`cockpit track`: recorded detections in, tracks and predictions out."""

from __future__ import annotations

import csv
import sys
from contextlib import nullcontext
from pathlib import Path

from backend.errors import InputError
from backend.tracking.records import Settings
from backend.tracking.table import HEADER, followed, read, rows_of


def run_track(source: Path, out: Path | None, sigma: float, settings: Settings) -> None:
    """Writes CSV to `out`, or prints it. Raises InputError for a file that is no such table."""
    try:
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{source}: cannot be read: {error}; allowed is a CSV file.") from None
    if not 0.0 < sigma < 10.0:
        raise InputError(f"--sigma {sigma}: must be above 0 and below 10 m.")
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
