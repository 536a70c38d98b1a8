"""One session file: MCAP with compressed chunks, ROS 2 messages in CDR and our own in JSON."""

from __future__ import annotations

import json
from pathlib import Path

from mcap.writer import CompressionType, Writer

from backend.errors import InputError
from backend.shell.link.messages import TYPESTORE
from backend.shell.link.topics import match
from backend.shell.session.format import (
    CHUNK_BYTES,
    METADATA,
    OWN,
    PROFILE,
    SCHEMAS,
    Header,
    Message,
)


class SessionWriter:
    """Writes one file. Raises InputError when it cannot be created."""

    def __init__(self, path: Path, header: Header) -> None:
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror or error}).") from error
        self._writer = Writer(
            self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, use_chunking=True
        )
        self._writer.start(profile=PROFILE, library="excavator-cockpit")
        self._writer.add_metadata(METADATA, header.texts())
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def write(self, message: Message) -> None:
        """Type by the topic. Raises KeyError for a topic that no table knows."""
        self.write_as(message, "" if message.topic in self._channels else _type(message.topic))

    def write_as(self, message: Message, type_name: str) -> None:
        """The same with the ROS 2 type of a topic that no table knows."""
        channel = self._channels.get(message.topic)
        if channel is None:
            channel = self._register(message.topic, type_name)
        self._writer.add_message(
            channel, log_time=message.time, data=message.data, publish_time=message.time
        )

    def close(self) -> None:
        self._writer.finish()
        self._file.close()

    def _register(self, topic: str, type_name: str) -> int:
        own = topic.startswith(OWN)
        if type_name not in self._schemas:
            if own:
                text, encoding = json.dumps(SCHEMAS[topic]), "jsonschema"
            else:
                text = TYPESTORE.generate_msgdef(type_name, ros_version=2)[0]
                encoding = "ros2msg"
            self._schemas[type_name] = self._writer.register_schema(
                type_name, encoding, text.encode()
            )
        channel: int = self._writer.register_channel(
            topic, "json" if own else "cdr", self._schemas[type_name]
        )
        self._channels[topic] = channel
        return channel


def _type(topic: str) -> str:
    if topic.startswith(OWN):
        return str(SCHEMAS[topic]["title"])
    parts = topic.split("/")
    for start in range(2, len(parts)):
        found = match("/".join(parts[start:]))
        if found is not None:
            return found[0].type
    raise KeyError(topic)
