"""`cockpit report`: the report of a recorded session."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from backend.errors import InputError
from backend.pipeline.records import Snapshot
from backend.shell.session.diff import diff
from backend.shell.session.evaluate import evaluate
from backend.shell.session.events import event_document
from backend.shell.session.index import known_of
from backend.shell.session.series import series_document
from backend.shell.session.tracks import recorded, sources
from cockpit.playback import Seen, see
from cockpit.report.page import report_html
from cockpit.session_document import session_document
from cockpit.views.inputs import scene_site

PERIOD = 0.1  # between two moments that figures and the 3D replay are made of [s]
MOST = 36_000  # moments; a longer session's are further apart
POINTS = 2000  # of each plot


def run_report(path: Path, out: Path, site: str | None, source: str, with_diff: bool) -> None:
    """Writes one HTML file and prints its name. Raises InputError."""
    seen = see(path, site)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("report", total=1.0)
        html = make_report(seen, source, with_diff, lambda part: bar.update(task, completed=part))
    try:
        out.write_text(html, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out: {out} cannot be written: {error.strerror}.") from error
    print(out)


def make_report(
    seen: Seen, source: str, with_diff: bool, progress: Callable[[float], None] = lambda _: None
) -> str:
    """HTML. source: "recorded" or "evaluated", empty for the first there is; with_diff: also what
    this program concludes otherwise than was recorded, where both are known.
    """
    session, topics, config = seen.session, seen.topics, seen.config
    there = sources(session, topics)
    if not there:
        raise InputError(f"{session.path}: holds neither snapshots nor poses to report on.")
    chosen = source or there[0]
    if chosen not in there:
        raise InputError(f'{session.path}: has no "{chosen}"; allowed are {", ".join(there)}.')
    known = known_of(chosen, session, topics, config)
    progress(0.3)
    moments = list(_moments(seen, chosen))
    progress(0.6)
    difference = None
    if with_diff and len(there) > 1:
        difference = diff(session, topics, config).model_dump()
    progress(0.8)
    duration = (session.end - session.begin) / 1e9
    events = [event_document(event, session.begin) for event in known.events]
    document = session_document(seen, there, {"state": "ready", "progress": 1.0}, events)
    document["problems"] = list(dict.fromkeys([*document["problems"], *known.problems]))
    return report_html(
        document,
        series_document(known.series, session.begin, 0.0, duration, POINTS),
        moments,
        config,
        scene_site(seen.site, dict(config.machines)),
        difference,
    )


def _moments(seen: Seen, source: str) -> Iterator[tuple[float, Snapshot]]:
    """(time since begin [s], snapshot), PERIOD apart or more."""
    session = seen.session
    duration = (session.end - session.begin) / 1e9
    period = max(PERIOD, duration / MOST)
    if source == "recorded":
        found = recorded(session, seen.config)
    else:
        judged = evaluate(session, seen.topics, seen.config, every=5)
        found = ((portion.time, snapshot) for portion, snapshot in judged)
    due = float("-inf")
    for time, snapshot in found:
        t = (time - session.begin) / 1e9
        if t >= due - 1e-6:
            due = t + period
            yield t, snapshot
