"""The 3D view as a whole: a viser server on the loopback and the thread that keeps it current."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import rich
import viser
from viser import _messages

from backend.pipeline.records import Snapshot
from backend.spatial.types import Array
from cockpit.views import palette
from cockpit.views.browser import Browser, browser_of
from cockpit.views.cameras import ASPECT, CameraPose, camera_pose
from cockpit.views.inputs import SceneSite, SnapshotSource
from cockpit.views.scene import Scene
from cockpit.views.zone import KINDS

HEAD = (Path(__file__).parent / "client_head.html").read_text(encoding="utf-8")
"""Put in the head of viser's client page by whoever serves it to browsers."""

RATE = 25.0  # updates a second while somebody looks
IDLE_RATE = 2.0  # while nobody does
LOST_AFTER = 0.5  # [s] without a snapshot until nothing in the scene counts as known
FOLLOW_TIME = 0.35  # [s] in which the following camera makes up most of its lag


def open_server() -> viser.ViserServer:
    """A viser server on 127.0.0.1, on any free port, that never opens a public tunnel."""
    console = rich.get_console()
    quiet, console.quiet = console.quiet, True  # viser prints a panel of addresses otherwise
    try:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    finally:
        console.quiet = quiet
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(request)
    server.request_share_url = _no_tunnel  # type: ignore[method-assign]
    server.gui.configure_theme(
        dark_mode=True, show_logo=False, show_share_button=False, control_width="small"
    )
    server.gui.main_panel.minimize()
    server.scene.set_up_direction("+z")
    server.scene.world_axes.visible = False
    server.scene.set_background_image(np.full((2, 2, 3), palette.PAGE, np.uint8), format="png")
    return server


def _no_tunnel(*_: object, **__: object) -> NoReturn:
    raise PermissionError("the cockpit's scene is never shared through a public tunnel")


def start(
    site: SceneSite,
    source: SnapshotSource,
    own: str | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> View:
    """Open the scene of a site and keep it current until `stop`. own: the first own machine."""
    return View(open_server(), site, source, own or next(iter(site.machines)), clock)


class View:
    """The running scene. All methods may be called from any thread.

    A page is one browser window's token, told to `attach` by whoever lets its websocket through.
    Without a page, a choice is made for all browsers and for those that come later.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        site: SceneSite,
        source: SnapshotSource,
        own: str,
        clock: Callable[[], float],
    ) -> None:
        self._server = server
        self._site = site
        self._source = source
        self._clock = clock
        self._lock = threading.RLock()
        self._own = own
        self._camera = "site"
        self._browsers: dict[int, Browser] = {}
        self._following: dict[int, CameraPose] = {}
        self._ports: dict[str, int] = {}
        self._stopped = threading.Event()
        self._seen = self._framed = False
        with server.atomic():
            self._scene = Scene(server.scene, site)
        self._set_initial(None)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Where the scene is served on 127.0.0.1."""
        return self._server.get_port()

    def attach(self, page: str, local_port: int) -> None:
        """Page `page` connected to the scene from this local TCP port."""
        with self._lock:
            self._ports[page] = local_port

    def detach(self, page: str, local_port: int) -> None:
        """The connection of `attach` ended."""
        with self._lock:
            if self._ports.get(page) == local_port:
                del self._ports[page]

    def set_own(self, name: str, page: str | None = None) -> None:
        """Whose base and warning zones are drawn. Raises ValueError for an unknown machine."""
        if name not in self._site.machines:
            known = ", ".join(self._site.machines)
            raise ValueError(f'no machine "{name}"; there are {known}')
        with self._lock:
            clients = self._clients(page)
            if page is None:
                self._own = name
            for client_id, client in clients.items():
                old = self._browsers.get(client_id)
                if old is not None and old.own.own == name:
                    continue
                if old is not None:
                    old.remove()
                self._browsers[client_id] = browser_of(
                    client.scene, self._site, name, old, self._camera
                )
        snapshot = self._source.latest()
        if snapshot is not None:
            self._draw_own(snapshot)

    def set_camera(self, name: str, page: str | None = None) -> None:
        """Move a page's camera, or all. Raises ValueError naming the cameras there are."""
        snapshot = self._source.latest()
        camera_pose(name, self._site, snapshot, self._own)
        with self._lock:
            clients = self._clients(page)
            if page is None:
                self._camera = name
            for client_id, client in clients.items():
                browser = self._browsers.get(client_id)
                own = browser.own.own if browser is not None else self._own
                if browser is not None:
                    browser.looks = name
                pose = camera_pose(name, self._site, snapshot, own, client.camera.aspect)
                self._following.pop(client_id, None)
                if name == "follow":
                    self._following[client_id] = pose
                _aim(client, pose)

    def set_zone_kind(self, kind: str, page: str | None = None) -> None:
        """Which zones a page sees, or all: "exact" or "sun". Raises ValueError for another."""
        if kind not in KINDS:
            raise ValueError(f'no zones "{kind}"; there are {", ".join(KINDS)}')
        with self._lock:
            for client_id in self._clients(page):
                if client_id in self._browsers:
                    self._browsers[client_id].own.kind = kind

    def set_ghost(
        self, machine: str | None, joints: Mapping[str, float] | None, page: str | None = None
    ) -> None:
        """Show a machine in another posture in a page, or in all; without a machine, no ghost.

        joints: values by role [rad], the present ones where not named. Raises ValueError for a
        machine or joint that does not exist and for what is not a number.
        """
        posture = None if machine is None else self._posture(machine, joints or {})
        snapshot = self._source.latest()
        with self._lock:
            for client_id, client in self._clients(page).items():
                browser = self._browsers.get(client_id)
                if browser is None:
                    continue
                with client.atomic():
                    browser.show_ghost(client.scene, self._site, machine, posture)
                    if snapshot is not None:
                        browser.update_ghost(snapshot)

    def _posture(self, machine: str, joints: Mapping[str, float]) -> Array:
        """(n,) joint values of a ghost."""
        if machine not in self._site.machines:
            known = ", ".join(self._site.machines)
            raise ValueError(f'no machine "{machine}"; there are {known}')
        roles = [joint.role for joint in self._site.machines[machine].model.joints]
        snapshot = self._source.latest()
        q = np.zeros(len(roles))
        if snapshot is not None and machine in snapshot.machines:
            q = np.nan_to_num(snapshot.machines[machine].pose.joints)
        for role, value in joints.items():
            if role not in roles:
                raise ValueError(f'no joint "{role}"; there are {", ".join(roles)}')
            if not isinstance(value, int | float) or not abs(value) < 100.0:
                raise ValueError(f"joint {role} is {value!r}; allowed is an angle in radians")
            q[roles.index(role)] = value
        return q

    def stop(self) -> None:
        """Close the scene and free its port."""
        self._stopped.set()
        self._thread.join(timeout=2.0)
        console = rich.get_console()
        quiet, console.quiet = console.quiet, True
        try:
            self._server.stop()
        finally:
            console.quiet = quiet

    def _run(self) -> None:
        cycle, newest, drawn, last_new = -1, None, -np.inf, self._clock()
        while not self._stopped.is_set():
            snapshot = self._source.wait(cycle, 0.25)
            now = self._clock()
            if snapshot is not None:
                newest, cycle, last_new = snapshot, snapshot.cycle, now
            elif (latest := self._source.latest()) is not None and latest.cycle < cycle:
                newest, cycle, last_new = latest, latest.cycle, now  # a recording was rewound
            if newest is None:
                continue
            lost = now - last_new if now - last_new > LOST_AFTER else 0.0
            self._draw(newest, now, lost, now - drawn)
            drawn = now
            period = 1.0 / (RATE if self._browsers else IDLE_RATE)
            self._stopped.wait(max(0.0, period - (self._clock() - now)))

    def _draw(self, snapshot: Snapshot, now: float, lost: float, elapsed: float) -> None:
        with self._server.atomic():
            self._scene.update(snapshot, now, lost)
        self._draw_own(snapshot, lost)
        if not self._framed and all(
            name in snapshot.machines and snapshot.machines[name].body is not None
            for name in self._site.machines
        ):
            self._framed = True  # from here on, cameras move only when asked
            self._set_initial(snapshot)
            with self._lock:
                untouched = self._camera
            self.set_camera(untouched)
        self._follow(snapshot, elapsed)

    def _draw_own(self, snapshot: Snapshot, lost: float = 0.0) -> None:
        with self._lock:
            clients = self._server.get_clients()
            for client_id, browser in self._browsers.items():
                if client_id not in clients:
                    continue
                with clients[client_id].atomic():
                    browser.update(snapshot, self._source, self._scene.ground, lost)

    def _follow(self, snapshot: Snapshot, elapsed: float) -> None:
        """Cameras behind the own machine swing with it, a little late, so that they are calm."""
        with self._lock:
            clients = self._server.get_clients()
            share = 1.0 - float(np.exp(-min(elapsed, 1.0) / FOLLOW_TIME))
            for client_id, before in list(self._following.items()):
                browser = self._browsers.get(client_id)
                if client_id not in clients or browser is None:
                    continue
                goal = camera_pose("follow", self._site, snapshot, browser.own.own)
                if np.abs(goal.position - before.position).max() < 0.01:
                    continue
                pose = CameraPose(
                    before.position + share * (goal.position - before.position),
                    before.look_at + share * (goal.look_at - before.look_at),
                    goal.fov,
                )
                self._following[client_id] = pose
                _aim(clients[client_id], pose)

    def _set_initial(self, snapshot: Snapshot | None) -> None:
        pose = camera_pose(self._camera, self._site, snapshot, self._own)
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.fov = pose.position, pose.look_at, pose.fov

    def _connected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            if client.client_id not in self._browsers:
                self._browsers[client.client_id] = browser_of(
                    client.scene, self._site, self._own, None, self._camera
                )
        snapshot = self._source.latest()
        if client.camera.aspect < ASPECT:  # the initial camera would cut off both sides
            _aim(
                client,
                camera_pose(self._camera, self._site, snapshot, self._own, client.camera.aspect),
            )
        if snapshot is not None:
            self._draw_own(snapshot)

    def _disconnected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._browsers.pop(client.client_id, None)
            self._following.pop(client.client_id, None)

    def _clients(self, page: str | None) -> dict[int, viser.ClientHandle]:
        """The clients of a page; all without one; none of a page that is not connected."""
        clients = self._server.get_clients()
        if page is None:
            return clients
        port = self._ports.get(page)
        connections: dict[int, Any] = dict(self._server._websock_server._live_connections)
        return {
            client_id: client
            for client_id, client in clients.items()
            if client_id in connections and connections[client_id].remote_address[1] == port
        }


def _aim(client: viser.ClientHandle, pose: CameraPose) -> None:
    with client.atomic():
        client.camera.position = pose.position
        client.camera.look_at = pose.look_at
        if abs(client.camera.fov - pose.fov) > 1e-6:
            client.camera.fov = pose.fov
