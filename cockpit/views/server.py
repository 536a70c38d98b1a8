"""The 3D view as a whole: a viser server on the loopback and the thread that keeps it current."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import rich
import viser

from backend.perception.stages import StagedScan
from backend.pipeline.records import Snapshot
from cockpit.views.browser import Browser
from cockpit.views.cameras import ASPECT, CameraPose, camera_pose
from cockpit.views.ghost import checked_joints
from cockpit.views.inputs import SceneSite, SnapshotSource
from cockpit.views.opening import open_server
from cockpit.views.scene import Scene
from cockpit.views.stage_nodes import SHOWN
from cockpit.views.use_case_nodes import Played, Shown
from cockpit.views.zone import EXACT, ZONE_KINDS

RATE = 25.0  # updates a second while somebody looks
IDLE_RATE = 2.0  # while nobody does
LOST_AFTER = 0.5  # [s] without a snapshot until nothing in the scene counts as known
STAGES_ASKED = 6.0  # [s] for which stages are shown; a page asks again while it shows them
FOLLOW_TIME = 0.35  # [s] in which the following camera makes up most of its lag

Stages = Callable[[], StagedScan | None]


def start(
    site: SceneSite,
    source: SnapshotSource,
    own: str | None = None,
    clock: Callable[[], float] = time.monotonic,
    stages: Stages = lambda: None,
) -> View:
    """Open the scene of a site and keep it current until `stop`. own: the first own machine;
    stages: the newest of detection, asked for while somebody looks at them.
    """
    return View(open_server(), site, source, own or next(iter(site.machines)), clock, stages)


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
        stages: Stages = lambda: None,
    ) -> None:
        self._server = server
        self._site = site
        self._source = source
        self._clock = clock
        self._stages = stages
        self._lock = threading.RLock()
        self._own = own
        self._camera = "site"
        self._zone_kind = EXACT
        self._browsers: dict[int, Browser] = {}
        self._ports: dict[str, int] = {}
        self._stopped = threading.Event()
        self._framed = False
        self._lost = 0.0
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
        self._check_machine(name)
        with self._lock:
            if page is None:
                self._own = name
            for browser in self._of(page):
                browser.own = name
        self._draw_own_now()

    def set_zone_kind(self, kind: str, page: str | None = None) -> None:
        """Which warning zones are drawn: "exact" (Sun's while there is none) or "sun".

        Raises ValueError for anything else.
        """
        if kind not in ZONE_KINDS:
            raise ValueError(f'no zone kind "{kind}"; there are {", ".join(ZONE_KINDS)}')
        with self._lock:
            if page is None:
                self._zone_kind = kind
            for browser in self._of(page):
                browser.zone_kind = kind
        self._draw_own_now()

    def set_stages(self, shown: Iterable[str], page: str | None = None) -> None:
        """Which stages of detection are drawn for the next STAGES_ASKED seconds; none of none.

        page: without one, in all browsers there are now. Raises ValueError for what cannot be
        shown.
        """
        wanted = frozenset(shown)
        if unknown := sorted(wanted - set(SHOWN)):
            raise ValueError(f'no stage "{unknown[0]}"; there are {", ".join(SHOWN)}')
        until = self._clock() + STAGES_ASKED
        with self._lock:
            new = [browser.show_stages(wanted, until) for browser in self._of(page)]
        if any(new):
            self._draw_own_now()

    def set_ghost(
        self,
        machine: str | None,
        joints: Mapping[str, float] | None = None,
        page: str | None = None,
        colliding: bool | None = None,
    ) -> None:
        """Show what `machine` would look like at these joint values, in place of the ghost before.

        machine: None hides the ghost; joints: by role [rad], those left out stay as they are;
        page: without one, in all browsers there are now; colliding: the verdict on the posture,
        None while there is none. Raises ValueError for an unknown machine or joint and for values
        that are not finite.
        """
        wanted = None
        if machine is not None:
            self._check_machine(machine)
            wanted = checked_joints(self._site.machines[machine].model, joints)
        with self._lock:
            for browser in self._of(page):
                with browser.client.atomic():
                    browser.show_ghost(machine, wanted, colliding)
        self._draw_own_now()

    def set_use_case(
        self, run: Played | None, at: float = 0.0, rate: float = 1.0, page: str | None = None
    ) -> None:
        """Play a run of a use case as a ghost, from `at` [s] on and `rate` times as fast as it was;
        for a short time: a page asks again while it shows it. None takes it out of sight.

        page: without one, in all browsers there are now. Raises ValueError for an unknown machine.
        """
        shown = None
        if run is not None:
            self._check_machine(run.machine)
            shown = Shown(run, at, rate, self._clock())
        with self._lock:
            for browser in self._of(page):
                browser.show_use_case(shown)
        self._draw_own_now()

    def set_camera(self, name: str, page: str | None = None) -> None:
        """Move a page's camera, or all. Raises ValueError naming the cameras there are."""
        snapshot = self._source.latest()
        camera_pose(name, self._site, snapshot, self._own)
        with self._lock:
            if page is None:
                self._camera = name
                self._set_initial(snapshot)
            for browser in self._of(page):
                client = browser.client
                pose = camera_pose(name, self._site, snapshot, browser.own, client.camera.aspect)
                browser.camera = name
                browser.following = pose if name == "follow" else None
                _aim(client, pose)
        self._draw_own_now()

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
        self._lost = lost
        self._draw_own(snapshot, now, lost)
        if not self._framed and all(
            name in snapshot.machines and snapshot.machines[name].body is not None
            for name in self._site.machines
        ):
            self._framed = True  # from here on, cameras move only when asked
            with self._lock:
                untouched = self._camera
            self.set_camera(untouched)
        self._follow(snapshot, elapsed)

    def _draw_own(self, snapshot: Snapshot, now: float, lost: float) -> None:
        with self._lock:
            browsers = self._of(None)
            looked = any(browser.looks_at_stages(now) for browser in browsers)
            stages = self._stages() if looked else None
            for browser in browsers:
                try:
                    browser.update(snapshot, self._source, self._scene.ground, now, lost)
                    browser.update_stages(stages, now)
                except RuntimeError:
                    # Its window was closed meanwhile, and viser has removed its nodes. Should the
                    # window still be there after all, the next turn makes them anew.
                    self._browsers.pop(browser.client.client_id, None)

    def _draw_own_now(self) -> None:
        """What was just chosen shows at once, without waiting for the next snapshot."""
        snapshot = self._source.latest()
        if snapshot is not None:
            self._draw_own(snapshot, self._clock(), self._lost)

    def _follow(self, snapshot: Snapshot, elapsed: float) -> None:
        """Cameras behind the own machine swing with it, a little late, so that they are calm."""
        share = 1.0 - float(np.exp(-min(elapsed, 1.0) / FOLLOW_TIME))
        with self._lock:
            for browser in self._of(None):
                before = browser.following
                if before is None:
                    continue
                goal = camera_pose("follow", self._site, snapshot, browser.own)
                if np.abs(goal.position - before.position).max() < 0.01:
                    continue
                browser.following = CameraPose(
                    before.position + share * (goal.position - before.position),
                    before.look_at + share * (goal.look_at - before.look_at),
                    goal.fov,
                )
                _aim(browser.client, browser.following)

    def _set_initial(self, snapshot: Snapshot | None) -> None:
        pose = camera_pose(self._camera, self._site, snapshot, self._own)
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.fov = pose.position, pose.look_at, pose.fov

    def _connected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            if client.client_id not in self._browsers:
                self._browsers[client.client_id] = Browser(
                    client, self._site, self._own, self._camera, self._zone_kind
                )
        snapshot = self._source.latest()
        if client.camera.aspect < ASPECT:  # the initial camera would cut off both sides
            _aim(
                client,
                camera_pose(self._camera, self._site, snapshot, self._own, client.camera.aspect),
            )
        self._draw_own_now()

    def _disconnected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._browsers.pop(client.client_id, None)

    def _check_machine(self, name: str) -> None:
        if name not in self._site.machines:
            known = ", ".join(self._site.machines)
            raise ValueError(f'no machine "{name}"; there are {known}')

    def _of(self, page: str | None) -> list[Browser]:
        """The connected browsers of a page; all without one; none of an unknown page."""
        found = []
        for client_id, client in self._clients(page).items():
            if client_id not in self._browsers:
                try:
                    self._browsers[client_id] = Browser(
                        client, self._site, self._own, self._camera, self._zone_kind
                    )
                except RuntimeError:
                    continue  # its window was closed while its nodes were made
            found.append(self._browsers[client_id])
        return found

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
