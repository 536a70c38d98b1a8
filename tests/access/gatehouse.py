"""The real app behind its gate, on a real port, with nothing behind it."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
from fastapi import APIRouter, FastAPI
from websockets.sync.client import ClientConnection, connect
from websockets.sync.server import ServerConnection, serve
from websockets.typing import Subprotocol

from backend.control.person import Person
from backend.shell.access.access import Access
from backend.shell.access.audit import Audit
from backend.shell.access.links import Links
from backend.shell.access.sessions import Sessions
from backend.shell.access.tls import Tls
from backend.shell.access.users import Users, add_user, read_users, seal_of
from backend.shell.app.app import Sources, create_app
from backend.shell.app.cameras import camera_router
from backend.shell.app.feed import Frames
from backend.shell.app.recording import RecordingSources
from backend.shell.app.server import WebServer, bind
from backend.shell.app.session_api import session_router
from backend.shell.app.viewer_proxy import Hooks, viewer_router
from backend.shell.camera.multipart import Part
from backend.shell.camera.sharing import Pictures, SharedCamera
from backend.shell.hub import Hub

PROTOCOL = Subprotocol("viser-v1.1.1")
PASSWORD = "correct horse battery"
PEOPLE = {"vera": "viewer", "otto": "operator", "susi": "supervisor"}
HTML = {"Accept": "text/html"}


class Playback:
    """A session without anything in it."""

    def session(self) -> dict[str, Any]:
        return {}

    def series(self, *_: Any) -> dict[str, Any]:
        return {}

    def start_diff(self) -> None:
        return None

    def diff(self) -> dict[str, Any]:
        return {}

    def file(self, kind: str) -> Path:
        raise AssertionError(f"{kind}: nobody asks for a file here")


async def dark() -> Pictures:
    """A camera that shows nothing."""
    await asyncio.sleep(3600.0)
    yield Part(b"", None)


class Clock:
    def __init__(self) -> None:
        self.now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@dataclass
class Scene:
    """Stands in for the 3D scene's server: keeps what reaches it."""

    port: int = 0
    heard: list[bytes] = field(default_factory=list)

    @contextlib.contextmanager
    def serving(self) -> Iterator[None]:
        def handle(connection: ServerConnection) -> None:
            for message in connection:
                assert isinstance(message, bytes)
                self.heard.append(message)
                connection.send(b"heard")

        with serve(handle, "127.0.0.1", 0, subprotocols=[PROTOCOL]) as server:
            self.port = server.socket.getsockname()[1]
            thread = threading.Thread(target=server.serve_forever, daemon=True)
            thread.start()
            yield
            server.shutdown()


@dataclass
class House:
    """A running app. token: of a session of somebody without the login's work."""

    app: FastAPI
    access: Access
    url: str
    scene: Scene
    said: list[dict[str, Any]]
    verify: Any = True

    def token(self, who: str) -> str:
        assert self.access.users is not None
        user = read_users(self.access.users.path)[who]
        return self.access.sessions.begin(Person(who, user.role), "password", seal_of(user))

    def client(self, who: str | None = None, **headers: str) -> httpx.Client:
        client = httpx.Client(
            base_url=self.url, headers=headers, verify=self.verify, trust_env=False
        )
        if who is not None:
            client.cookies.set(self.access.cookie, self.token(who))
        return client

    def socket(
        self,
        path: str,
        who: str | None = None,
        origin: str | None = "here",
        token: str | None = None,
    ) -> ClientConnection:
        """A websocket of somebody's new session, or of the one that has this token."""
        return connect(**self.handshake(path, who, origin, token))

    def handshake(
        self,
        path: str,
        who: str | None = None,
        origin: str | None = "here",
        token: str | None = None,
    ) -> dict[str, Any]:
        """What a websocket client is given to open such a one."""
        token = self.token(who) if who is not None else token
        return {
            "uri": self.url.replace("http", "ws", 1) + path,
            "origin": self.url if origin == "here" else origin,
            "subprotocols": [PROTOCOL] if path.startswith("/view") else None,
            "additional_headers": {}
            if token is None
            else {"Cookie": f"{self.access.cookie}={token}"},
            "proxy": None,
            "max_size": None,
        }


def make_users(folder: Path) -> Path:
    """A users file with one of each role; made once, copied where it is changed."""
    path = folder / "users.json"
    for name, role in PEOPLE.items():
        add_user(path, name, role, PASSWORD)
    return path


@contextlib.contextmanager
def house(
    folder: Path,
    users: Path | None = None,
    *,
    links: Links | None = None,
    tls: Tls | None = None,
    sessions: Sessions | None = None,
    hooks: Hooks | None = None,
    routers: tuple[APIRouter, ...] = (),
    **more: Any,
) -> Iterator[House]:
    scene, said = Scene(), []
    access = Access(
        sessions or Sessions(),
        Audit(folder / "audit.jsonl"),
        cookie="__Host-cockpit" if tls else "cockpit",
        users=None if users is None else Users(users),
        links=links,
        https=tls is not None,
        **more,
    )
    hub = Hub()
    sources = Sources(
        site={"mode": "DEMO", "machines": {}},
        frames=Frames(hub, lambda _: {}),
        backend=lambda: {"failure": None},
        on_message=said.append,
        what_if=lambda machine, joints: {},
        recording=RecordingSources(dict, lambda name, seconds: folder, lambda text: None),
    )
    app = create_app(
        sources,
        viewer_router(lambda: scene.port, hooks or Hooks()),
        hosts=("127.0.0.1", "localhost"),
        routers=(
            *(session_router(Playback()), camera_router({"x/x": SharedCamera(dark)})),
            *routers,
        ),
        access=access,
    )
    listener = bind("127.0.0.1", 0)
    server = WebServer(app, listener, tls)
    with scene.serving():
        server.start()
        scheme = "http" if tls is None else "https"
        try:
            yield House(app, access, f"{scheme}://127.0.0.1:{server.port}", scene, said)
        finally:
            server.stop()
            access.close()
