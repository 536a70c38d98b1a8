"""`cockpit convert`: another program's recording to a session."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from backend.documents.conversion import ConversionDocument, ProblemModel
from backend.shell.session.convert import Conversion, convert
from backend.site.site import load_site


def run_convert(
    recording: Path,
    site_name: str,
    out: Path,
    dbc: Path | None,
    can_map: Path | None,
    as_json: bool,
) -> None:
    """Prints what came out. Raises InputError for what cannot be read."""
    site = load_site(site_name)
    console = Console(stderr=True)
    silent = as_json or not console.is_terminal
    with Progress(console=console, transient=True, disable=silent) as bar:
        task = bar.add_task(f"reading {recording.name}", total=1.0)
        done = convert(
            recording, site, out, lambda part: bar.update(task, completed=part), dbc, can_map
        )
    document = conversion_document(done)
    print(document.model_dump_json(indent=2) if as_json else _words(document))


def conversion_document(done: Conversion) -> ConversionDocument:
    return ConversionDocument(
        recording=str(done.path),
        out=str(done.out),
        origin=done.origin,
        note=done.note,
        messages=done.messages,
        topics=done.counts,
        begin=done.begin / 1e9,
        end=done.end / 1e9,
        duration=(done.end - done.begin) / 1e9,
        problems=[ProblemModel(where=p.where, text=p.text, count=p.count) for p in done.problems],
        skipped=done.skipped,
    )


def _words(document: ConversionDocument) -> str:
    lines = [f"{document.out}: {document.messages} messages, {document.duration:.3f} s"]
    lines += [f"  {count:9}  {topic}" for topic, count in sorted(document.topics.items())]
    if document.note:
        lines.append(f"note: {document.note}")
    for problem in document.problems:
        times = f" ({problem.count} times)" if problem.count > 1 else ""
        where = f"{problem.where}: " if problem.where else ""
        lines.append(f"problem: {where}{problem.text}{times}")
    if document.skipped:
        shown = ", ".join(f"{name}: {count}" for name, count in document.skipped.items())
        lines.append(f"not of this site: {shown}")
    return "\n".join(lines)
