"""The metadata.yaml that makes a folder of parts a bag for `ros2 bag` and rosbags."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from mcap.reader import make_reader

METADATA_FILE = "metadata.yaml"
VERSION = 5  # of the file: ROS 2 Humble's


@dataclass(frozen=True)
class Contents:
    """Of one finished file. begin, end: log times [ns]; counts: type and messages by topic, of
    messages in CDR; messages: all of them.
    """

    begin: int
    end: int
    messages: int
    counts: tuple[tuple[str, str, int], ...]


def contents(path: Path) -> Contents | None:
    """By a file's summary; None when it has none, because it is being written or was cut."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return _contents(path, stat.st_size, stat.st_mtime_ns)


@lru_cache(maxsize=4096)
def _contents(path: Path, size: int, changed: int) -> Contents | None:
    del size, changed  # part of the key
    with contextlib.suppress(Exception), path.open("rb") as stream:  # whatever mcap meets
        summary = make_reader(stream).get_summary()
        if summary is None or summary.statistics is None:
            return None
        statistics = summary.statistics
        counts = []
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            if channel.message_encoding == "cdr" and schema is not None:
                number = statistics.channel_message_counts.get(channel.id, 0)
                counts.append((channel.topic, schema.name, number))
        return Contents(
            statistics.message_start_time,
            statistics.message_end_time,
            statistics.message_count,
            tuple(counts),
        )
    return None


def write_metadata(folder: Path, paths: list[Path]) -> None:
    """Lists those of `paths`, in the folder, that are finished; no file when there are none."""
    found = [(path, contents(path)) for path in paths]
    finished = [(path, part) for path, part in found if part is not None and part.messages]
    target = folder / METADATA_FILE
    if not finished:
        target.unlink(missing_ok=True)
        return
    totals: dict[tuple[str, str], int] = {}
    for _, part in finished:
        for topic, type_name, number in part.counts:
            totals[(topic, type_name)] = totals.get((topic, type_name), 0) + number
    begin, end = min(p.begin for _, p in finished), max(p.end for _, p in finished)
    information: dict[str, Any] = {
        "version": VERSION,
        "storage_identifier": "mcap",
        "relative_file_paths": [path.name for path, _ in finished],
        "duration": {"nanoseconds": end - begin},
        "starting_time": {"nanoseconds_since_epoch": begin},
        "message_count": sum(totals.values()),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic,
                    "type": type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": "",
                },
                "message_count": number,
            }
            for (topic, type_name), number in totals.items()
        ],
        "compression_format": "",
        "compression_mode": "",
        "files": [
            {
                "path": path.name,
                "starting_time": {"nanoseconds_since_epoch": part.begin},
                "duration": {"nanoseconds": part.end - part.begin},
                "message_count": sum(number for _, _, number in part.counts),
            }
            for path, part in finished
        ],
    }
    partial = target.with_suffix(".partial")
    # A day has 1440 parts: the dumper in C, where there is one, takes a tenth of the time.
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text = yaml.dump({"rosbag2_bagfile_information": information}, Dumper=dumper, sort_keys=False)
    partial.write_text(text, encoding="utf-8")
    partial.replace(target)
