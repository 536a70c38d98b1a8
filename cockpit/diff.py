"""`cockpit diff`: a session as it was against as this program judges it."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from backend.documents.session import DiffDocument, DiffResult
from backend.shell.session.diff import diff
from cockpit.playback import see


def run_diff(path: Path, site: str | None, as_json: bool) -> None:
    """Print the diff document, or what is in it in words."""
    seen = see(path, site)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("judging anew", total=1.0)
        result = diff(
            seen.session, seen.topics, seen.config, lambda share: bar.update(task, completed=share)
        )
    if as_json:
        document = DiffDocument(state="done", progress=1.0, result=result)
        print(document.model_dump_json(indent=2))
    else:
        for line in lines(result):
            print(line)


def lines(result: DiffResult) -> list[str]:
    """The result in words."""
    found = [f"{result.compared} moments compared."]
    for name, pair in result.distance.pairs.items():
        names = " and ".join(name.split("|"))
        if pair.max_abs is None or pair.rms is None or pair.at is None:
            found.append(f"{names}: no moment in which both distances are known.")
            continue
        most, rms = 1e3 * pair.max_abs, 1e3 * pair.rms
        found.append(
            f"{names}: distances differ by at most {most:.1f} mm (at {pair.at:.2f} s), "
            f"{rms:.1f} mm rms."
        )
    found.append(f"Levels agree in {100.0 * result.levels.agree:.2f} % of all moments.")
    found += [
        f"  {d.start:.2f} to {d.end:.2f} s: {d.machine} was {d.recorded}, now {d.evaluated}."
        for d in result.levels.differences
    ]
    found.append("First warnings, recorded and now:")
    found += [
        f"  {w.machine} {w.name} {w.level}: {_at(w.recorded)}, {_at(w.evaluated)}"
        for w in result.first_warnings
    ]
    return found


def _at(time: float | None) -> str:
    return "never" if time is None else f"{time:.2f} s"
