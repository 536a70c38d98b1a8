"""A whole file of what can be read of damaged ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from backend.errors import InputError
from backend.shell.session.damaged import Damaged, Read, Saved
from backend.shell.session.format import CHUNK_BYTES
from backend.shell.session.mcap_file import McapFile


class NothingSaved(InputError):  # noqa: N818 - a fact about a file
    """The files are of the right kind, but hold no whole chunk."""


def recover(
    paths: list[Path], out: Path, progress: Callable[[float], None] = lambda _: None
) -> list[Saved]:
    """Writes all that can be read of `paths`, in this order, into one whole new file `out`.

    Raises InputError when a file is of another kind and when `out` exists or cannot be written;
    NothingSaved when there is nothing to be saved. The originals stay as they are.
    """
    if out.exists():
        raise InputError(f"{out}: exists already; allowed is the name of a new file.")
    partial = out.with_name(out.name + ".partial")
    partial.unlink(missing_ok=True)
    results: list[Saved] = []
    copy: _Copy | None = None
    try:
        for k, path in enumerate(paths):
            damaged = Damaged(path)
            share = _part_of(progress, k, len(paths))
            try:
                for read in damaged.messages(share):
                    copy = copy or _Copy(partial, damaged)
                    copy.add(read)
            finally:
                damaged.close()
            results.append(damaged.saved)
        if copy is None:
            names = ", ".join(str(path) for path in paths)
            raise NothingSaved(f"{names}: holds no whole chunk of messages; nothing can be saved.")
        copy.file.close()
        partial.rename(out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}).") from error
    finally:
        if copy is not None:
            copy.file.abandon()
        partial.unlink(missing_ok=True)
    return results


def _part_of(progress: Callable[[float], None], k: int, n: int) -> Callable[[float], None]:
    """Progress of the whole from that of its k-th part of n."""
    return lambda share: progress((k + share) / n)


class _Copy:
    """The new file. Channels of several files are one when topic, encoding and schema agree."""

    def __init__(self, path: Path, first: Damaged) -> None:
        self.file = McapFile(path, first.profile, "excavator-cockpit recover")
        for name, texts in first.metadata.items():
            self.file.metadata(name, texts)
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}

    def add(self, read: Read) -> None:
        schema = 0
        if read.schema is not None:
            parts = (read.schema.name, read.schema.encoding, bytes(read.schema.data))
            if parts not in self._schemas:
                self._schemas[parts] = self.file.schema(*parts)
            schema = self._schemas[parts]
        key = (read.channel.topic, read.channel.message_encoding, schema)
        if key not in self._channels:
            self._channels[key] = self.file.channel(*key)
        message = read.message
        self.file.message(self._channels[key], message.log_time, message.sequence, message.data)
        if self.file.filled >= CHUNK_BYTES:
            self.file.finish_chunk()
