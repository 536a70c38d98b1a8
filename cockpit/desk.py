"""What a page asks of a running cockpit, live or in playback; nothing here can reach a machine."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import Progress

from backend.control.person import Person
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters
from backend.pipeline.records import Snapshot
from backend.safety.partner import Limits
from backend.safety.people import Watch
from backend.safety.swing_risk import Boundaries
from backend.safety.tip_over import TipOver
from backend.shell.aside import NICENESS, SLOW
from backend.shell.hub import Hub
from backend.shell.image_loops import ImageLoop, ImageMaker
from backend.shell.image_worker import ImageWorker
from backend.shell.kinds import ALONG, AROUND, EXACT, REGIONS, SUN, ZONE, Made, Recipe, Wishes
from backend.shell.recent import Recent
from backend.site.bodies import site_bodies
from backend.site.site import Site
from backend.site.tables import People
from backend.spatial.types import Array

if TYPE_CHECKING:
    from cockpit.views.server import View
    from cockpit.views.use_case_nodes import Played

MAX_HEIGHT = 50.0  # of a picked bucket tip above or below the swing joint [m]
_LOOPS = (
    ("images", (SUN, EXACT), "image_hz", NICENESS),
    ("zones", (ZONE, REGIONS), "zone_hz", SLOW),
)
"""Name, kinds, which of the site's rates, and niceness; each loop has a process of its own."""

ALONG_HZ = 0.5
"""How often strips along tracks are made, while somebody looks at them."""

SHARED = frozenset({"marker", "silence", "tip_height", "playback"})
"""Kinds of messages that change what others see; the rest is of the page that sends it."""


def may_say(message: dict[str, Any], person: Person | None) -> bool:
    """Whether a page's message is obeyed: who only looks changes nothing that others see."""
    return message.get("type") not in SHARED or (person is not None and person.may_drive)


def load_models(site: Site) -> dict[str, Machine]:
    """Every machine's description; a bar is shown while bodies are fitted to meshes."""
    models: dict[str, Machine] = {}
    loaded: dict[tuple[str, str | None], Machine] = {}
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
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
    if site.watch is not None and not any(model.lidars for model in models.values()):
        raise InputError(
            f"{site.path}: people are watched for, but no machine has a LiDAR; needed is "
            "[[lidar]] in the sidecar of at least one."
        )
    return Config(
        frame=site.frame,
        machines=models,
        labels={machine.name: machine.label for machine in site.machines},
        own=own or tuple(models),
        limits=Limits(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode=mode,
        site=site_bodies(site),
        people=None if site.watch is None else _watch(site.watch),
        stability=_tip_over(site),
    )


def _tip_over(site: Site) -> TipOver:
    table = site.stability
    carried = {m.name: m.payload for m in site.machines if m.payload is not None}
    return TipOver(table.keep, table.slow, carried, table.limits, table.required)


def _watch(table: People) -> Watch:
    return Watch(
        slow_below=table.slow_below,
        stop_below=table.stop_below,
        walking=table.walking,
        stale=table.stale,
        boundaries=Boundaries(table.index, table.ttc),
    )


def image_loops(site: Site, config: Config, closing: contextlib.ExitStack) -> tuple[ImageLoop, ...]:
    """All loops that make images of a site, each with a process that ends with `closing`."""
    sun = SunParameters(site.sun.m, site.sun.n, site.sun.eta)
    loops = []
    for name, kinds, rate, niceness in _LOOPS:
        worker = ImageWorker(Recipe(config, sun, kinds), niceness)
        closing.callback(worker.close)
        loops.append(ImageLoop(name, getattr(site.rates, rate), worker))
    worker = ImageWorker(Recipe(config, sun, (AROUND,)), SLOW)
    closing.callback(worker.close)
    loops.append(ImageLoop(AROUND, site.rates.zone_hz, OnceThereIs(worker, config)))
    return tuple(loops)


def along_loops(site: Site, config: Config, closing: contextlib.ExitStack) -> tuple[ImageLoop, ...]:
    """The loop that makes strips along tracks; none on a site without."""
    if not (site.gauge.track or site.gauge.source):
        return ()
    # Only a site with tracks loads what makes them.
    from backend.site.travel import site_ways

    ways = site_ways(site)
    if not ways:
        return ()
    sun = SunParameters(site.sun.m, site.sun.n, site.sun.eta)
    worker = ImageWorker(Recipe(config, sun, (ALONG,), ways=ways), SLOW)
    closing.callback(worker.close)
    return (ImageLoop(ALONG, ALONG_HZ, WhenAsked(worker)),)


class OnceThereIs:
    """Starts a worker's process only once there is something around the machines: people, or
    anything on the site; from then on it is told, too, when that is gone.
    """

    def __init__(self, worker: ImageMaker, config: Config) -> None:
        self._worker = worker
        self._found = len(config.site.names) > 0

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]:
        self._found |= snapshot.people is not None or bool(snapshot.gauge.choice.drawn)
        return self._worker.make(snapshot, wishes) if self._found else []


class WhenAsked:
    """Starts a worker's process only once somebody looks at what it makes."""

    def __init__(self, worker: ImageWorker) -> None:
        self._worker = worker

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]:
        return self._worker.make(snapshot, wishes) if wishes.recent else []


class Desk:
    """Answers pages: what-if, ghosts, cameras, heights of reach images, strips along tracks.

    view: the 3D scene's, None while it starts; action: told what an operator did, on which
    page, with what details; ready: whether what judges postures is loaded; played: a run by the
    names of use case and method, previewed: one by those of machine and plan, None where there is
    none.
    """

    def __init__(
        self,
        config: Config,
        hub: Hub,
        view: Callable[[], View | None],
        action: Callable[[str, str | None, dict[str, Any]], None] = lambda *_: None,
        ready: Callable[[], bool] = lambda: True,
        played: Callable[[str, str], Played | None] = lambda *_: None,
        previewed: Callable[[str, str], Played | None] = lambda *_: None,
    ) -> None:
        self._config = config
        self._hub = hub
        self._view = view
        self._action = action
        self._ready = ready
        self._played, self._previewed = played, previewed
        self._tip_heights: dict[str, float] = {}
        self.recent = Recent()

    def wishes(self) -> Wishes:
        """What operators chose of the images."""
        return Wishes(dict(self._tip_heights), self.recent.wanted())

    def what_if(self, own: str, joints: dict[str, float]) -> dict[str, Any]:
        """python-fcl's verdict on a posture of `own`; joints that are not named stay."""
        snapshot = self._hub.latest()
        if own not in self._config.own:
            known = ", ".join(self._config.own)
            raise InputError(f'machine is "{own}"; allowed are {known}.')
        if snapshot is None:
            raise InputError("no cycle has finished yet; try again.")
        if not self._ready():
            raise InputError("what judges postures is still being loaded; try again.")
        from backend.pipeline.whatif import what_if

        q = self._posture(own, joints, snapshot)
        self._action("whatif", None, {"machine": own, "joints": joints})
        found = what_if(snapshot, self._config, own, q)
        roles = [joint.role for joint in self._config.machines[own].joints]
        posture = dict(zip(roles, q.tolist(), strict=True))
        return {**asdict(found), "joints": posture, "checked_by": "python-fcl"}

    def on_message(self, message: dict[str, Any]) -> None:
        """What a page asks of the scene and the images; anything else is ignored."""
        page, name = message.get("page"), message.get("name", message.get("machine"))
        kind = message.get("type")
        if not (page is None or isinstance(page, str)):
            return
        if kind == "along":  # again and again while it is looked at: nothing to record
            if isinstance(name, str) and name in self._config.own:
                self.recent.ask(name)
            return
        view = self._view()
        if kind == "stages":  # likewise
            shown = message.get("shown")
            if view is not None and isinstance(shown, list) and all(map(_is_text, shown)):
                with contextlib.suppress(ValueError):
                    view.set_stages(shown, page)
            return
        if kind in ("use_case", "plan"):  # likewise
            if view is not None:
                self._show_run(view, message, page)
            return
        if isinstance(kind, str):
            self._action(kind, page, message)
        with contextlib.suppress(ValueError, InputError):
            if view is not None and kind == "ghost":
                self._show_ghost(view, name, message.get("joints"), page)
            elif view is not None and kind == "zones":
                view.set_zone_kind(str(message.get("kind")), page)
            elif not isinstance(name, str):
                return
            elif kind == "tip_height" and name in self._config.own:
                self._pick_height(name, message.get("height"))
            elif view is None:
                return
            elif kind == "camera":
                view.set_camera(name, page)
            elif kind == "own":
                view.set_own(name, page)

    def _posture(self, own: str, joints: dict[str, float], snapshot: Snapshot) -> Array:
        """(n,) the present joint values of a machine with those of `joints` in their places."""
        machine = self._config.machines[own]
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

    def _show_ghost(self, view: View, machine: Any, joints: Any, page: str | None) -> None:
        """A ghost in another posture; red where it would touch something."""
        snapshot = self._hub.latest()
        if machine is None or not isinstance(joints, dict) or snapshot is None:
            view.set_ghost(None, page=page)
            return
        touched = None
        if machine in self._config.own and self._ready():
            from backend.pipeline.whatif import touches

            q = self._posture(machine, joints, snapshot)
            touched = touches(snapshot, self._config, machine, q)
        view.set_ghost(machine, joints, page, touched)

    def _show_run(self, view: View, message: dict[str, Any], page: str | None) -> None:
        """A use case or a plan from one of its moments on; none takes the ghost away."""
        if message["type"] == "plan":
            find, named = self._previewed, (message.get("machine"), message.get("plan"))
        else:
            find, named = self._played, (message.get("name"), message.get("method"))
        at, rate = message.get("at", 0.0), message.get("rate", 0.0)
        run = find(*named) if all(map(_is_text, named)) else None
        if all(isinstance(v, int | float) and math.isfinite(v) for v in (at, rate)):
            with contextlib.suppress(ValueError):
                view.set_use_case(run, float(at), float(rate), page)

    def _pick_height(self, own: str, height: Any) -> None:
        """The height of a machine's reach image, for all pages; None: as the tip is."""
        if height is None:
            self._tip_heights.pop(own, None)
        elif isinstance(height, int | float) and abs(height) < MAX_HEIGHT:
            self._tip_heights[own] = float(height)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)
