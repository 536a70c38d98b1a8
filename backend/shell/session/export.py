"""A session as tables (CSV, Parquet) or as a plain ROS 2 recording."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from backend.errors import InputError
from backend.shell.link.typestore import TYPESTORE
from backend.shell.session.export_rows import TABLES, Rows
from backend.shell.session.format import SNAPSHOT
from backend.shell.session.reader import Session
from backend.shell.session.source import Progress

FORMATS = ("csv", "parquet", "ros2")
_BATCH = 20_000  # rows written together


@dataclass(frozen=True)
class Exported:
    """out: the folder; counts: rows by file, or messages by topic; notes: in words."""

    out: Path
    counts: dict[str, int]
    notes: tuple[str, ...]


def recorded_documents(
    session: Session, progress: Progress | None = None
) -> Iterator[tuple[int, dict[str, Any]]]:
    """(log time [ns], snapshot document) of every recorded snapshot that can be read."""
    span = max(session.end - session.begin, 1)
    for count, message in enumerate(session.messages(topics=[SNAPSHOT])):
        try:
            document = json.loads(message.data)
        except ValueError:
            session.note("recorded snapshots that are not JSON are left out")
            continue
        if isinstance(document, dict):
            yield message.time, document
        if progress and count % 100 == 0:
            progress((message.time - session.begin) / span)


def export_tables(
    session: Session,
    documents: Iterable[tuple[int, Mapping[str, Any]]],
    kind: str,
    out: Path,
    about: Mapping[str, str],
) -> Exported:
    """Writes poses, clearances and alarms as files of `kind` ("csv", "parquet") to a new folder.

    about: what the session is, kept in the metadata of Parquet files. Raises InputError.
    """
    with _Folder(out) as folder:
        tables = {name: _Table(folder, name, kind, about) for name in TABLES}
        rows = Rows(session.begin, session.offset)
        read = skipped = 0
        try:
            for time, document in documents:
                try:
                    found = list(rows.of(document, time))
                except (KeyError, TypeError, ValueError, AttributeError):
                    skipped += 1
                    continue
                read += 1
                for name, row in found:
                    tables[name].add(row)
            for name, row in rows.rest():
                tables[name].add(row)
        finally:
            for table in tables.values():
                table.close()
        if not read:
            raise InputError(
                f"{session.path}: has no snapshots that this program can read; allowed is "
                "--source evaluated."
            )
    if skipped:
        session.note(f"{skipped} recorded snapshots are not this program's and left out")
    return Exported(out, {t.path.name: t.rows for t in tables.values()}, session.notes)


def export_bag(session: Session, out: Path, progress: Progress | None = None) -> Exported:
    """Writes the session's ROS 2 messages, and nothing of ours, as a rosbag2 folder with MCAP.

    Raises InputError when there are none.
    """
    topics = {name: info.type for name, info in session.topics.items() if info.encoding == "cdr"}
    known = {name: kind for name, kind in topics.items() if kind in TYPESTORE.fielddefs}
    notes = [
        f"{name} is left out: its type {kind} is not known here"
        for name, kind in topics.items()
        if name not in known
    ]
    if not known:
        raise InputError(f"{session.path}: has no ROS 2 messages; there is nothing to export.")
    span = max(session.end - session.begin, 1)
    counts = dict.fromkeys(known, 0)
    with _Folder(out) as folder:
        folder.rmdir()
        writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            connections = {
                name: writer.add_connection(name, kind, typestore=TYPESTORE)
                for name, kind in known.items()
            }
            for count, message in enumerate(session.messages(topics=known)):
                writer.write(connections[message.topic], message.time, message.data)
                counts[message.topic] += 1
                if progress and count % 1000 == 0:
                    progress((message.time - session.begin) / span)
    return Exported(out, counts, (*notes, *session.notes))


class _Folder:
    """A new folder that is there when all went well, and not at all otherwise."""

    def __init__(self, out: Path) -> None:
        if out.exists():
            raise InputError(f"{out}: exists already; allowed is a new folder.")
        self._out = out
        self._above = out.with_name(f".{out.name}.part")
        self._partial = self._above / out.name  # rosbags names its file after the folder

    def __enter__(self) -> Path:
        try:
            shutil.rmtree(self._above, ignore_errors=True)
            self._partial.mkdir(parents=True)
        except OSError as error:
            raise InputError(f"{self._out}: cannot be written ({error.strerror}).") from error
        return self._partial

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if error is None:
            os.replace(self._partial, self._out)
        shutil.rmtree(self._above, ignore_errors=True)
        if isinstance(error, OSError):
            reason = error.strerror or error
            raise InputError(f"{self._out}: cannot be written ({reason}).") from error


class _FileWriter(Protocol):
    def write_table(self, table: Any) -> None: ...
    def close(self) -> None: ...


class _Table:
    """One file, filled in batches."""

    def __init__(self, folder: Path, name: str, kind: str, about: Mapping[str, str]) -> None:
        self.path = folder / f"{name}.{kind}"
        self.rows = 0
        self._waiting: list[dict[str, Any]] = []
        fields = [
            pa.field(column, type_, metadata={"unit": unit, "description": what})
            for column, (type_, unit, what) in TABLES[name].items()
        ]
        self._schema = pa.schema(fields, metadata=dict(about))
        self._writer: _FileWriter
        if kind == "csv":
            self._writer = pyarrow.csv.CSVWriter(self.path, self._schema)
        else:
            self._writer = pyarrow.parquet.ParquetWriter(
                self.path, self._schema, compression="zstd"
            )

    def add(self, row: dict[str, Any]) -> None:
        self._waiting.append(row)
        self.rows += 1
        if len(self._waiting) >= _BATCH:
            self._flush()

    def close(self) -> None:
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        if self._waiting:
            self._writer.write_table(pa.Table.from_pylist(self._waiting, schema=self._schema))
            self._waiting = []
