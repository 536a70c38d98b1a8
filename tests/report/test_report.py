"""The report of the shipped near miss: complete, true to the session, and without the network."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from program import cockpit as run

from cockpit.playback import see
from cockpit.report.make import make_report
from cockpit.session_files import session_file


@pytest.fixture(scope="module")
def near_miss(repository: Path) -> Path:
    return repository / "scenes" / "sessions" / "near-miss.mcap"


@pytest.fixture(scope="module")
def html(near_miss: Path) -> str:
    return make_report(see(near_miss, None), "", False)


def test_it_says_what_happened(html: str) -> None:
    before_replay = html.split("<iframe")[0]
    least = re.search(r"Least distance between machines: <b>([\d.]+) m</b>", before_replay)
    assert least is not None
    assert 0.0 < float(least[1]) < 0.2
    assert "contacts among them: <b>0</b>" in before_replay
    assert "STOP" in before_replay
    assert "UNKNOWN" in before_replay
    assert re.search(r"<b>0\.\d\d m at [\d.]+ s</b>", before_replay)
    for title in ("Clearance [m]", "LEFT joints [°]", "RIGHT data age [s]"):
        assert title in before_replay
    assert before_replay.count("<polygon") >= 8


def test_it_needs_nothing_else(html: str) -> None:
    own = re.sub(r'srcdoc="[^"]*"', "", html)
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?(?!#|data:)""", own)
    assert "__VISER_EMBED_DATA__" in html  # the replay's data are inside


def test_the_program_writes_it_and_says_what_is_wrong(near_miss: Path, tmp_path: Path) -> None:
    done = run("report", str(near_miss), "--out", str(tmp_path / "no" / "r.html"))
    assert done.returncode == 2
    assert "cannot be written" in done.stderr
    done = run("report", str(near_miss), "--out", str(tmp_path / "r.html"), "--source", "wished")
    assert done.returncode == 2
    assert "allowed are recorded, evaluated" in done.stderr


def test_a_page_gets_a_file_in_a_folder_of_its_own(near_miss: Path) -> None:
    path = session_file(near_miss, None, "csv")
    assert path.suffix == ".zip"
    assert path.stat().st_size > 1000
    assert [entry.suffix for entry in path.parent.iterdir() if entry.is_file()] == [".zip"]
