"""The ring keeps within its limits, and what is pinned stays."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import jsonschema
import pytest
from program import cockpit
from recordings import header, messages, read
from rosbags.highlevel import AnyReader

from backend.errors import InputError
from backend.shell.session.ring import (
    VARIABLE,
    Limits,
    in_use,
    locked,
    make_room,
    parts_of,
    pin,
    recordings_of,
    recordings_root,
)
from backend.shell.session.writer import SessionWriter

NOW = time.time()


def part(
    folder: Path, number: int, age: float, finish: bool = True, now: float | None = None
) -> Path:
    """A part that was last changed `age` seconds ago."""
    then = (NOW if now is None else now) - age
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"part-{number:04}.mcap"
    writer = SessionWriter(path, header(number, recording=folder.name))
    for message in messages(20, seed=number):
        writer.write(message)
    writer.flush_chunk()
    if finish:
        writer.close()
    else:
        writer.abandon()
    os.utime(path, (then, then))
    return path


def test_the_oldest_parts_beyond_the_limits_go_first(tmp_path: Path) -> None:
    old, new = tmp_path / "20260101T000000Z", tmp_path / "20260102T000000Z"
    paths = [part(old, 0, 500), part(old, 1, 400), part(new, 0, 300), part(new, 1, 200)]
    sizes = [path.stat().st_size for path in paths]
    assert make_room(tmp_path, Limits(), NOW) == []
    assert make_room(tmp_path, Limits(max_bytes=sum(sizes[1:])), NOW) == paths[:1]
    assert make_room(tmp_path, Limits(max_age=250), NOW) == paths[1:3]
    assert recordings_of(tmp_path) == [new]
    assert not old.exists()  # with everything that the recorder had put there
    assert [p.path for p in parts_of(new)] == paths[3:]
    with AnyReader([new]) as bag:  # its list of parts was brought up to date
        assert bag.message_count > 0


def test_a_folder_with_something_else_in_it_stays(tmp_path: Path) -> None:
    path = part(tmp_path / "a", 0, 500)
    (tmp_path / "a" / "notes.txt").write_text("mine")
    assert make_room(tmp_path, Limits(max_age=10), NOW) == [path]
    assert (tmp_path / "a" / "notes.txt").read_text() == "mine"


def test_neither_pinned_parts_nor_those_being_written_are_deleted(tmp_path: Path) -> None:
    first, second = part(tmp_path / "a", 0, 500), part(tmp_path / "a", 1, 400)
    content = read(first)
    folder = pin(tmp_path, "what happened", 1000.0, NOW)
    with locked(tmp_path / "a"):
        assert in_use(tmp_path / "a")
        assert make_room(tmp_path, Limits(max_age=10), NOW) == [first]
        assert second.exists()
    assert not in_use(tmp_path / "a")
    assert make_room(tmp_path, Limits(max_age=10), NOW, keep=[second]) == []
    assert make_room(tmp_path, Limits(max_age=10), NOW) == [second]
    assert folder == tmp_path / "pinned" / "what happened"
    assert read(folder / "part-0000.mcap") == content
    with AnyReader([folder]) as bag:
        assert len({c.topic for c in bag.connections}) >= 5


def test_a_pin_holds_what_was_recorded_in_its_minutes(tmp_path: Path) -> None:
    for number, age in enumerate((500, 400, 300, 200)):
        part(tmp_path / "a", number, age)
    folder = pin(tmp_path, "last", 350.0, NOW)
    assert [p.number for p in parts_of(folder)] == [2, 3]
    assert folder.joinpath("part-0002.mcap").stat().st_nlink == 2  # takes no room of its own
    part(tmp_path / "b", 0, 100)
    assert len(parts_of(pin(tmp_path, "both", 350.0, NOW))) == 3
    with pytest.raises(InputError, match="pinned already"):
        pin(tmp_path, "both", 350.0, NOW)
    with pytest.raises(InputError, match="nothing was recorded"):
        pin(tmp_path, "none", 50.0, NOW)
    for name in ("", "../up", "a/b", ".hidden", "x" * 65, "end "):
        with pytest.raises(InputError, match="allowed are"):
            pin(tmp_path, name, 350.0, NOW)
    assert sorted(p.name for p in (tmp_path / "pinned").iterdir()) == ["both", "last"]


def test_a_pin_is_a_copy_where_there_are_no_hard_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = part(tmp_path / "a", 0, 100)

    def refuse(*_: object) -> None:
        raise PermissionError("no links here")

    monkeypatch.setattr(os, "link", refuse)
    folder = pin(tmp_path, "copy", 200.0, NOW)
    assert (folder / path.name).read_bytes() == path.read_bytes()


def test_where_recordings_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert recordings_root("recorded", tmp_path) == tmp_path / "recorded"
    assert recordings_root(str(tmp_path / "x"), Path("/elsewhere")) == tmp_path / "x"
    monkeypatch.setenv(VARIABLE, str(tmp_path / "told"))
    assert recordings_root() == tmp_path / "told"
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    assert recordings_root() == tmp_path / "state/excavator-cockpit/recordings"


def test_the_command_lists_and_pins(tmp_path: Path) -> None:
    root = ("--folder", str(tmp_path))
    assert "no recordings" in cockpit("recordings", *root).stdout
    assert cockpit("recordings", "pin", "x", *root).returncode == 2
    now = time.time()
    part(tmp_path / "demo" / "a", 0, 500, now=now)
    part(tmp_path / "demo" / "a", 1, 20, finish=False, now=now)
    part(tmp_path / "other" / "b", 0, 5, now=now)
    done = cockpit("recordings", "pin", "why", "--minutes", "1", "--site", "demo", *root)
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "demo/pinned/why") in done.stdout
    with locked(tmp_path / "other" / "b"):
        document = json.loads(cockpit("recordings", "--json", *root).stdout)
    jsonschema.validate(document, json.loads(cockpit("schema", "recordings").stdout))
    rows = {(r["site"], r["name"]): r for r in document["recordings"]}
    assert set(rows) == {("demo", "a"), ("demo", "why"), ("other", "b")}
    assert (rows["demo", "a"]["parts"], rows["demo", "why"]["parts"]) == (2, 1)
    assert [rows[key]["pinned"] for key in sorted(rows)] == [False, True, False]
    assert [rows[key]["live"] for key in sorted(rows)] == [False, False, True]
    assert rows["demo", "why"]["begin"] is None  # it was never finished
    assert "pinned" in cockpit("recordings", *root).stdout
    # Without --site: the site that was recorded last.
    assert "other/pinned/now" in cockpit("recordings", "pin", "now", *root).stdout
    for arguments, word in (
        (["--site", "third"], "demo, other"),
        (["--minutes", "0.05", "--site", "demo"], "nothing was recorded"),
    ):
        done = cockpit("recordings", "pin", "x", *arguments, *root)
        assert (done.returncode, len(done.stderr.strip().splitlines())) == (2, 1)
        assert word in done.stderr
