"""Signing in with a password: cookies, limits, expiry, and what changes in the users file."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import jsonschema
import pytest
from gatehouse import PASSWORD, Clock, House, house
from program import cockpit

from backend.control.person import ROLES, Person
from backend.documents.access import UserEntry
from backend.errors import InputError
from backend.shell.access import passwords
from backend.shell.access.attempts import MOST, Attempts, network
from backend.shell.access.passwords import hashed, matches
from backend.shell.access.sessions import Sessions, digest
from backend.shell.access.users import Users, remove_user, set_password, set_role


@pytest.fixture
def fresh(users_file: Path, tmp_path: Path) -> Iterator[House]:
    """A house whose limits nobody has touched yet."""
    with house(tmp_path, users_file) as running:
        yield running


def test_a_password_opens_and_logout_closes(fresh: House) -> None:
    with fresh.client() as client:
        answer = client.post("/api/login", json={"name": "otto", "password": PASSWORD})
        assert (answer.status_code, answer.json()) == (200, {"who": "otto"})
        cookie = answer.headers["set-cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=strict" in cookie
        assert "Path=/;" in cookie
        assert "Secure" not in cookie  # over plain HTTP, and only there
        me = client.get("/api/me").json()
        jsonschema.validate(me, json.loads(cockpit("schema", "me").stdout))
        assert (me["who"], me["role"], me["how"]) == ("otto", "operator", "password")
        assert (me["may_drive"], me["may_override"]) == (True, False)
        assert client.get("/api/login").json() == {"passwords": True, "link": False, "who": "otto"}
        assert "Signed in as" in client.get("/login").text
        token = client.cookies["cockpit"]
        assert client.post("/api/logout").status_code == 204
        assert "cockpit" not in client.cookies
        client.cookies.set("cockpit", token)
        assert client.get("/api/me").status_code == 401


def test_a_form_works_without_any_script(fresh: House) -> None:
    with fresh.client() as client:
        wrong = client.post("/api/login", data={"name": "otto", "password": "<b>wrong</b>"})
        assert wrong.status_code == 401
        assert 'role="alert">Name or password is wrong.</p>' in wrong.text
        assert 'data-ways="passwords"' in wrong.text
        right = client.post("/api/login", data={"name": "otto", "password": PASSWORD})
        assert (right.status_code, right.headers["location"]) == (303, "/")
        assert client.get("/").status_code == 200
        form = {"Content-Type": "application/x-www-form-urlencoded"}
        assert client.post("/api/logout", headers=form).headers["location"] == "/login"


@pytest.mark.parametrize(
    "body",
    [
        *(b"", b"{", b"[]", b"null", b'{"name": "otto"}', b'{"name": 1, "password": "x"}'),
        *(b"\xff", b"[" * 5000, b'{"name": "otto", "password": "' + b"x" * 9000 + b'"}'),
    ],
)
def test_what_is_no_login_is_said_to_be_none(fresh: House, body: bytes) -> None:
    with fresh.client() as client:
        for kind in ("application/json", "application/x-www-form-urlencoded", "text/plain"):
            answer = client.post("/api/login", content=body, headers={"Content-Type": kind})
            assert answer.status_code == 422, kind
            assert "name and password are needed" in answer.json()["detail"]


def test_a_foreign_page_cannot_sign_anybody_in(fresh: House) -> None:
    with fresh.client(Origin="http://evil.example") as client:
        answer = client.post("/api/login", data={"name": "otto", "password": PASSWORD})
        assert answer.status_code == 403
        assert "set-cookie" not in answer.headers


def test_signing_in_ends_the_session_before(fresh: House) -> None:
    with fresh.client("vera") as client:
        before = client.cookies["cockpit"]
        client.post("/api/login", json={"name": "otto", "password": PASSWORD})
        assert fresh.access.sessions.find(before) is None


def test_too_many_attempts_for_a_name(fresh: House) -> None:
    with fresh.client() as client:
        for name in ("otto", "nobody"):
            for _ in range(5):
                answer = client.post("/api/login", json={"name": name, "password": "wrong"})
                assert answer.status_code == 401
            for password in ("wrong", PASSWORD):
                body = {"name": name.upper(), "password": password}
                answer = client.post("/api/login", json=body)
                assert answer.status_code == 429
                assert 200 < int(answer.headers["retry-after"]) <= 300
                assert answer.json()["detail"].startswith("Too many attempts. Try again in ")
        form = client.post("/api/login", data={"name": "otto", "password": PASSWORD})
        assert form.status_code == 429
        assert "Too many attempts" in form.text
        assert client.post("/api/login", json={"name": "vera", "password": PASSWORD}).is_success


def test_too_many_attempts_from_an_address(fresh: House, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Users, "sign_in", lambda *_: None)
    with fresh.client() as client:
        for k in range(20):
            headers = {"X-Forwarded-For": f"10.0.0.{k}"}  # which is not believed
            body = {"name": f"n{k}", "password": "wrong"}
            assert client.post("/api/login", json=body, headers=headers).status_code == 401
        answer = client.post("/api/login", json={"name": "vera", "password": PASSWORD})
        assert answer.status_code == 429


def test_limits_forget_with_time_and_after_success() -> None:
    clock = Clock()
    attempts = Attempts(2, 10.0, clock)
    assert [attempts.take("a"), attempts.take("a")] == [0.0, 0.0]
    clock.now += 4.0
    assert attempts.take("a") == 6.0
    assert attempts.take("b") == 0.0
    clock.now += 6.0
    assert attempts.take("a") == 0.0
    attempts.undo("a")
    attempts.forget("b")
    assert [attempts.take("b"), attempts.take("b")] == [0.0, 0.0]
    for k in range(MOST + 5):
        attempts.take(str(k))
    assert len(attempts._times) == MOST


def test_an_address_is_what_one_host_has() -> None:
    assert network("10.1.2.3") == network("::ffff:10.1.2.3") == "10.1.2.3"
    assert network("2001:db8::1") == network("2001:db8::ffff%eth0") == "2001:db8::/64"
    assert network("2001:db8:0:1::1") != network("2001:db8::1")
    assert network("") == ""


def test_a_wrong_name_takes_as_long_as_a_wrong_password(
    users_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    class Watched:
        def verify(self, kept: str, password: str) -> bool:
            asked.append(kept)
            return real.verify(kept, password)

        def hash(self, password: str) -> str:
            return real.hash(password)

    real = passwords._HASHER
    monkeypatch.setattr(passwords, "_HASHER", Watched())
    users = Users(users_file)
    assert users.sign_in("otto", "wrong") is None
    assert users.sign_in("nobody", "wrong") is None
    assert len(asked) == 2, "one verification each"
    assert [kept.rsplit("$", 2)[0] for kept in asked] == ["$argon2id$v=19$m=65536,t=3,p=4"] * 2


def test_passwords_are_kept_as_argon2id_and_compared_as_typed() -> None:
    kept = hashed("blåbærsyltetøy")
    assert kept.startswith("$argon2id$")
    assert "blåbær" not in kept
    assert matches(kept, "bla\u030abærsyltetøy")  # the same letters from another keyboard
    assert not matches(kept, "blåbærsyltetøY")
    assert not matches(None, "blåbærsyltetøy")
    assert not matches("$argon2id$damaged", "blåbærsyltetøy")
    for password in ("short", "x" * 1025):
        with pytest.raises(InputError, match="allowed are 10 to 1024"):
            hashed(password)


def test_sessions_end_by_themselves() -> None:
    clock, person = Clock(), Person("otto", "operator")
    sessions = Sessions(idle=100.0, absolute=350.0, clock=clock)
    token = sessions.begin(person, "password", "seal")
    clock.now += 99.0
    assert sessions.find(token) is not None
    clock.now += 101.0
    assert sessions.find(token) is None, "idle"
    token = sessions.begin(person, "password", "seal")
    for _ in range(3):
        clock.now += 99.0
        assert sessions.find(token) is not None
    clock.now += 60.0
    assert sessions.find(token) is None, "too old, although it was used"
    token = sessions.begin(person, "password", "seal")
    clock.now -= 10.0
    assert sessions.find(token) is None, "a clock that was set back"


def test_the_server_keeps_only_hashes_of_long_random_tokens() -> None:
    sessions = Sessions()
    tokens = {sessions.begin(Person("otto", "operator"), "link") for _ in range(50)}
    assert len(tokens) == 50
    assert all(len(token) >= 43 for token in tokens)  # 256 bits
    assert set(sessions._sessions) == {digest(token) for token in tokens}
    assert not any(token in repr(vars(sessions)) for token in tokens)


def test_sessions_with_a_password_outlive_the_program(tmp_path: Path) -> None:
    path, clock = tmp_path / "sessions.json", Clock()
    first = Sessions(path, clock=clock)
    kept = first.begin(Person("otto", "operator"), "password", "seal")
    link = first.begin(Person("demo", "supervisor"), "link")
    gone = first.begin(Person("vera", "viewer"), "password", "seal")
    first.end(gone)
    assert path.stat().st_mode & 0o777 == 0o600
    assert kept not in path.read_text()
    second = Sessions(path, clock=clock)
    found = second.find(kept)
    assert found is not None
    assert found.person == Person("otto", "operator")
    assert second.find(link) is None
    assert second.find(gone) is None
    clock.now += 13 * 3600.0
    assert Sessions(path, clock=clock).find(kept) is None
    clock.now -= 13 * 3600.0
    path.chmod(0o644)
    assert Sessions(path, clock=clock).find(kept) is None, "others could have written it"
    path.write_text("{")
    assert Sessions(path, clock=clock).find(kept) is None


def test_changes_in_the_file_count_in_a_running_program(users_file: Path, tmp_path: Path) -> None:
    file, clock = tmp_path / "users.json", Clock()
    shutil.copy(users_file, file)
    file.chmod(0o600)
    users = Users(file, clock)
    seals = {}
    for name in ("otto", "vera", "susi"):
        found = users.sign_in(name, PASSWORD)
        assert found is not None
        seals[name] = found[1]

    def now(name: str) -> Person | None:
        clock.now += 1.0
        return users.person(name, seals[name])

    set_role(file, "otto", "viewer")
    assert now("otto") == Person("otto", "viewer")
    set_password(file, "vera", "another password")
    assert now("vera") is None
    remove_user(file, "susi")
    assert now("susi") is None
    file.write_text("{")
    assert now("otto") == Person("otto", "viewer"), "half a file is no change"
    file.unlink()
    assert now("otto") is None


def test_roles_are_those_of_a_person() -> None:
    assert UserEntry.model_json_schema()["properties"]["role"]["enum"] == list(ROLES)
