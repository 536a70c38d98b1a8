"""The recorder of one running cockpit, by its site file and options."""

from __future__ import annotations

import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from backend.pipeline.config import Config
from backend.shell.app.recording import RecordingSources
from backend.shell.session.format import Header
from backend.shell.session.keeper import Plan
from backend.shell.session.recorder import NoRecorder, Recorder
from backend.shell.session.ring import Limits, parts_of, recordings_of, recordings_root
from backend.site.site import Site
from cockpit.options import Options


def site_folder(site: Site, folder: Path | None = None) -> Path:
    """Where a site's recordings are. folder: of all recordings, instead of the site file's."""
    root = folder or recordings_root(site.recording.folder, site.folder)
    return root.expanduser().absolute() / site.name


def make_recorder(site: Site, config: Config, options: Options) -> Recorder | NoRecorder:
    """Not started yet. `--record` overrides a site file that records nothing."""
    if not options.recording:
        return NoRecorder("started with --no-record")
    if not site.recording.enabled and options.record is None:
        return NoRecorder("the site file says recording.enabled = false")
    folder = site_folder(site, options.record)
    table = site.recording
    limits = Limits(max_bytes=int(table.max_gib * 2**30), max_age=table.max_hours * 3600.0)
    header = Header(
        offset=time.time_ns() - time.monotonic_ns(),
        recording=_name(folder),
        part=0,
        site_file=str(site.path),
        site=site.path.read_text(encoding="utf-8"),
        own=",".join(config.own),
        origin=options.mode.lower(),
        software=_version(),
    )
    return Recorder(Plan(folder, header, limits), site.safety.stop_below)


def recording_sources(
    recorder: Recorder | NoRecorder, site: Site, options: Options
) -> RecordingSources:
    """What the API asks of a recorder."""

    def status() -> dict[str, Any]:
        found = {**vars(recorder.state()), "folder": None, "bytes": 0, "parts": 0, "oldest": None}
        if isinstance(recorder, Recorder):
            folder = recorder.plan.site_folder
            parts = [part for recording in recordings_of(folder) for part in parts_of(recording)]
            found["folder"] = str(folder)
            found["bytes"] = sum(part.size for part in parts)
            found["parts"] = len(parts)
            found["oldest"] = min((part.end for part in parts), default=None)
        return found

    return RecordingSources(
        status=status,
        pin=lambda name, seconds: recorder.pin(name.strip() or pin_name(), seconds),
        mark=lambda text: recorder.mark("note", text),
    )


def pin_name() -> str:
    """By the time."""
    return f"pin-{_now()}"


def _now() -> str:
    return time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())


def _name(folder: Path) -> str:
    """Of a recording that begins now, and that no other has."""
    base, k = _now(), 1
    name = base
    while (folder / name).exists():
        k += 1
        name = f"{base}-{k}"
    return name


def _version() -> str:
    try:
        return version("excavator-cockpit")
    except PackageNotFoundError:  # run from a working copy
        return "0"
