"""`cockpit recover`: a whole file of what can be read of a damaged recording."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from backend.documents.recordings import RecoverDocument, RecoveredFile, SkippedRow
from backend.errors import InputError
from backend.shell.session.damaged import Saved
from backend.shell.session.recover import recover


def run_recover(path: Path, out: Path | None, as_json: bool) -> None:
    """Recover a file, or all parts of a folder into one file; say what was saved."""
    paths = _files(path)
    target = out or path.with_name(f"{path.stem if path.is_file() else path.name}-recovered.mcap")
    if not target.parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.parent}.")
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"recover {path.name}", total=1.0)
        saved = recover(paths, target, lambda share: bar.update(task, completed=share))
    document = _document(target, saved)
    if as_json:
        print(document.model_dump_json(indent=2))
    else:
        _say(document)


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise InputError(f"{path}: there is no such file or folder.")
    found = sorted(path.glob("*.mcap"))
    # An empty part was cut before its first byte reached the disk.
    paths = [file for file in found if file.stat().st_size > 0] or found
    if not paths:
        raise InputError(f"{path}: there is no .mcap file in this folder.")
    return paths


def _document(out: Path, saved: list[Saved]) -> RecoverDocument:
    full = [one for one in saved if one.messages]
    return RecoverDocument(
        out=str(out),
        files=[_file(one) for one in saved],
        chunks=sum(one.chunks for one in saved),
        messages=sum(one.messages for one in saved),
        seconds=(max(one.end for one in full) - min(one.begin for one in full)) / 1e9,
        bytes=out.stat().st_size,
        skipped_bytes=sum(gap.bytes for one in saved for gap in one.skipped),
    )


def _file(saved: Saved) -> RecoveredFile:
    return RecoveredFile(
        path=str(saved.path),
        bytes=saved.size,
        whole=saved.whole,
        chunks=saved.chunks,
        messages=saved.messages,
        seconds=(saved.end - saved.begin) / 1e9,
        skipped=[SkippedRow(at=gap.at, bytes=gap.bytes, why=gap.why) for gap in saved.skipped],
        unknown=saved.unknown,
    )


def _say(document: RecoverDocument) -> None:
    print(
        f"{document.out}: {document.messages} messages in {document.chunks} chunks, "
        f"{document.seconds:.1f} s, saved; {document.skipped_bytes} bytes skipped."
    )
    for file in document.files:
        if file.whole:
            continue
        if not file.skipped and not file.unknown:
            print(f"{file.path}: was cut between two chunks; nothing was skipped.")
        for gap in file.skipped:
            print(f"{file.path}: {gap.bytes} bytes at {gap.at} skipped: {gap.why}.")
        if file.unknown:
            print(f"{file.path}: {file.unknown} messages skipped: their channel is damaged.")
