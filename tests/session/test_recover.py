"""Cut or damaged anywhere, a recording loses only what was hit."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from program import cockpit
from recordings import header, messages, read
from rosbags.highlevel import AnyReader

from backend.errors import InputError
from backend.shell.session.format import Message
from backend.shell.session.recover import NothingSaved, recover
from backend.shell.session.writer import SessionWriter

EVERY = 40  # messages in a chunk


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Message]]:
    """A finished file of small chunks, so that a few hundred cuts are quick."""
    path = tmp_path_factory.mktemp("original") / "a.mcap"
    writer = SessionWriter(path, header())
    sent = list(messages(100))
    for k, message in enumerate(sent):
        writer.write(message)
        if k % EVERY == EVERY - 1:
            writer.flush_chunk()
    writer.close()
    return path, sent


def chunk_spans(path: Path) -> list[tuple[int, int]]:
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    indexes = summary.chunk_indexes
    return [(i.chunk_start_offset, i.chunk_start_offset + i.chunk_length) for i in indexes]


def test_cut_at_any_byte_loses_at_most_the_last_chunk(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, sent = original
    data = path.read_bytes()
    spans = chunk_spans(path)
    assert len(spans) > 10
    rng = np.random.default_rng(0)
    edges = [edge + d for span in spans[:3] for edge in span for d in (-1, 0, 1)]
    cut, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    for at in [0, 1, 7, 8, *edges, *rng.integers(0, len(data), 200).tolist(), len(data) - 1]:
        cut.write_bytes(data[:at])
        whole = sum(end <= at for _, end in spans)
        if whole == 0:
            with pytest.raises(InputError):
                recover([cut], out)
            assert not out.exists()
            continue
        (saved,) = recover([cut], out)
        assert read(out) == sent[: whole * EVERY], at  # by mcap's reader: it has its summary
        assert saved.messages == min(whole * EVERY, len(sent))
        assert saved.chunks == whole
        assert not saved.whole
        assert cut.read_bytes() == data[:at]
        assert not list(tmp_path.glob("*.partial"))
        out.unlink()


def test_what_is_recovered_says_the_same_of_itself(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, _ = original
    cut, out = tmp_path / "cut.mcap", tmp_path / "out.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    recover([cut], out)
    found = []
    for file in (path, out):
        with file.open("rb") as stream:
            reader = make_reader(stream)
            summary = reader.get_summary()
            assert summary is not None
            schemas = {(s.name, s.encoding, s.data) for s in summary.schemas.values()}
            metadata = [(m.name, m.metadata) for m in reader.iter_metadata()]
            found.append((reader.get_header().profile, metadata, schemas))
    assert found[0] == found[1]
    with AnyReader([out]) as bag:
        assert bag.message_count > 100


def test_garbage_in_the_middle_costs_the_chunks_that_it_hits(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, sent = original
    data = path.read_bytes()
    spans = chunk_spans(path)
    rng = np.random.default_rng(1)
    bad, out = tmp_path / "bad.mcap", tmp_path / "out.mcap"
    for _ in range(100):
        at = int(rng.integers(spans[0][0], spans[-1][1] - 1))
        length = int(rng.integers(1, 3000))
        garbage = rng.bytes(length) if rng.random() < 0.7 else bytes(length)
        bad.write_bytes((data[:at] + garbage + data[at + length :])[: len(data)])
        damaged = bad.read_bytes()
        kept = [k for k, (begin, end) in enumerate(spans) if damaged[begin:end] == data[begin:end]]
        expected = [m for k in kept for m in sent[k * EVERY : (k + 1) * EVERY]]
        (saved,) = recover([bad], out)
        assert read(out) == expected
        if len(kept) < len(spans):
            assert saved.skipped
            assert all(gap.why and gap.bytes > 0 for gap in saved.skipped)
            assert not saved.whole
        out.unlink()


def test_damage_of_a_channel_is_made_good_by_the_summary(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, sent = original
    data = bytearray(path.read_bytes())
    at = data.index(b"/left/gnss/fix")
    data[at - 6 : at + 4] = b"\xff" * 10
    bad, out = tmp_path / "bad.mcap", tmp_path / "out.mcap"
    bad.write_bytes(data)
    (saved,) = recover([bad], out)
    assert saved.unknown == 0
    assert saved.skipped
    assert read(out) == sent[: len(read(out))]
    # Without the summary the messages of that channel are lost, and counted.
    bad.write_bytes(data[: chunk_spans(path)[-1][1]])
    out.unlink()
    (saved,) = recover([bad], out)
    assert saved.unknown > 0
    assert {m.topic for m in read(out)} == {m.topic for m in sent} - {"/left/gnss/fix"}


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD])
def test_files_of_other_writers_are_recovered_too(
    compression: CompressionType, tmp_path: Path
) -> None:
    path, cut, out = (tmp_path / f"{name}.mcap" for name in ("a", "cut", "out"))
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=2000, compression=compression)
        writer.start("ros1", "another")
        schema = writer.register_schema("S", "ros1msg", b"string data")
        channel = writer.register_channel("/a", "ros1", schema)
        for k in range(500):
            writer.add_message(channel, k, bytes([k % 256] * 50), k)
        writer.finish()
    data = path.read_bytes()
    spans = chunk_spans(path)
    middle, end = spans[len(spans) // 2][0] + 60, spans[-2][0] + 70
    cut.write_bytes(data[:middle] + b"\xfe" * 10 + data[middle + 10 : end])
    (saved,) = recover([cut], out)
    assert saved.chunks == len(spans) - 3
    assert len(saved.skipped) == 2
    found = read(out)
    assert len(found) == saved.messages > 300
    assert all(m.data == bytes([m.time % 256] * 50) for m in found)


def test_a_whole_file_is_told_to_be_whole(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, sent = original
    (saved,) = recover([path], tmp_path / "out.mcap")
    assert saved.whole
    assert saved.skipped == []
    assert read(tmp_path / "out.mcap") == sent
    with pytest.raises(InputError, match="exists already"):
        recover([path], tmp_path / "out.mcap")


def test_a_header_alone_is_nothing_to_save(tmp_path: Path) -> None:
    SessionWriter(tmp_path / "a.mcap", header()).close()
    with pytest.raises(NothingSaved, match="no whole chunk"):
        recover([tmp_path / "a.mcap"], tmp_path / "out.mcap")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap"]


def test_the_command_recovers_a_folder_and_says_what(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    path, sent = original
    data = path.read_bytes()
    folder = tmp_path / "recording"
    folder.mkdir()
    (folder / "part-0000.mcap").write_bytes(data)
    (folder / "part-0001.mcap").write_bytes(data[: chunk_spans(path)[1][1] + 5])
    (folder / "part-0002.mcap").write_bytes(b"")
    done = cockpit("recover", str(folder), "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, json.loads(cockpit("schema", "recover").stdout))
    assert document["messages"] == len(sent) + 2 * EVERY
    assert [file["whole"] for file in document["files"]] == [True, False]
    assert document["files"][1]["skipped"][0]["why"] == "the file ends within a record"
    assert read(tmp_path / "recording-recovered.mcap") == [*sent, *sent[: 2 * EVERY]]
    words = cockpit("recover", str(folder), "--out", str(tmp_path / "b.mcap")).stdout
    assert f"{document['messages']} messages" in words
    assert "part-0001.mcap" in words
    assert "part-0000.mcap" not in words


def test_files_of_another_kind_are_one_sentence(
    original: tuple[Path, list[Message]], tmp_path: Path
) -> None:
    data = original[0].read_bytes()
    SessionWriter(tmp_path / "newer.mcap", header(format=2)).close()
    contents = {
        "empty.mcap": (b"", "is empty"),
        "foreign.mcap": (b"#ROSBAG V2.0\n" * 100, "does not begin as an MCAP file"),
        "future.mcap": (data[:5] + b"1" + data[6:], "MCAP version '1'"),
        "newer.mcap": ((tmp_path / "newer.mcap").read_bytes(), "newer cockpit"),
        "short.mcap": (data[:20], "no whole chunk"),
    }
    for name, (content, word) in contents.items():
        (tmp_path / name).write_bytes(content)
        done = cockpit("recover", str(tmp_path / name))
        assert done.returncode == 2, name
        assert word in done.stderr, name
        assert name in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    for arguments in (["nowhere"], [str(tmp_path / "newer.mcap"), "--out", "/nowhere/x.mcap"]):
        done = cockpit("recover", *arguments)
        assert (done.returncode, "nowhere" in done.stderr) == (2, True)
    (tmp_path / "nothing").mkdir()
    assert "no .mcap file" in cockpit("recover", str(tmp_path / "nothing")).stderr
