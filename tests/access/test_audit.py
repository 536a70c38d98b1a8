"""The audit log: every line is what its schema says, and nobody waits for it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from gatehouse import PASSWORD, Clock, house
from program import cockpit

from backend.shell.access import audit as module
from backend.shell.access.audit import Audit


def lines(path: Path) -> list[dict[str, Any]]:
    schema = json.loads(cockpit("schema", "audit").stdout)
    found = [json.loads(line) for line in path.read_text().splitlines()]
    for line in found:
        jsonschema.validate(line, schema)
    return found


def test_coming_and_going_is_written_down(users_file: Path, tmp_path: Path) -> None:
    with house(tmp_path, users_file) as running, running.client() as client:
        client.post("/api/login", json={"name": "otto", "password": "wrong"})
        client.post("/api/login", json={"name": "hunter2", "password": "wrong"})
        client.post("/api/login", json={"name": "vera", "password": PASSWORD})
        client.post("/api/recording/pin")
        client.post("/api/recording/pin", headers={"Origin": "http://evil.example"})
        client.post("/api/logout")
        running.access.audit("lease", "otto", {"machine": "left", "path": Path("/x")})
        running.access.close()
    found = lines(tmp_path / "audit.jsonl")
    assert [(line["event"], line["who"]) for line in found] == [
        ("login failed", "otto"),
        ("login failed", None),
        ("login", "vera"),
        ("refused", "vera"),
        ("refused", "vera"),
        ("logout", "vera"),
        ("lease", "otto"),
    ]
    assert {line["details"].get("address") for line in found} == {"127.0.0.1", None}
    assert found[3]["details"]["why"] == "needs the role operator"
    assert found[4]["details"]["why"] == "from another origin"
    text = (tmp_path / "audit.jsonl").read_text()
    assert "hunter2" not in text  # it may be a password in the wrong field
    assert PASSWORD not in text


def test_it_is_for_its_owner_and_only_appended(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "audit.jsonl"
    for k in range(2):
        log = Audit(path, Clock())
        log.write("lease", "otto", {"k": k})
        log.close()
    assert [line["details"]["k"] for line in lines(path)] == [0, 1]
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_refusing_disk_holds_nobody_up_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "AGAIN", 0.05)
    path = tmp_path / "audit.jsonl"
    path.mkdir()  # in the way
    log = Audit(path, Clock())
    began = time.monotonic()
    for k in range(100):
        log.write("lease", "otto", {"k": k})
    assert time.monotonic() - began < 1.0
    time.sleep(0.2)
    path.rmdir()
    time.sleep(0.3)
    log.close()
    assert [line["details"]["k"] for line in lines(path)] == list(range(100))


def test_what_is_lost_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WAITING", 3)
    monkeypatch.setattr(module, "AGAIN", 0.05)
    path = tmp_path / "audit.jsonl"
    path.mkdir()
    log = Audit(path, Clock())
    for k in range(20):
        log.write("lease", "otto", {"k": k})
    path.rmdir()
    time.sleep(0.3)
    log.close()
    found = lines(path)
    (lost,) = [line for line in found if line["event"] == "lost"]
    assert len(found) - 1 + lost["details"]["lines"] == 20


def test_without_a_file_nothing_is_written() -> None:
    log = Audit(None)
    log.write("lease", "otto", {})
    log.close()
