"""`cockpit export`: a session as tables or as a plain ROS 2 recording."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from backend.documents.conversion import ExportDocument
from backend.documents.snapshot import snapshot_document
from backend.errors import InputError
from backend.shell.session.cycles import Topics
from backend.shell.session.evaluate import evaluate
from backend.shell.session.export import FORMATS, export_bag, export_tables, recorded_documents
from backend.shell.session.format import SNAPSHOT
from backend.shell.session.reader import Session, open_session
from backend.site.site import Site, load_site
from cockpit.desk import load_models, make_config
from cockpit.playback import recorded_site

SOURCES = ("recorded", "evaluated")


def run_export(
    path: Path, kind: str, out: Path, site_name: str | None, source: str, as_json: bool
) -> None:
    """Prints what was written. Raises InputError."""
    if kind not in FORMATS:
        raise InputError(f'--format "{kind}" is unknown; allowed are {", ".join(FORMATS)}.')
    if source and source not in SOURCES:
        raise InputError(f'--source "{source}" is unknown; allowed are {", ".join(SOURCES)}.')
    console = Console(stderr=True)
    silent = as_json or not console.is_terminal
    with Progress(console=console, transient=True, disable=silent) as bar:
        task = bar.add_task(f"reading {path.name}", total=1.0)
        document = export(
            path, kind, out, site_name, source, lambda part: bar.update(task, completed=part)
        )
    print(document.model_dump_json(indent=2) if as_json else _words(document))


def export(
    path: Path,
    kind: str,
    out: Path,
    site_name: str | None = None,
    source: str = "",
    progress: Callable[[float], None] | None = None,
) -> ExportDocument:
    """Writes the folder `out`. source: of the tables; default "recorded" where snapshots were
    recorded, else "evaluated", by today's pipeline. Raises InputError.
    """
    session = open_session(path)
    if kind == "ros2":
        done = export_bag(session, out, progress)
        used = "recorded"
    else:
        used = source or ("recorded" if SNAPSHOT in session.topics else "evaluated")
        site = load_site(site_name) if site_name else recorded_site(session)
        if used == "recorded":
            if SNAPSHOT not in session.topics:
                raise InputError(
                    f"{path}: no snapshots were recorded; allowed is --source evaluated."
                )
            documents: Iterator[tuple[int, dict[str, Any]]] = recorded_documents(session, progress)
        else:
            documents = _evaluated(session, site, progress)
        done = export_tables(session, documents, kind, out, _about(session, site, used))
    if progress:
        progress(1.0)
    return ExportDocument(
        session=str(path),
        out=str(out),
        format=kind,
        source=used,
        counts=done.counts,
        notes=list(done.notes),
    )


def export_zip(path: Path, kind: str, out: Path, site_name: str | None, source: str) -> Path:
    """The same as one .zip file in the folder `out`, for a browser. Raises InputError."""
    folder = out / f"{path.stem}-{kind}"
    export(path, kind, folder, site_name, source)
    archive = shutil.make_archive(str(folder), "zip", root_dir=out, base_dir=folder.name)
    shutil.rmtree(folder)
    return Path(archive)


def _evaluated(
    session: Session, site: Site, progress: Callable[[float], None] | None
) -> Iterator[tuple[int, dict[str, Any]]]:
    own = tuple(machine.name for machine in site.machines)
    config = make_config(site, load_models(site), own, "PLAYBACK")
    for portion, snapshot in evaluate(session, Topics.of(site, session), config, progress=progress):
        yield portion.time, snapshot_document(snapshot, config)


def _about(session: Session, site: Site, source: str) -> dict[str, str]:
    header = session.headers[0] if session.headers else None
    return {
        "session": session.title,
        "site": site.name,
        "crs": f"EPSG:{site.frame.epsg}",
        "source": source,
        "origin": header.origin if header else "another program's recording",
        "note": header.note if header else "",
    }


def _words(document: ExportDocument) -> str:
    lines = [f"{document.out}: {document.format}, {document.source}"]
    lines += [f"  {count:9}  {name}" for name, count in document.counts.items()]
    lines += [f"note: {note}" for note in document.notes]
    return "\n".join(lines)
