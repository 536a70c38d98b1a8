"""Every route of the real app is closed to who is not signed in, and to other sites' pages."""

from __future__ import annotations

import asyncio
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import msgspec
import pytest
from fastapi.routing import APIRoute
from gatehouse import HTML, PEOPLE, House, house
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from backend.control.person import Person
from backend.shell.access.users import set_password, set_role
from backend.shell.app.gate import Gate
from backend.shell.app.viewer_proxy import Hooks

STATIC = Path(__file__).resolve().parents[2] / "static"
OPEN = {("GET", "/login"), ("GET", "/api/login"), ("POST", "/api/login"), ("GET", "/api/health")}
OPEN |= {("HEAD", "/login"), ("GET", "/favicon.ico")}
VIEWERS_POST = {"/api/logout", "/api/whatif", "/api/session/diff"}


def flat(routes: list[BaseRoute]) -> Iterator[BaseRoute]:
    """Every route, those of routers that are kept whole included."""
    for route in routes:
        inner = getattr(getattr(route, "original_router", None), "routes", None)
        if inner is not None:
            yield from flat(inner)
        else:
            yield route


def paths(house_: House) -> list[tuple[str, str]]:
    """(method, path) of everything that answers HTTP, names in paths filled in."""
    found = []
    for route in flat(house_.app.routes):
        if isinstance(route, (Route, APIRoute)):
            path = re.sub(r"{[^}]*}", "x", route.path)
            found += [(method, path) for method in route.methods or ()]
        elif isinstance(route, Mount):
            found.append(("GET", f"{route.path}/index.html"))
    return found


def sockets(house_: House) -> list[str]:
    routes = flat(house_.app.routes)
    return [re.sub(r"{[^}]*}", "x", r.path) for r in routes if isinstance(r, WebSocketRoute)]


def test_the_routes_are_those_we_know(closed: House) -> None:
    known = {path for _, path in paths(closed)}
    assert {"/", "/ws", "/view", "/view/x"} <= known | set(sockets(closed))
    assert {"/api/docs", "/api/openapi.json", "/api/recording/pin", "/api/session/export"} <= known
    assert {"/view/", "/view/x/", "/static/index.html", "/api/logout", "/api/me"} <= known
    assert set(sockets(closed)) == {"/ws", "/view", "/view/x", "/api/camera/x/x"}


def test_nothing_answers_without_a_session(closed: House) -> None:
    with closed.client() as nobody:
        for method, path in paths(closed):
            answer = nobody.request(method, path)
            if (method, path) in OPEN:
                assert answer.status_code not in (303, 403), (method, path)
                continue
            assert answer.status_code == 401, (method, path)
            if method != "HEAD":
                assert answer.json() == {"detail": "not signed in: see /login"}, (method, path)
            if method == "GET":
                led = nobody.get(path, headers=HTML)
                assert (led.status_code, led.headers["location"]) == (303, "/login"), path
        for path in ("/nowhere", "/api/health/", "/static/../api/site", "/login/", "/metrics"):
            assert nobody.get(path).status_code == 401, path
        nobody.cookies.set(closed.access.cookie, "guessed")
        assert nobody.get("/api/site").status_code == 401


def test_only_the_login_page_s_files_are_open(closed: House) -> None:
    with closed.client() as nobody:
        for file in STATIC.rglob("*.*"):
            path = f"/static/{file.relative_to(STATIC).as_posix()}"
            wanted = path in ("/static/css/login.css", "/static/js/login.js", "/static/icon.svg")
            assert nobody.get(path).status_code == (200 if wanted else 401), path


def test_who_is_signed_in_sees_everything(closed: House) -> None:
    with closed.client("vera") as viewer:
        for path in ("/", "/api/site", "/api/docs", "/api/openapi.json", "/static/js/main.js"):
            assert viewer.get(path).status_code == 200, path
        assert viewer.get("/static-offline-docs/swagger-ui.css").status_code == 200
        assert viewer.get("/nowhere").status_code == 404


def test_no_websocket_opens_without_a_session(closed: House) -> None:
    for path in sockets(closed):
        with pytest.raises(InvalidStatus) as refused:
            closed.socket(path)
        assert refused.value.response.status_code == 403, path
        closed.socket(path, "vera").close()


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1", "http://evil.example/127.0.0.1"]
)
def test_a_foreign_page_is_refused_although_somebody_is_signed_in(
    closed: House, origin: str
) -> None:
    for path in sockets(closed):
        with pytest.raises(InvalidStatus) as refused:
            closed.socket(path, "susi", origin)
        assert refused.value.response.status_code == 403, path
    with closed.client("susi", Origin=origin) as client:
        for method, path in paths(closed):
            if method not in ("GET", "HEAD"):
                answer = client.request(method, path)
                assert answer.status_code == 403, path
                assert "another site's page" in answer.json()["detail"]
        assert client.get("/api/me").status_code == 200


def test_what_the_browser_says_of_the_site_counts_without_an_origin(closed: House) -> None:
    with closed.client("susi") as client:
        marker = {"text": "x"}
        there = {"Sec-Fetch-Site": "cross-site"}
        assert client.post("/api/recording/marker", json=marker, headers=there).status_code == 403
        here = {"Sec-Fetch-Site": "same-origin", "Origin": closed.url}
        assert client.post("/api/recording/marker", json=marker, headers=here).status_code == 204


def test_viewers_change_nothing(closed: House, tmp_path: Path) -> None:
    posts = {path for method, path in paths(closed) if method not in ("GET", "HEAD")}
    assert {"/api/recording/pin", "/api/recording/marker", "/api/session/export"} < posts
    with closed.client("vera") as viewer, closed.client("otto") as operator:
        for path in posts - {"/api/login"}:
            if path not in VIEWERS_POST:
                answer = viewer.post(path)
                assert answer.status_code == 403, path
                words = "this needs the role operator; vera is signed in as viewer"
                assert answer.json()["detail"] == words
                assert operator.post(path).status_code not in (401, 403), path
            elif path != "/api/logout":
                assert viewer.post(path).status_code not in (401, 403), path
    lines = log_of(closed)
    refused = [e for e in lines if e["event"] == "refused" and e["details"]["role"] == "viewer"]
    assert {e["details"]["path"] for e in refused} >= posts - VIEWERS_POST - {"/api/login"}
    assert {e["who"] for e in refused} == {"vera"}


def log_of(house_: House) -> list[dict[str, Any]]:
    time.sleep(0.3)  # written by a thread
    path = house_.access.audit_log.path
    assert path is not None
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_health_tells_strangers_little(closed: House) -> None:
    with closed.client() as nobody, closed.client("vera") as viewer:
        assert nobody.get("/api/health").json() == {
            "ok": False,
            "status": ["no cycle has finished yet"],
        }
        assert {"mode", "machines", "backend"} < set(viewer.get("/api/health").json())


def test_metrics_are_read_with_a_token_of_their_own(closed: House) -> None:
    with closed.client() as nobody:
        for authorization, status in (
            ("Bearer m3trics", 404),  # let through: nobody made the metrics yet
            ("Bearer m3trics2", 401),
            ("Basic m3trics", 401),
            ("Bearer", 401),
        ):
            headers = {"Authorization": authorization}
            assert nobody.get("/metrics", headers=headers).status_code == status, authorization
            assert nobody.get("/api/site", headers=headers).status_code == 401
        headers = {"Authorization": "Bearer m3trics"}
        assert nobody.post("/metrics", headers=headers).status_code == 401


def test_every_answer_has_the_headers(closed: House) -> None:
    with closed.client() as nobody, closed.client("otto") as operator:
        answers = [nobody.get(path) for path in ("/", "/login", "/api/health", "/static/icon.svg")]
        answers += [operator.get(path) for path in ("/", "/api/docs", "/api/site", "/nowhere")]
        answers += [operator.post("/api/whatif"), nobody.get("/", headers={"Host": "evil.example"})]
    assert answers[-1].status_code == 400
    for answer in answers:
        headers = answer.headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "same-origin"
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert "gamepad=(self)" in headers["permissions-policy"]
        assert "frame-ancestors 'self'" in headers["content-security-policy"]
        assert "strict-transport-security" not in headers
    for answer in (answers[1], answers[4]):
        assert "script-src 'self'" in answer.headers["content-security-policy"]


def test_the_websocket_knows_the_person(closed: House, monkeypatch: pytest.MonkeyPatch) -> None:
    from backend.shell.app.feed import Feed

    known: list[Any] = []

    async def serve(_: Feed, socket: Any, person: Any) -> None:
        known.append(person)

    monkeypatch.setattr(Feed, "serve", serve)
    for who in PEOPLE:
        with closed.socket("/ws", who) as socket, pytest.raises(ConnectionClosed):
            socket.recv(timeout=5)
    assert {person.who: person.role for person in known} == PEOPLE
    assert closed.app.state.access is closed.access


CAMERA = msgspec.msgpack.encode({"type": "ViewerCameraMessage"})
SHARE = msgspec.msgpack.encode({"type": "ShareUrlRequest"})
CLICK = msgspec.msgpack.encode({"type": "GuiUpdateMessage"})


def reaches_the_scene(house_: House, who: str) -> list[bytes]:
    house_.scene.heard.clear()
    with house_.socket("/view/w1", who) as socket:
        for message in (SHARE, CLICK, b"\xc1", CAMERA):
            socket.send(message)
        while CAMERA not in house_.scene.heard:
            socket.recv(timeout=5)
    return list(house_.scene.heard)


def test_only_the_camera_reaches_the_scene(closed: House) -> None:
    """So nobody can ask the scene's server to open a tunnel to the public, either."""
    for who in PEOPLE:
        assert reaches_the_scene(closed, who) == [CAMERA], who


def test_a_viewer_sends_no_more_where_others_may(users_file: Path, tmp_path: Path) -> None:
    hooks = Hooks(may_send=lambda message: message != SHARE)
    with house(tmp_path, users_file, hooks=hooks) as running:
        assert reaches_the_scene(running, "otto") == [CLICK, b"\xc1", CAMERA]
        assert reaches_the_scene(running, "vera") == [CAMERA]


def end_of(socket: ClientConnection) -> int | None:
    """The code with which the server closes a websocket, within 5 s of its last message."""
    try:
        while True:
            socket.recv(timeout=5)
    except ConnectionClosed as over:
        return None if over.rcvd is None else over.rcvd.code


def test_signing_out_closes_the_websockets(closed: House) -> None:
    for path in ("/ws", "/view"):
        with closed.client("otto") as client:
            token = client.cookies[closed.access.cookie]
            with closed.socket(path, token=token) as socket:
                assert client.post("/api/logout").status_code == 204
                assert end_of(socket) == 4401
            assert client.get("/api/me").status_code == 401


async def answer_to(app: ASGIApp, scope: Scope) -> list[dict[str, Any]]:
    """What an app says to a websocket that asks to be opened."""
    sent: list[dict[str, Any]] = []

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        sent.append({key: message[key] for key in ("type", "code")})

    await app(scope, receive, send)
    return sent


def test_the_gate_alone_turns_foreign_websockets_away(closed: House) -> None:
    """Whatever stands behind it: a new websocket need not think of it."""
    sent: list[dict[str, Any]] = []
    reached: list[Scope] = []

    async def behind(scope: Scope, receive: Receive, send: Send) -> None:
        reached.append(scope)

    gate = Gate(behind, closed.access)
    for origin in ("http://evil.example", "http://here"):
        cookie = f"{closed.access.cookie}={closed.token('otto')}".encode()
        headers = [(b"host", b"here"), (b"origin", origin.encode()), (b"cookie", cookie)]
        scope: Scope = {"type": "websocket", "path": "/new", "headers": headers, "scheme": "ws"}
        scope |= {"query_string": b"", "client": ("10.0.0.1", 1), "server": ("here", 80)}
        sent += asyncio.run(answer_to(gate, scope))
    assert sent == [{"type": "websocket.close", "code": 1008}]
    (scope,) = reached
    assert scope["state"]["person"] == Person("otto", "operator")


def test_another_password_signs_out(tmp_path: Path, users_file: Path) -> None:
    copy = tmp_path / "users.json"
    copy.write_bytes(users_file.read_bytes())
    copy.chmod(0o600)
    with house(tmp_path, copy) as running, running.client("otto") as client:
        with running.socket("/ws", "otto") as socket:
            assert client.get("/api/me").status_code == 200
            set_password(copy, "otto", "another password")
            assert end_of(socket) == 4401
        assert client.get("/api/me").status_code == 401


def test_another_role_counts_at_once(tmp_path: Path, users_file: Path) -> None:
    copy = tmp_path / "users.json"
    copy.write_bytes(users_file.read_bytes())
    copy.chmod(0o600)
    with house(tmp_path, copy) as running, running.client("otto") as client:
        assert client.post("/api/recording/marker", json={"text": "x"}).status_code == 204
        with running.socket("/ws", "otto") as socket:
            set_role(copy, "otto", "viewer")
            assert end_of(socket) == 4401
        assert client.post("/api/recording/marker", json={"text": "x"}).status_code == 403


def test_nobody_is_asked_where_the_program_was_told_so(tmp_path: Path) -> None:
    from backend.shell.access.access import LOCAL

    with house(tmp_path, everybody=LOCAL) as running, running.client() as anybody:
        me = anybody.get("/api/me").json()
        assert (me["who"], me["role"], me["how"]) == ("local", "supervisor", "no login")
        assert anybody.get("/").status_code == 200
        assert anybody.get("/login").headers["location"] == "/"
        foreign = {"Origin": "http://evil.example"}
        assert anybody.post("/api/recording/pin", headers=foreign).status_code == 403
        with pytest.raises(InvalidStatus):
            running.socket("/ws", origin="http://evil.example")


def test_without_access_the_app_asks_nobody_and_knows_nobody() -> None:
    from backend.shell.app.app import Sources, create_app
    from backend.shell.app.feed import Frames
    from backend.shell.hub import Hub

    sources = Sources({"machines": {}}, Frames(Hub(), lambda _: {}), dict, lambda _: None, dict)
    app = create_app(sources)
    assert app.state.access is None
    transport = httpx.ASGITransport(app=app)

    scope: Scope = {"type": "websocket", "path": "/ws", "scheme": "ws", "query_string": b""}
    scope |= {"headers": [(b"host", b"here"), (b"origin", b"http://evil.example")]}
    assert asyncio.run(answer_to(app, scope)) == [{"code": 1008, "type": "websocket.close"}]

    async def ask() -> int:
        async with httpx.AsyncClient(transport=transport, base_url="http://x") as client:
            return (await client.get("/api/site")).status_code

    assert asyncio.run(ask()) == 200
