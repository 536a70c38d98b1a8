"""`cockpit users`, and what stands in the way of starting: one clear sentence each."""

from __future__ import annotations

import getpass
import io
import json
import sys
from pathlib import Path

import jsonschema
import pytest
from program import Done, cockpit

from backend.shell.access.users import Users
from cockpit.entry import EntryOptions, decide


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "deep" / "users.json"


def users(file: Path, *arguments: str) -> Done:
    return cockpit("users", *arguments, "--file", str(file))


def add(file: Path, monkeypatch: pytest.MonkeyPatch, name: str, role: str, password: str) -> Done:
    monkeypatch.setattr(sys, "stdin", io.StringIO(password + "\n"))
    return users(file, "add", name, "--role", role, "--password-stdin")


def test_add_list_role_password_remove(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert add(file, monkeypatch, "Äiti Ö.", "operator", "a long password").returncode == 0
    assert add(file, monkeypatch, "bo", "viewer", "a long password").returncode == 0
    assert file.stat().st_mode & 0o777 == 0o600
    assert "a long password" not in file.read_text()
    jsonschema.validate(
        json.loads(file.read_text()), json.loads(cockpit("schema", "users-file").stdout)
    )
    listed = json.loads(users(file, "list", "--json").stdout)
    jsonschema.validate(listed, json.loads(cockpit("schema", "users").stdout))
    assert [(u["name"], u["role"]) for u in listed["users"]] == [
        ("bo", "viewer"),
        ("Äiti Ö.", "operator"),
    ]
    assert "argon2" not in json.dumps(listed)
    assert users(file, "role", "bo", "supervisor").returncode == 0
    found = Users(file).sign_in("bo", "a long password")
    assert found is not None
    assert found[0].role == "supervisor"
    monkeypatch.setattr(sys, "stdin", io.StringIO("another password\n"))
    assert users(file, "password", "bo", "--password-stdin").returncode == 0
    assert Users(file).sign_in("bo", "a long password") is None
    assert Users(file).sign_in("bo", "another password") is not None
    assert users(file, "remove", "bo").returncode == 0
    assert "bo" not in users(file, "list").stdout
    assert [p.name for p in file.parent.iterdir()] == ["users.json"]


def test_the_password_is_asked_for_twice(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stdin", Terminal())
    for typed, code in ((["one password", "other password"], 2), (["one password"] * 2, 0)):
        left = list(typed)
        monkeypatch.setattr(getpass, "getpass", lambda _, left=left: left.pop(0))
        done = users(file, "add", "bo", "--role", "viewer")
        assert (done.returncode, left) == (code, []), done.stderr
        assert file.exists() == (code == 0)
    assert "one password" not in done.stdout + done.stderr


def sentence(done: Done, *words: str) -> None:
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr


def test_mistakes_are_one_sentence(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sentence(users(file, "list"), str(file), "no users file", "cockpit users add")
    sentence(users(file, "remove", "bo"), "no users file")
    sentence(add(file, monkeypatch, "bo", "boss", "x" * 12), "boss", "viewer, operator, supervisor")
    sentence(add(file, monkeypatch, "bo", "viewer", "short"), "5 characters", "10 to 1024")
    sentence(add(file, monkeypatch, "", "viewer", "x" * 12), "is no name")
    sentence(add(file, monkeypatch, "a\nb", "viewer", "x" * 12), "is no name")
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    sentence(users(file, "add", "bo", "--role", "viewer"), "--password-stdin")
    assert not file.exists()
    add(file, monkeypatch, "bo", "viewer", "x" * 12)
    sentence(add(file, monkeypatch, "Bo", "viewer", "x" * 12), '"bo"', "already")
    sentence(users(file, "role", "eva", "viewer"), '"eva"', "there are bo")
    sentence(users(file, "role", "bo", "boss"), "boss")
    sentence(users(file, "password", "eva", "--password-stdin"), '"eva"')
    file.chmod(0o640)
    for arguments in (("list",), ("remove", "bo"), ("role", "bo", "viewer")):
        sentence(users(file, *arguments), "0640", "allowed is 0600", "chmod 600")
    file.chmod(0o600)
    file.write_text('{"users": {"bo": {"role": "boss", "password": "$argon2id$"}}}')
    sentence(users(file, "list"), "users.bo.role", "cockpit schema users-file")
    file.write_text('{"users": {"bo": {"role": "viewer", "password": "plain"}}}')
    sentence(users(file, "list"), "users.bo.password")
    file.write_text("nonsense")
    sentence(users(file, "list"), str(file))


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.MonkeyPatch.context() as patch:
        done = add(tmp_path / "file" / "users.json", patch, "bo", "viewer", "x" * 12)
    sentence(done, "file/users.json", "cannot be")


def start(*arguments: str) -> Done:
    """A start that must fail before anything is opened: the site is the last thing looked at."""
    return cockpit("serve", "--site", "nowhere", "--no-browser", "--port", "0", *arguments)


def test_serve_needs_users(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    sentence(start(), "there is no users file", "cockpit users add NAME --role operator")
    empty = tmp_path / "empty.json"
    empty.write_text('{"users": {}}')
    empty.chmod(0o600)
    sentence(start("--users", str(empty)), "has no users", "cockpit users add")
    for allowed in ("--no-login", "--one-time-link"):
        sentence(start(allowed), "nowhere")


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "::", "cockpit.example"])
def test_others_are_let_in_over_https_and_with_a_login_only(host: str, tmp_path: Path) -> None:
    sentence(start("--host", host), host, "--self-signed", "--insecure-http")
    for command in (["demo"], ["play", str(tmp_path)]):
        sentence(cockpit(*command, "--host", host), host, "--self-signed")
    for way in ("--self-signed", "--insecure-http"):
        sentence(start("--host", host, way, "--no-login"), "--no-login", host, "127.0.0.1")
        sentence(start("--host", host, way, "--one-time-link"), "--one-time-link", host)
        sentence(start("--host", host, way), "there is no users file")
        sentence(start("--host", host, way, "--one-time-link", "--users", "x"), "--one-time-link")


def test_options_that_do_not_fit_are_said(tmp_path: Path) -> None:
    sentence(start("--no-login", "--users", "x"), "--no-login")
    sentence(start("--no-login", "--one-time-link"), "--no-login")
    sentence(start("--no-login", "--cert", "x"), "--key: is missing")
    sentence(start("--no-login", "--key", "x"), "--cert: is missing")
    pem = tmp_path / "x.pem"
    pem.write_text("nonsense")
    pem.chmod(0o600)
    sentence(start("--no-login", "--cert", "none.pem", "--key", str(pem)), "none.pem", "--cert")
    both = ("--cert", str(pem), "--key", str(pem))
    sentence(start("--no-login", *both), "no certificate with its key")
    sentence(start("--no-login", *both, "--self-signed"), "--self-signed: allowed is it alone")
    pem.chmod(0o644)
    sentence(start("--no-login", *both), "can be read by everybody", "chmod 600")


def test_what_opens_the_door_is_said_loudly() -> None:
    (note,) = decide(EntryOptions(no_login=True), "127.0.0.1").notes()
    assert note.startswith("WARNING: --no-login")
    assert '"local", supervisor' in note
    entry = decide(EntryOptions(no_login=True), "::1")
    assert entry.url(8000) == "http://[::1]:8000"
    options = EntryOptions(insecure_http=True)
    from backend.control.person import Person

    (note,) = decide(options, "0.0.0.0", Person("demo", "supervisor")).notes()
    assert note.startswith("WARNING: --insecure-http")
