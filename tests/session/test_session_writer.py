"""What is written comes back bit by bit, also through other people's readers."""

from __future__ import annotations

import contextlib
import json
import resource
from pathlib import Path

import jsonschema
import mcap.records
import numpy as np
import pytest
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from recordings import OFFSET, header, messages, read
from rosbags.highlevel import AnyReader

from backend.errors import InputError
from backend.shell.link.codec import decode
from backend.shell.link.topics import TOPICS
from backend.shell.session.format import CYCLE, MARKER, SCHEMAS, Header, Message, seconds, stamp
from backend.shell.session.mcap_file import McapFile
from backend.shell.session.writer import SessionWriter, schema_of, type_of


def written(path: Path, cycles: int = 100, **changes: object) -> list[Message]:
    writer = SessionWriter(path, header(**changes))
    sent = list(messages(cycles))
    for message in sent:
        writer.write(message)
    writer.close()
    return sent


def test_every_byte_and_nanosecond_comes_back_in_order(tmp_path: Path) -> None:
    sent = written(tmp_path / "a.mcap")
    assert read(tmp_path / "a.mcap") == sent


def test_times_of_the_monotonic_clock_come_back_exactly() -> None:
    rng = np.random.default_rng(1)
    days = rng.choice([1, 40, 100, 1000], 20_000)
    for nanoseconds in (rng.uniform(0, 1, 20_000) * days * 86400e9).astype(int).tolist():
        time = nanoseconds / 1e9  # as time.monotonic() makes it
        assert seconds(stamp(time, OFFSET), OFFSET) == time


def test_metadata_says_what_the_recording_is(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap", part=3, note="größer")
    with (tmp_path / "a.mcap").open("rb") as stream:
        reader = make_reader(stream)
        records = list(reader.iter_metadata())
        assert reader.get_header().profile == "ros2"
    assert [record.name for record in records] == ["cockpit"]
    assert Header.read(records[0].metadata, "a.mcap") == header(part=3, note="größer")


def test_chunks_are_of_64_KiB_and_indexed(tmp_path: Path) -> None:
    sent = written(tmp_path / "a.mcap", 600)
    with (tmp_path / "a.mcap").open("rb") as stream:
        chunks = [r for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk)]
        sizes = [chunk.uncompressed_size for chunk in chunks]
        assert all(64 * 1024 <= size < 66 * 1024 for size in sizes[:-1])
        assert len(sizes) > 3
        assert {chunk.compression for chunk in chunks} == {"zstd"}
        stream.seek(0)
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(sent)
        assert len(summary.chunk_indexes) == len(sizes)
        middle = sent[len(sent) // 2].time
        some = reader.iter_messages(
            topics=["/left/joint_states"], starting_at=middle, ending_before=middle + 10**9
        )
        expected = [
            m for m in sent
            if m.topic == "/left/joint_states" and middle <= m.time < middle + 10**9
        ]  # fmt: skip
        assert [m.data for _, _, m in some] == [m.data for m in expected]
        assert expected


def test_rosbags_decodes_the_machines_messages(tmp_path: Path) -> None:
    sent = written(tmp_path / "a.mcap")
    joints = [m for m in sent if m.topic == "/left/joint_states"]
    with AnyReader([tmp_path / "a.mcap"]) as reader:
        connections = [c for c in reader.connections if c.topic == "/left/joint_states"]
        found = list(reader.messages(connections))
        first = reader.deserialize(found[0][2], found[0][0].msgtype)
        status = next(c for c in reader.connections if c.topic == "/left/status")
        _, _, data = next(reader.messages([status]))
        assert reader.deserialize(data, status.msgtype).mode == "program"
    assert [(t, bytes(d)) for _, t, d in found] == [(m.time, m.data) for m in joints]
    sample = decode("left", "joint_states", joints[0].data, 0.0)
    np.testing.assert_array_equal(first.position, sample.position)


def test_our_own_messages_carry_a_json_schema(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap")
    with (tmp_path / "a.mcap").open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(topics=[CYCLE, MARKER]):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert json.loads(schema.data) == SCHEMAS[channel.topic]
            jsonschema.validate(json.loads(message.data), json.loads(schema.data))


def test_every_recorded_row_has_a_schema() -> None:
    for row in TOPICS:
        if row.recorded and row.of_machine:
            topic = "/plant/one/" + row.template.removeprefix("{machine}/").replace(
                "{link}", "boom"
            )
            assert type_of(topic) == row.type
            name, encoding, text = schema_of(topic, row.type)
            assert (name, encoding) == (row.type, "ros2msg")
            assert b"MSG: std_msgs/Header" in text
    for topic in SCHEMAS:
        assert schema_of(topic, "")[1] == "jsonschema"


def test_mistakes_are_said(tmp_path: Path) -> None:
    writer = SessionWriter(tmp_path / "a.mcap", header())
    with pytest.raises(InputError, match="/left/nonsense"):
        writer.write(Message("/left/nonsense", 1, b""))
    with pytest.raises(InputError, match=r"foo/msg/Bar"):
        writer.write_as(Message("/left/x", 1, b""), "foo/msg/Bar")
    with pytest.raises(InputError, match="created"):
        SessionWriter(tmp_path / "a.mcap", header())  # it exists
    with pytest.raises(InputError, match="created"):
        SessionWriter(tmp_path / "missing" / "a.mcap", header())
    writer.close()
    writer.close()


def write_all(writer: SessionWriter, sent: list[Message]) -> None:
    for message in sent:
        writer.write(message)


def test_a_failed_write_leaves_whole_records_only(tmp_path: Path) -> None:
    """A file size limit of the process stands for a full disk: the same kind of error."""
    path = tmp_path / "a.mcap"
    writer = SessionWriter(path, header())
    sent = list(messages(2000))
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    limit = 60_000
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, old[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_all(writer, sent)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    writer.abandon()
    assert 0 < path.stat().st_size == writer.size <= limit
    count = 0
    with path.open("rb") as stream, contextlib.suppress(EndOfFile):
        for record in StreamReader(stream, validate_crcs=True).records:
            count += isinstance(record, mcap.records.Message)
    assert count == writer.durable + 1 > 0


def test_a_file_is_whole_after_every_chunk(tmp_path: Path) -> None:
    file = McapFile(tmp_path / "a.mcap", "ros2", "test")
    channel = file.channel("/a", "json", 0)
    sizes = []
    for k in range(3):
        file.message(channel, k, k, b"{}")
        file.finish_chunk()
        sizes.append((tmp_path / "a.mcap").stat().st_size)
        assert file.size == sizes[-1]
    assert sizes == sorted(set(sizes))
    file.abandon()
