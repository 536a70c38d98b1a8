"""The command that plays a recorded session."""

from __future__ import annotations

import contextlib
import gc
import threading
from pathlib import Path

from backend.shell.session.ring import recordings_root
from cockpit.announce import announce
from cockpit.entry import Entry
from cockpit.playback import Options, PlaybackStation, newest, see


def run_play(
    path: Path | None,
    site_name: str | None,
    entry: Entry,
    port: int,
    open_browser: bool,
    source: str | None,
    speed: float,
    begin: float,
    until: threading.Event,
) -> None:
    """A recorded session, until interrupted. path: None for what was recorded last."""
    gc.disable()  # nothing of what is loaded now becomes garbage; `Starting` turns it on again
    seen = see(path or newest(recordings_root()), site_name)
    station = PlaybackStation(seen, Options(entry, port, source, speed, begin))
    with contextlib.closing(station):
        announce(seen.site, entry, station.access, station.web.port, open_browser)
        minutes, seconds = divmod((seen.session.end - seen.session.begin) / 1e9, 60.0)
        print(f"PLAYBACK of {seen.session.path}: {minutes:.0f} min {seconds:.0f} s.", flush=True)
        for problem in station.session()["problems"]:
            print(f"Note: {problem}.", flush=True)
        until.wait()
