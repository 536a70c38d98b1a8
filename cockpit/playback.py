"""One running playback: a recorded session, the 3D scene and the page.

Nothing here opens a link: there is no session to a machine through which anything could be sent,
whatever a page asks. A test sees to it that this module does not even load the library.
"""

from __future__ import annotations

import contextlib
import sys
import tomllib
from dataclasses import dataclass
from importlib import import_module as load
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import Progress

from backend.control.person import Person
from backend.documents.site import site_document
from backend.documents.snapshot import snapshot_document
from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.shell.app.app import Sources, create_app
from backend.shell.app.feed import Frames
from backend.shell.app.gauge_api import gauge_router
from backend.shell.app.server import WebServer, bind
from backend.shell.app.session_api import session_router
from backend.shell.app.viewer_proxy import Hooks, viewer_router
from backend.shell.hub import Hub
from backend.shell.image_loops import ImageLoops
from backend.shell.session.cycles import Topics
from backend.shell.session.index import Index
from backend.shell.session.played_gauge import PlayedGauge
from backend.shell.session.player import MODE, Player
from backend.shell.session.reader import Session, open_session
from backend.shell.session.ring import parts_of, pins_of, recordings_of
from backend.site.site import Site, load_site, parse_site, shipped_sites
from cockpit.desk import Desk, image_loops, load_models, make_config, may_say
from cockpit.entry import Entry
from cockpit.foreign import as_session
from cockpit.resolutions import resolutions
from cockpit.session_document import session_document
from cockpit.session_files import session_file
from cockpit.starting import Starting
from cockpit.views.client_head import HEAD

if TYPE_CHECKING:
    from cockpit.views.server import View

EVALUATE = "backend.shell.session.evaluate"
WHAT_IF = "backend.pipeline.whatif"
IMAGE_FRAMES = "backend.shell.app.image_frames"


@dataclass(frozen=True)
class Seen:
    """A session as seen on a site, with all that judging it needs. chosen_site: when it is not
    the one in the recording.
    """

    session: Session
    site: Site
    config: Config
    chosen_site: str | None = None

    @property
    def topics(self) -> Topics:
        return Topics.of(self.site, self.session)


def open_with_progress(path: Path) -> Session:
    """A session; a bar is shown while a file without an index is walked through."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"reading {path.name}", total=1.0)
        return open_session(path, lambda share: bar.update(task, completed=share))


def see(path: Path, site_name: str | None, mode: str = MODE) -> Seen:
    """Opens a session on the site that it was recorded on, or on another. Raises InputError."""
    session = open_with_progress(as_session(path, site_name))
    site = load_site(site_name) if site_name else recorded_site(session)
    try:
        models = load_models(site)
    except InputError as error:
        hint = "" if site_name else " With --site another site file can be named."
        raise InputError(f"{error}{hint}") from error
    known = {machine.name for machine in site.machines}
    own = tuple(
        name
        for name in (session.headers[0].own.split(",") if session.headers else ())
        if name in known
    )
    return Seen(session, site, make_config(site, models, own, mode), site_name)


def recorded_site(session: Session) -> Site:
    """The site whose text stands in the recording; its paths are seen from where its file was.

    Raises InputError where there is none.
    """
    shipped = ", ".join(shipped_sites())
    if not session.headers or not session.headers[0].site:
        raise InputError(
            f"{session.path}: does not say on which site it was recorded; "
            f"--site is needed, allowed are {shipped}, or the path of a site file."
        )
    header = session.headers[0]
    try:
        return parse_site(tomllib.loads(header.site), Path(header.site_file))
    except (tomllib.TOMLDecodeError, InputError) as error:
        raise InputError(
            f"{session.path}: the site in it cannot be used ({str(error).rstrip('.')}); "
            "with --site another site file can be named."
        ) from error


@dataclass(frozen=True)
class Options:
    """entry, port: who gets to the page, and where it is; source: None for the first that
    the session has; speed, begin [s]: playback starts so; playing: whether it starts by itself.
    """

    entry: Entry
    port: int
    source: str | None = None
    speed: float = 1.0
    begin: float = 0.0
    playing: bool = True


class PlaybackStation:
    """Everything of one playback process."""

    def __init__(self, seen: Seen, options: Options) -> None:
        self.view: View | None = None
        self._starting = Starting(
            (
                ("playback", self._start_player),
                ("the 3D scene", self._start_view),
                ("what judges postures", lambda: load(WHAT_IF)),
                ("the images", self._start_images),
                ("the index", lambda: self.index.start()),
            )
        )
        self._closing = contextlib.ExitStack()
        listener = bind(options.entry.host, options.port)
        self._closing.callback(listener.close)
        try:
            self._build(seen, options, listener)
        except BaseException:
            self.close()
            raise

    def _build(self, seen: Seen, options: Options, listener: Any) -> None:
        # The player must not wait 5 ms, the default, for another thread to hand over.
        sys.setswitchinterval(0.001)
        self.seen, self.config = seen, seen.config
        self.hub = Hub()
        self.index = Index(seen.session, seen.topics, seen.config)
        self._closing.callback(self.index.close)
        self.player = Player(
            seen.session,
            seen.topics,
            seen.config,
            self.hub,
            options.source,
            self.index.event_times,
            wait=self._starting.wait,
        )
        self._source = options.source or self.player.sources[0]
        self.desk = Desk(
            self.config, self.hub, lambda: self.view, ready=lambda: self._starting.done
        )
        self.images = ImageLoops(
            self.hub,
            image_loops(seen.site, self.config, self._closing),
            self.desk.wishes,
            once=True,  # a paused cursor needs no second image
        )
        frames = Frames(self.hub, self.document)
        sources = Sources(
            site=site_document(seen.site, self.config),
            frames=frames,
            backend=self.backend,
            on_message=self._on_message,
            what_if=self.desk.what_if,
        )
        self.access = access = options.entry.access(listener.getsockname()[1])
        self._closing.callback(access.close)
        hooks = Hooks(
            allow=lambda connection: access.identify(connection) is not None,
            opened=lambda *at: self.view and self.view.attach(*at),
            closed=lambda *at: self.view and self.view.detach(*at),
        )
        app = create_app(
            sources,
            viewer_router(lambda: None if self.view is None else self.view.port, hooks, HEAD),
            hosts=options.entry.hosts,
            routers=(session_router(self), gauge_router(PlayedGauge(self.config, self.hub))),
            access=access,
        )
        self.web = WebServer(app, listener, options.entry.tls)
        self._begin(options)
        self.web.start()
        self._closing.callback(self.web.stop)
        self._starting.start()

    def _start_player(self) -> None:
        if self._source == "evaluated":
            load(EVALUATE)
        self.player.start()
        self._closing.callback(self.player.stop)

    def _start_view(self) -> None:
        from cockpit.views.inputs import scene_site
        from cockpit.views.server import start

        scene = scene_site(self.seen.site, dict(self.config.machines))
        self.view = start(scene, self.hub, own=self.config.own[0])
        self._closing.callback(self.view.stop)

    def _start_images(self) -> None:
        load(IMAGE_FRAMES)  # before images come that need it
        self.images.start()
        self._closing.callback(self.images.stop)

    def _begin(self, options: Options) -> None:
        self.player.do("speed", options.speed)
        if options.begin > 0.0:
            self.player.do("seek", options.begin)
        if options.playing:
            self.player.do("play")

    def close(self) -> None:
        """Close everything, in the reverse order of opening."""
        self._starting.stop()
        self._closing.close()

    def document(self, snapshot: Snapshot) -> dict[str, Any]:
        """A snapshot as plain JSON: where it was recorded, just as it was recorded."""
        recorded = self.player.recorded(snapshot.cycle)
        document = (
            snapshot_document(snapshot, self.config)
            if recorded is None
            else {**recorded, "cycle": snapshot.cycle, "mode": snapshot.mode}
        )
        rate = self.images.timing["images"].timing().rate
        if rate > 0.0 and "resolution" not in document:
            document["resolution"] = resolutions(snapshot, self.config, 1.0 / rate)
        for gone in ("demo", "recording", "driving"):
            document.pop(gone, None)
        document["backend"] = self.backend()
        document["playback"] = self.player.status()
        return document

    def backend(self) -> dict[str, Any]:
        """Live timings of the player and of the image loops."""
        return {
            "step": vars(self.player.timing.timing()),
            **{name: vars(watch.timing()) for name, watch in self.images.timing.items()},
            "failure": self.player.failure or self._starting.failure or self.images.failure,
        }

    def session(self) -> dict[str, Any]:
        """What backend.documents.session.SessionDocument describes."""
        document = session_document(
            self.seen, self.player.sources, self.index.state, self.index.events()
        )
        document["problems"] = list(dict.fromkeys([*document["problems"], *self.index.problems()]))
        return document

    def series(
        self, source: str | None, start: float, end: float | None, points: int
    ) -> dict[str, Any] | None:
        """What backend.documents.session.SeriesDocument describes; None for a missing source."""
        chosen = source or self.player.sources[0]
        if chosen not in self.player.sources:
            return None
        duration = (self.seen.session.end - self.seen.session.begin) / 1e9
        return self.index.series(chosen, start, duration if end is None else end, points)

    def start_diff(self) -> None:
        self.index.start_diff()

    def diff(self) -> dict[str, Any]:
        return self.index.diff()

    def file(self, kind: str) -> Path:
        """The report ("report") or an export of the session. Raises InputError."""
        return session_file(self.seen.session.path, self.seen.chosen_site, kind)

    def _on_message(self, message: dict[str, Any], person: Person | None) -> None:
        """What a page asks of playback or of the scene. Anything else, commands included, ends
        here: there is nobody whom it could reach.
        """
        if not may_say(message, person):
            return
        if message.get("type") == "playback":
            with contextlib.suppress(InputError):
                self.player.do(message.get("do"), message.get("value"))
        else:
            self.desk.on_message(message)


def newest(root: Path) -> Path:
    """What was recorded or pinned last. Raises InputError when there is nothing."""
    sites = sorted(entry for entry in root.iterdir() if entry.is_dir()) if root.is_dir() else []
    found = [folder for site in sites for folder in (*recordings_of(site), *pins_of(site))]
    dated = [(parts[-1].end, folder) for folder in found if (parts := parts_of(folder))]
    if not dated:
        raise InputError(f"{root}: there are no recordings; allowed is the path of a session.")
    return max(dated)[1]
