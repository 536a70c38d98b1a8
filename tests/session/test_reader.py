"""Sessions opened: whole, in parts, cut off, damaged, foreign, with clocks that jump."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from recordings import header, messages

from backend.errors import InputError
from backend.shell.session.format import CYCLE, MARKER, Message
from backend.shell.session.reader import open_session
from backend.shell.session.writer import SessionWriter

SECOND = 1_000_000_000
BEGIN = 1_790_000_000 * SECOND


def write(path: Path, found: list[Message], part: int = 0) -> Path:
    writer = SessionWriter(path, header(part))
    for message in found:
        writer.write(message)
    writer.close()
    return path


def foreign(
    path: Path,
    entries: list[tuple[str, int]],
    chunk: int = 1024,
    finish: bool = True,
    **options: object,
) -> Path:
    """A file by mcap's own writer. entries: (topic, time [ns] after BEGIN)."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=chunk, **options)  # type: ignore[arg-type]
        writer.start("ros2", "elsewhere")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channels: dict[str, int] = {}
        for k, (topic, time) in enumerate(entries):
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = k.to_bytes(4, "little") * 16
            writer.add_message(channels[topic], BEGIN + time, data, BEGIN + time)
        if finish:
            writer.finish()
    return path


def number(message: Message) -> int:
    return int.from_bytes(message.data[:4], "little")


def test_a_session_gives_back_what_was_written_in_its_order(tmp_path: Path) -> None:
    written = list(messages(400))
    session = open_session(write(tmp_path / "a.mcap", written))
    assert list(session.messages()) == written
    assert session.notes == ()
    assert session.headers == (header(),)
    assert session.offset == header().offset
    assert session.begin == min(m.time for m in written)
    assert session.end == max(m.time for m in written)
    joints = session.topics["/left/joint_states"]
    assert (joints.type, joints.encoding, joints.count) == (
        "sensor_msgs/msg/JointState",
        "cdr",
        400,
    )
    assert session.topics[CYCLE].encoding == "json"


def test_any_window_and_any_topics_are_just_those(tmp_path: Path) -> None:
    written = list(messages(1500))
    session = open_session(write(tmp_path / "a.mcap", written))
    rng = np.random.default_rng(0)
    for _ in range(30):
        start, end = sorted(int(t) for t in rng.integers(session.begin, session.end, 2))
        topics = ["/left/gnss/fix", MARKER] if rng.random() < 0.5 else None
        expected = [
            m for m in written if start <= m.time <= end and (topics is None or m.topic in topics)
        ]
        assert list(session.messages(start, end, topics)) == expected


def test_parts_follow_each_other_and_a_missing_one_is_told(tmp_path: Path) -> None:
    written = list(messages(300))
    third = len(written) // 3
    for part, name in ((0, "part-0000"), (1, "part-0001"), (2, "part-0010")):
        write(tmp_path / f"{name}.mcap", written[part * third : (part + 1) * third], part)
    session = open_session(tmp_path)
    assert list(session.messages()) == written[: 3 * third]
    assert len(session.parts) == 3
    assert session.notes == ()
    (tmp_path / "part-0001.mcap").unlink()
    session = open_session(tmp_path)
    assert "parts 1 are missing" in " ".join(session.notes)
    assert len(session.gaps) == 1


def test_a_file_cut_at_any_byte_shows_all_whole_chunks_and_says_so(tmp_path: Path) -> None:
    written = list(messages(2500))
    whole = write(tmp_path / "whole.mcap", written)
    data = whole.read_bytes()
    with whole.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    ends = [c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes]
    assert len(ends) >= 4, "the test needs several chunks"
    cut = tmp_path / "cut.mcap"
    rng = np.random.default_rng(1)
    places = [*rng.integers(8, len(data), 25), ends[1] - 1, ends[1], ends[1] + 1, len(data) - 1]
    for place in sorted(int(p) for p in places):
        cut.write_bytes(data[:place])
        chunks = sum(end <= place for end in ends)
        if chunks == 0:
            with pytest.raises(InputError, match="no complete message"):
                open_session(cut)
            continue
        session = open_session(cut)
        found = list(session.messages())
        assert found == written[: len(found)]
        last = summary.chunk_indexes[chunks - 1]
        assert found[-1].time <= last.message_end_time
        assert sum(t.count for t in session.topics.values()) == len(found)
        if chunks == len(ends):
            assert found == written
        else:
            assert any("end is missing" in note for note in session.notes)


def test_a_damaged_chunk_is_left_out_and_told(tmp_path: Path) -> None:
    written = list(messages(2500))
    path = write(tmp_path / "a.mcap", written)
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    hurt = summary.chunk_indexes[2]
    data = bytearray(path.read_bytes())
    middle = hurt.chunk_start_offset + hurt.chunk_length // 2
    data[middle : middle + 8] = b"\xff" * 8
    path.write_bytes(bytes(data))
    session = open_session(path)
    found = list(session.messages())
    assert 0 < len(written) - len(found) < len(written) / 3
    assert any("damaged and left out" in note for note in session.notes)
    # Without the summary, too, the rest is found.
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(bytes(data[:-100]))
    assert list(open_session(cut).messages()) == found


def test_what_is_no_session_is_one_sentence(tmp_path: Path) -> None:
    def refusal(path: Path) -> str:
        with pytest.raises(InputError) as caught:
            open_session(path)
        text = str(caught.value)
        assert text.startswith(str(tmp_path))
        assert text.endswith(".")
        assert "\n" not in text
        return text

    empty = tmp_path / "empty.mcap"
    empty.write_bytes(b"")
    assert "is empty" in refusal(empty)
    text = tmp_path / "text.mcap"
    text.write_text("not a recording at all")
    assert "not an MCAP file" in refusal(text)
    newer = tmp_path / "newer.mcap"
    newer.write_bytes(b"\x89MCAP9\r\n" + bytes(100))
    assert "version 9" in refusal(newer)
    magic = tmp_path / "magic.mcap"
    magic.write_bytes(b"\x89MCAP0\r\n")
    assert "no complete message" in refusal(magic)
    assert "no such file" in refusal(tmp_path / "absent.mcap")
    folder = tmp_path / "folder"
    folder.mkdir()
    assert "holds no .mcap file" in refusal(folder)
    writer = SessionWriter(tmp_path / "future.mcap", header(format=99))
    for message in messages(3):
        writer.write(message)
    writer.close()
    assert "newer cockpit" in refusal(tmp_path / "future.mcap")


def test_one_bad_part_among_good_ones_is_a_note(tmp_path: Path) -> None:
    written = list(messages(100))
    write(tmp_path / "part-0000.mcap", written)
    (tmp_path / "part-0001.mcap").write_bytes(b"")
    session = open_session(tmp_path)
    assert list(session.messages()) == written
    assert any("part-0001.mcap: is empty" in note for note in session.notes)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"use_statistics": False, "use_summary_offsets": False},
        {"finish": False},
    ],
    ids=["plain", "uncompressed", "unchunked", "not repeated", "no statistics", "unfinished"],
)
def test_files_of_others_are_read_however_they_were_written(
    tmp_path: Path, options: dict[str, object]
) -> None:
    entries = [(f"/{name}/joint_states", k * 5_000_000) for k in range(500) for name in "ab"]
    session = open_session(foreign(tmp_path / "f.mcap", entries, **options))  # type: ignore[arg-type]
    found = list(session.messages())
    assert [number(m) for m in found] == list(range(len(found)))
    assert len(found) == len(entries) or ("finish" in options and len(found) > 900)
    assert session.topics["/a/joint_states"].type == "std_msgs/msg/String"
    assert session.headers == ()
    assert session.offset == session.begin
    if "finish" not in options:
        assert session.topics["/a/joint_states"].count == 500
        assert session.notes == ()


@pytest.mark.parametrize("chunk", [256, 1 << 20], ids=["many chunks", "one chunk"])
def test_a_clock_that_jumps_back_keeps_the_order_and_time_goes_on(
    tmp_path: Path, chunk: int
) -> None:
    times = [k * 10_000_000 for k in range(500)]
    times += [t - 3_600 * SECOND for t in times]
    entries = [("/a/joint_states", t) for t in times]
    session = open_session(foreign(tmp_path / "f.mcap", entries, chunk=chunk))
    found = list(session.messages())
    assert [number(m) for m in found] == list(range(1000))
    assert all(b.time >= a.time for a, b in pairwise(found))
    assert session.end - session.begin == pytest.approx(10 * SECOND, abs=0.2 * SECOND)
    assert any("clock jumps back" in note for note in session.notes)
    later = list(session.messages(start=session.begin + 6 * SECOND))
    assert later == [m for m in found if m.time >= session.begin + 6 * SECOND]


def test_a_clock_that_jumps_back_between_parts(tmp_path: Path) -> None:
    written = list(messages(200))
    earlier = [Message(m.topic, m.time - 100 * SECOND, m.data) for m in written]
    write(tmp_path / "part-0000.mcap", written, 0)
    write(tmp_path / "part-0001.mcap", earlier, 1)
    session = open_session(tmp_path)
    found = list(session.messages())
    assert [m.data for m in found] == [m.data for m in written + earlier]
    assert found[len(written)].time >= written[-1].time - SECOND
    assert any("clock jumps back" in note for note in session.notes)


@pytest.mark.parametrize("chunk", [256, 1 << 20], ids=["many chunks", "one chunk"])
def test_topics_written_one_after_the_other_are_sorted(tmp_path: Path, chunk: int) -> None:
    entries = [(topic, k * 10_000_000) for topic in ("/a/joint_states", "/b/x") for k in range(500)]
    session = open_session(foreign(tmp_path / "f.mcap", entries, chunk=chunk))
    found = list(session.messages())
    assert len(found) == 1000
    assert [m.time for m in found] == sorted(m.time for m in found)
    assert session.end - session.begin == 4_990_000_000
    assert any("sorted" in note for note in session.notes)
    window = (session.begin + SECOND, session.begin + 2 * SECOND)
    assert list(session.messages(*window)) == [m for m in found if window[0] <= m.time <= window[1]]


def test_two_senders_on_one_topic_are_told(tmp_path: Path) -> None:
    path = tmp_path / "f.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "elsewhere")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        for sender in range(2):
            channel = writer.register_channel("/left/joint_states", "cdr", schema)
            writer.add_message(channel, BEGIN + sender, b"\0" * 8, BEGIN + sender)
        writer.finish()
    assert any("two machines with one name" in note for note in open_session(path).notes)


def test_garbage_after_the_magic_never_raises_anything_else(tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.mcap", list(messages(300))).read_bytes()
    rng = np.random.default_rng(3)
    path = tmp_path / "hurt.mcap"
    opened = 0
    for _ in range(150):
        data = bytearray(whole)
        for place in rng.integers(8, len(data), int(rng.integers(1, 12))):
            data[int(place)] = int(rng.integers(256))
        if rng.random() < 0.3:
            at = int(rng.integers(8, len(data) - 8))
            data[at : at + 8] = struct.pack("<Q", int(rng.integers(1, 1 << 62)))
        path.write_bytes(bytes(data))
        try:
            session = open_session(path)
        except InputError:
            continue
        opened += 1
        assert sum(1 for _ in session.messages()) <= 5000
    assert opened > 50
