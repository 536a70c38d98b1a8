"""One running cockpit: link, pipeline, scene and page wired together."""

from __future__ import annotations

import contextlib
import gc
import math
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from backend.cspace.resolution import resolution
from backend.documents.site import site_document
from backend.documents.snapshot import snapshot_document
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters
from backend.pipeline.records import Snapshot
from backend.pipeline.whatif import touches, what_if
from backend.safety.partner import Limits
from backend.shell.app.app import Sources, create_app
from backend.shell.app.feed import Frames
from backend.shell.app.server import WebServer, bind
from backend.shell.app.viewer_proxy import Hooks, viewer_router
from backend.shell.app.wire import dumps
from backend.shell.hub import Hub, OncePerSnapshot
from backend.shell.image_worker import ImageWorker
from backend.shell.kinds import EXACT, REGIONS, SUN, ZONE, Recipe, Wishes
from backend.shell.link.receiver import Receiver
from backend.shell.link.relay import Relay
from backend.shell.link.session import open_session
from backend.shell.link.source import LinkSource
from backend.shell.runner import ImageLoop, Runner
from backend.site.bodies import site_bodies
from backend.site.site import Site
from backend.spatial.types import Array
from cockpit.views.inputs import scene_site
from cockpit.views.server import HEAD, View, start

MAX_HEIGHT = 50.0  # of a picked bucket tip above or below the swing joint [m]
_LOOPS = (("images", (SUN, EXACT), "image_hz"), ("zones", (ZONE, REGIONS), "zone_hz"))
"""Name, kinds, and which of the site's rates; each loop has a process of its own."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True)
class Options:
    """host, port: of the page; listen, connect: Zenoh endpoints; own: machines answered for."""

    host: str
    port: int
    listen: tuple[str, ...]
    connect: tuple[str, ...]
    own: tuple[str, ...]
    mode: str


def load_models(site: Site) -> dict[str, Machine]:
    """Every machine's description; a bar is shown while bodies are fitted to meshes."""
    models: dict[str, Machine] = {}
    loaded: dict[tuple[str, str | None], Machine] = {}
    with Progress(console=Console(stderr=True), transient=True) as bar:
        for machine in site.machines:
            key = (machine.model, machine.sidecar)
            if key not in loaded:
                task = bar.add_task(f"{machine.name}: {machine.model}", total=1.0)

                def progress(text: str, share: float, task: Any = task) -> None:
                    bar.update(task, completed=share, description=text)

                sidecar = None if machine.sidecar is None else site.folder / machine.sidecar
                try:
                    loaded[key] = load_machine(machine.model, sidecar, site.folder, progress)
                except InputError as error:
                    raise InputError(f"{site.path}: machine {machine.name}: {error}") from error
                bar.update(task, completed=1.0)
            models[machine.name] = loaded[key]
    return models


def make_config(site: Site, models: dict[str, Machine], own: tuple[str, ...], mode: str) -> Config:
    """The pipeline's configuration; `own` empty means every machine."""
    for name in own:
        site.machine(name)
    return Config(
        frame=site.frame,
        machines=models,
        labels={machine.name: machine.label for machine in site.machines},
        own=own or tuple(models),
        limits=Limits(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode=mode,
        site=site_bodies(site),
    )


class Station:
    """Everything of one backend process. demo_began: wall time of the demo script's start [s]."""

    def __init__(
        self,
        site: Site,
        options: Options,
        demo_began: Callable[[], float] | None = None,
    ) -> None:
        listener = bind(options.host, options.port)
        self._closing = contextlib.ExitStack()
        self._closing.callback(listener.close)
        try:
            self._build(site, options, demo_began, listener)
        except BaseException:
            self.close()
            raise

    def _build(
        self,
        site: Site,
        options: Options,
        demo_began: Callable[[], float] | None,
        listener: Any,
    ) -> None:
        # The fast loop must not wait 5 ms, the default, for another thread to hand over.
        sys.setswitchinterval(0.001)
        models = load_models(site)
        self.config = make_config(site, models, options.own, options.mode)
        self._demo_began = demo_began
        self._tip_heights: dict[str, float] = {}
        self.hub = Hub()
        self.document = OncePerSnapshot(self._document)
        session = open_session(options.listen, options.connect, mode="router")
        self._closing.callback(session.close)
        prefixes = {machine.prefix: machine.name for machine in site.machines}
        self.receiver = Receiver(session, prefixes)
        self._closing.callback(self.receiver.close)
        self.runner = Runner(
            self.config,
            [self._image_loop(*loop, site) for loop in _LOOPS],
            LinkSource(self.receiver),
            self.hub,
            site.rates.step_hz,
            lambda: Wishes(dict(self._tip_heights)),
        )
        frames = Frames(self.hub, self.document)
        relay = Relay(session, self.hub, self._texts, frames.images)
        self.view: View = start(scene_site(site, models), self.hub, own=self.config.own[0])
        self._closing.callback(self.view.stop)
        sources = Sources(
            site=site_document(site, self.config),
            frames=frames,
            backend=self.backend,
            on_message=self._on_message,
            what_if=self._what_if,
        )
        hooks = Hooks(opened=self.view.attach, closed=self.view.detach)
        loopback = options.host in LOOPBACK
        app = create_app(
            sources,
            viewer_router(lambda: self.view.port, hooks, HEAD),
            hosts=LOOPBACK if loopback else ("*",),
        )
        self.web = WebServer(app, listener)
        self.runner.start()
        self._closing.callback(self.runner.stop)
        relay.start()
        self._closing.callback(relay.stop)
        self.web.start()
        self._closing.callback(self.web.stop)
        # What is loaded by now stays: without this, the collector would walk through all of it
        # again and again, and each walk holds up the fast loop.
        gc.collect()
        gc.freeze()

    def _image_loop(self, name: str, kinds: tuple[str, ...], rate: str, site: Site) -> ImageLoop:
        sun = SunParameters(site.sun.m, site.sun.n, site.sun.eta)
        worker = ImageWorker(Recipe(self.config, sun, kinds))
        self._closing.callback(worker.close)
        return ImageLoop(name, getattr(site.rates, rate), worker)

    def close(self) -> None:
        """Close everything, in the reverse order of opening."""
        self._closing.close()

    def _document(self, snapshot: Snapshot) -> dict[str, Any]:
        """A snapshot as plain JSON, with what only a running backend knows."""
        document = snapshot_document(snapshot, self.config)
        rate = self.runner.image_timing["images"].timing().rate
        if rate > 0.0:
            document["resolution"] = _resolutions(snapshot, self.config, 1.0 / rate)
        document["backend"] = self.backend()
        if self._demo_began is not None:
            document["demo"] = {"elapsed": time.time() - self._demo_began()}
        return document

    def _texts(self, snapshot: Snapshot) -> tuple[str, str]:
        document = self.document(snapshot)
        return dumps(document), dumps(document["alarms"])

    def backend(self) -> dict[str, Any]:
        """Live timings of both loops."""
        return {
            "step": vars(self.runner.step_timing.timing()),
            **{name: vars(watch.timing()) for name, watch in self.runner.image_timing.items()},
            "failure": self.runner.failure,
        }

    def _what_if(self, own: str, joints: dict[str, float]) -> dict[str, Any]:
        """python-fcl's verdict on a posture of `own`; joints that are not named stay."""
        snapshot = self.hub.latest()
        if own not in self.config.own:
            known = ", ".join(self.config.own)
            raise InputError(f'machine is "{own}"; allowed are {known}.')
        if snapshot is None:
            raise InputError("no cycle has finished yet; try again.")
        q = self._posture(own, joints, snapshot)
        found = what_if(snapshot, self.config, own, q)
        roles = [joint.role for joint in self.config.machines[own].joints]
        posture = dict(zip(roles, q.tolist(), strict=True))
        return {**asdict(found), "joints": posture, "checked_by": "python-fcl"}

    def _posture(self, own: str, joints: dict[str, float], snapshot: Snapshot) -> Array:
        """(n,) the present joint values of a machine with those of `joints` in their places."""
        machine = self.config.machines[own]
        roles = [joint.role for joint in machine.joints]
        unknown = [role for role in joints if role not in roles]
        if unknown:
            raise InputError(f"joints.{unknown[0]} is unknown; allowed are {', '.join(roles)}.")
        q = snapshot.machines[own].pose.joints.copy()
        for role, value in joints.items():
            if not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"joints.{role} is {value!r}; allowed is an angle in radians.")
            q[roles.index(role)] = value
        return q

    def _on_message(self, message: dict[str, Any]) -> None:
        """What a page asks of the scene and the images; anything else is ignored."""
        page, name = message.get("page"), message.get("name", message.get("machine"))
        kind = message.get("type")
        if not (page is None or isinstance(page, str)):
            return
        with contextlib.suppress(ValueError, InputError):
            if kind == "ghost":
                self._show_ghost(name, message.get("joints"), page)
            elif kind == "zones":
                self.view.set_zone_kind(str(message.get("kind")), page)
            elif not isinstance(name, str):
                return
            elif kind == "camera":
                self.view.set_camera(name, page)
            elif kind == "own":
                self.view.set_own(name, page)
            elif kind == "tip_height" and name in self.config.own:
                self._pick_height(name, message.get("height"))

    def _show_ghost(self, machine: Any, joints: Any, page: str | None) -> None:
        """A ghost in another posture; red where it would touch something."""
        snapshot = self.hub.latest()
        if machine is None or not isinstance(joints, dict) or snapshot is None:
            self.view.set_ghost(None, page=page)
            return
        touched = None
        if machine in self.config.own:
            q = self._posture(machine, joints, snapshot)
            touched = touches(snapshot, self.config, machine, q)
        self.view.set_ghost(machine, joints, page, touched)

    def _pick_height(self, own: str, height: Any) -> None:
        """The height of a machine's reach image, for all pages; None: as the tip is."""
        if height is None:
            self._tip_heights.pop(own, None)
        elif isinstance(height, int | float) and abs(height) < MAX_HEIGHT:
            self._tip_heights[own] = float(height)


def _resolutions(
    snapshot: Snapshot, config: Config, cycle_time: float
) -> dict[str, dict[str, Any]]:
    """Sun 2020, Section 5.1, per machine, at the rate that images really have."""
    found = {}
    for name, state in snapshot.machines.items():
        speed = float(np.linalg.norm(state.pose.base_velocity))
        if not math.isfinite(speed):
            continue
        now = resolution(cycle_time, speed, state.pose.joint_velocities)
        roles = [joint.role for joint in config.machines[name].joints]
        found[name] = {
            "points_per_m": now.points_per_metre,
            "points_per_rad": dict(zip(roles, now.points_per_radian.tolist(), strict=True)),
        }
    return found
