"""Files that the page of a playback asks for, made by processes of their own."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from backend.errors import InputError

LONGEST = 3600.0  # that a report or an export may take [s]


def session_file(session: Path, site: str | None, kind: str) -> Path:
    """The report ("report") or an export ("csv", "parquet", "ros2") of a session, in a temporary
    folder that the caller removes. Raises InputError with what went wrong, unknown kinds included.
    """
    folder = Path(tempfile.mkdtemp(prefix="cockpit-"))
    try:
        where = ["--site", site] if site else []
        if kind == "report":
            out = folder / f"{session.stem}.html"
            _run(["report", str(session), "--out", str(out), *where])
            return out
        tables = folder / f"{session.stem}-{kind}"
        _run(["export", str(session), "--format", kind, "--out", str(tables), *where])
        return Path(shutil.make_archive(str(tables), "zip", folder, tables.name))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _run(arguments: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "cockpit.cli", *arguments],
        capture_output=True,
        text=True,
        timeout=LONGEST,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise InputError(said[-1].removeprefix("cockpit: ") if said else f"{arguments[0]} failed.")
