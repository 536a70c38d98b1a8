"""One file of a recorded session, written."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

from backend.errors import InputError
from backend.shell.link.topics import match
from backend.shell.link.typestore import TYPESTORE
from backend.shell.session.format import (
    CHUNK_BYTES,
    METADATA,
    OWN,
    PROFILE,
    SCHEMAS,
    Header,
    Message,
)
from backend.shell.session.mcap_file import McapFile

CDR, JSON = "cdr", "json"


class SessionWriter:
    """Creates one MCAP file. Writes raise OSError when the disk refuses: then call `abandon`, or
    `drop_chunk` and, once there is room again, `close`.

    Raises InputError when the file cannot be created. Chunks close by themselves when they are
    full; `flush_chunk` closes one that is not.
    """

    def __init__(self, path: Path, header: Header) -> None:
        self.path = path
        self._channels: dict[str, int] = {}
        self._types: dict[str, str] = {}
        self._schemas: dict[str, int] = {}
        self._sequence = 0
        self._last = -1
        self.durable = -1
        """Sequence number of the last message that the operating system has."""
        try:
            self._file = McapFile(path, PROFILE, f"excavator-cockpit {header.software}")
        except OSError as error:
            raise InputError(f"{path}: cannot be created ({error.strerror}).") from error
        try:
            self._file.metadata(METADATA, header.texts())
        except OSError as error:
            self._file.abandon()
            raise InputError(f"{path}: cannot be written ({error.strerror}).") from error

    def write(self, message: Message) -> None:
        """A message on a topic of the table of topics, or of ours. Others: InputError."""
        known = self._types.get(message.topic)
        self.write_as(message, known or type_of(message.topic))

    def write_as(self, message: Message, type_name: str, sequence: int | None = None) -> None:
        """A message of a ROS 2 type in CDR, or with the empty type name in JSON.

        sequence: the number in the file's own record of the message; by default counted here.
        Raises InputError for types that are not known.
        """
        channel = self._channels.get(message.topic)
        if channel is None:
            channel = self._channel(message.topic, type_name)
        self._last = self._sequence if sequence is None else sequence
        self._sequence = self._last + 1
        number = self._last % 2**32
        self._file.message(channel, message.time, number, message.data)
        if self._file.filled >= CHUNK_BYTES:
            self.flush_chunk()

    def flush_chunk(self) -> None:
        """Close the chunk being filled and hand it to the operating system."""
        self._file.finish_chunk()
        self.durable = self._last

    def close(self) -> None:
        """Finish the file with its summary. Calling again is harmless."""
        self._file.close()
        self.durable = self._last

    def drop_chunk(self) -> None:
        """Forget what was not flushed. After a failed write, `close` may then be tried again."""
        self._file.drop_chunk()
        self._last = self.durable

    def abandon(self) -> None:
        """Close the file as it is, after a failed write; what was flushed stays readable."""
        self._file.abandon()

    @property
    def size(self) -> int:
        """Of the file so far [bytes]."""
        return self._file.size

    @property
    def pending(self) -> int:
        """Bytes in the chunk being filled."""
        return self._file.filled

    @property
    def span(self) -> tuple[int, int]:
        """First and last log time in finished chunks [ns]; zeros while there are none."""
        return self._file.begin, self._file.end

    def counts(self) -> dict[str, tuple[str, int]]:
        """Type name and number of messages in finished chunks, by topic."""
        counts = self._file.counts
        return {
            topic: (self._types[topic], counts.get(channel, 0))
            for topic, channel in self._channels.items()
        }

    def _channel(self, topic: str, type_name: str) -> int:
        schema = self._schemas.get(type_name or topic)
        if schema is None:
            schema = self._file.schema(*schema_of(topic, type_name))
            self._schemas[type_name or topic] = schema
        channel = self._file.channel(topic, CDR if type_name else JSON, schema)
        self._channels[topic] = channel
        self._types[topic] = type_name
        return channel


def type_of(topic: str) -> str:
    """ROS 2 type of a recorded topic; empty for ours in JSON. Raises InputError for others."""
    if topic in SCHEMAS:
        return ""
    segments = topic.removeprefix("/").split("/")
    for k in range(1, len(segments)):  # a machine's prefix may have several segments
        found = match("/".join(segments[k:]))
        if found is not None:
            return found[0].type
    raise InputError(f"{topic}: no topic of the table of topics ends so; its type is not known.")


@cache
def schema_of(topic: str, type_name: str) -> tuple[str, str, bytes]:
    """Name, encoding and text of a topic's schema. Raises InputError for unknown types."""
    if not type_name:
        if topic not in SCHEMAS:
            raise InputError(f"{topic}: is none of {OWN}'s topics; allowed are {list(SCHEMAS)}.")
        schema = SCHEMAS[topic]
        return f"cockpit.{schema['title']}", "jsonschema", json.dumps(schema).encode()
    try:
        text, _ = TYPESTORE.generate_msgdef(type_name, ros_version=2)
    except Exception as error:  # rosbags raises what its parser happens to meet
        raise InputError(f"{topic}: the type {type_name!r} is not known ({error}).") from error
    return type_name, "ros2msg", text.encode()
