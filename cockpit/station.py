"""One running cockpit: link, pipeline, scene and page wired together."""

from __future__ import annotations

import contextlib
import gc
import logging
import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

from backend.control.person import Person
from backend.documents.site import site_document
from backend.documents.snapshot import snapshot_document
from backend.documents.surmount_solve import solve
from backend.errors import InputError
from backend.perception.stages import StagedScan
from backend.pipeline.people_records import Seen
from backend.pipeline.records import Inputs, Notice, Snapshot
from backend.shell.access.places import state_folder
from backend.shell.alarm_log import AlarmLog
from backend.shell.app.app import Sources, create_app
from backend.shell.app.cameras import camera_router
from backend.shell.app.feed import Frames
from backend.shell.app.gauge_api import gauge_router
from backend.shell.app.metrics import metrics_router
from backend.shell.app.plan_api import plan_router
from backend.shell.app.server import WebServer, bind
from backend.shell.app.stages import stages_router
from backend.shell.app.surmount_api import surmount_router
from backend.shell.app.use_case_api import use_case_router
from backend.shell.app.viewer_proxy import Hooks, viewer_router
from backend.shell.app.wire import dumps
from backend.shell.gauge_desk import GaugeDesk
from backend.shell.hub import Hub, OncePerSnapshot
from backend.shell.link.receiver import Receiver
from backend.shell.link.relay import Relay
from backend.shell.link.session import open_session
from backend.shell.link.source import LinkSource
from backend.shell.offered import Offered
from backend.shell.plan_desk import PlanDesk, Progress
from backend.shell.runner import Runner
from backend.shell.session.recorder import Recorder
from backend.shell.surmount_desk import SurmountDesk
from backend.shell.use_case_desk import UseCaseDesk
from backend.shell.use_case_offers import offers
from backend.site.site import Site
from cockpit.cameras import make_cameras, whep_origins
from cockpit.desk import Desk, along_loops, image_loops, load_models, make_config, may_say
from cockpit.driving import make_driving
from cockpit.options import Options
from cockpit.people import make_people
from cockpit.plan_scene import PlanScene
from cockpit.recording import make_recorder, recording_sources, site_folder
from cockpit.resolutions import resolutions
from cockpit.surmount_scene import SurmountScene, previewed
from cockpit.use_case_scene import UseCaseScene
from cockpit.views.client_head import HEAD
from cockpit.views.inputs import scene_site
from cockpit.views.server import View, start

AT_ONCE = (
    *("backend.safety.approach_kernels", "backend.machine.outline_kernel"),
    *("backend.shell.link.typestore", "backend.shell.app.image_frames", "backend.pipeline.whatif"),
)
"""Loaded at the start, not where they are first needed: no cycle of the loop waits for them."""

log = logging.getLogger(__name__)


class Station:
    """Everything of one backend process. demo_began: wall time of the demo script's start [s]."""

    def __init__(
        self,
        site: Site,
        options: Options,
        demo_began: Callable[[], float] | None = None,
    ) -> None:
        listener = bind(options.entry.host, options.port)
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
        for module in AT_ONCE:
            import_module(module)
        models = load_models(site)
        self.config = make_config(site, models, options.own, options.mode)
        self._demo_began = demo_began
        self._driving_failure = ""
        self.hub = Hub()
        self.document = OncePerSnapshot(self._document)
        session = open_session(options.listen, options.connect, "router", options.link_config)
        self._closing.callback(session.close)
        prefixes = {machine.prefix: machine.name for machine in site.machines}
        self.recorder = make_recorder(site, self.config, options)
        kept = site_folder(site, options.record) / "alarms.jsonl"
        recording = isinstance(self.recorder, Recorder)
        self.alarm_log = AlarmLog(kept if recording else None, self.config.labels)
        self._closing.callback(self.alarm_log.close)
        found = offers(site, self.config.site)
        self.use_cases = UseCaseDesk(found, self.config.labels, self._event)
        self._closing.callback(self.use_cases.close)
        self.plans = PlanDesk(self.config, self.hub.latest, self._followed, self._event)
        self._closing.callback(self.plans.close)
        self.surmounts = SurmountDesk(
            self.config, self.hub.latest, self._followed, self._event, solve
        )
        self._closing.callback(self.surmounts.close)
        self._desk = Desk(
            self.config,
            self.hub,
            lambda: self.view,
            self.recorder.action,
            played=UseCaseScene(self.use_cases).played,
            previewed=previewed(PlanScene(self.plans), SurmountScene(self.surmounts)),
        )
        kept = state_folder() / "gauge" / f"{site.name}.json"
        self.gauge = GaugeDesk(self.config, self.hub, kept, self._event)
        self.receiver = Receiver(
            session,
            prefixes,
            everything=self.recorder.wants_everything,
            clouds=site.recording.clouds,
        )
        self._closing.callback(self.receiver.close)
        self.people = make_people(self.config, self.receiver)
        self.driving = make_driving(
            *(site, self.config, session, self.receiver, self._event),
            Offered(self.plans, self.surmounts),
        )
        self._closing.callback(self.driving.shut)
        self.runner = Runner(
            self.config,
            (
                *image_loops(site, self.config, self._closing),
                *along_loops(site, self.config, self._closing),
            ),
            LinkSource(self.receiver, self.recorder.hear),
            self.hub,
            site.rates.step_hz,
            self._desk.wishes,
            notices=self._notices,
            after_cycle=self._after_cycle,
            driven=self.driving.driven,
            gauge=self.gauge.choice,
            people=self._seen,
            surmounting=self.driving.surmounting,
        )
        frames = Frames(self.hub, self.document)
        relay = Relay(session, self.hub, self._texts, frames.images)
        self.view: View = start(
            scene_site(site, models), self.hub, own=self.config.own[0], stages=self._staged
        )
        self._closing.callback(self.view.stop)
        sources = Sources(
            site=site_document(site, self.config),
            frames=frames,
            backend=self.backend,
            on_message=self._on_message,
            what_if=self._desk.what_if,
            recording=recording_sources(self.recorder, site, options),
            seats=self.driving,
            alarms=self.alarm_log.document,
        )
        self.access = access = options.entry.access(listener.getsockname()[1])
        self._closing.callback(access.close)
        hooks = Hooks(
            allow=lambda connection: access.identify(connection) is not None,
            opened=self.view.attach,
            closed=self.view.detach,
        )
        app = create_app(
            sources,
            viewer_router(lambda: self.view.port, hooks, HEAD),
            hosts=options.entry.hosts,
            routers=(
                metrics_router(frames, self.backend, self._recorded, options.entry.metrics_token),
                camera_router(make_cameras(site, session)),
                gauge_router(self.gauge),
                use_case_router(self.use_cases),
                plan_router(self.plans),
                surmount_router(self.surmounts),
                *(() if self.people is None else (stages_router(self.people.look),)),
            ),
            access=access,
            streams=whep_origins(site),
        )
        self.web = WebServer(app, listener, options.entry.tls)
        self.recorder.start()
        self.alarm_log.start()
        self._closing.callback(self.recorder.close)
        self.driving.start()
        self.runner.start()
        self._closing.callback(self.runner.stop)
        if self.people is not None:
            self.people.start()
            self._closing.callback(self.people.stop)
        relay.start()
        self._closing.callback(relay.stop)
        self.web.start()
        self._closing.callback(self.web.stop)
        # What is loaded by now stays: without this, the collector would walk through all of it
        # again and again, and each walk holds up the fast loop.
        gc.collect()
        gc.freeze()

    def close(self) -> None:
        """Close everything, in the reverse order of opening."""
        self._closing.close()

    def _document(self, snapshot: Snapshot) -> dict[str, Any]:
        """A snapshot as plain JSON, with what only a running backend knows."""
        document = snapshot_document(snapshot, self.config)
        rate = self.runner.image_timing["images"].timing().rate
        if rate > 0.0:
            document["resolution"] = resolutions(snapshot, self.config, 1.0 / rate)
        document["backend"] = self.backend()
        document["recording"] = vars(self.recorder.state())
        document["driving"] = self.driving.document()
        document["plans"] = self.plans.document()
        document["surmounts"] = self.surmounts.document()
        if self._demo_began is not None:
            document["demo"] = {"elapsed": time.time() - self._demo_began()}
        return document

    def _texts(self, snapshot: Snapshot) -> tuple[str, str]:
        """JSON of a snapshot and of its alarms, for others and for the recording."""
        document = self.document(snapshot)
        text, alarms = dumps(document), dumps(document["alarms"])
        self.recorder.snapshot(text, snapshot.time)
        self.recorder.alarms(alarms, snapshot.time)
        return text, alarms

    def backend(self) -> dict[str, Any]:
        """Live timings of both loops."""
        return {
            "step": vars(self.runner.step_timing.timing()),
            **({} if self.people is None else {"people": vars(self.people.timing.timing())}),
            **{name: vars(watch.timing()) for name, watch in self.runner.image_timing.items()},
            "failure": self.runner.failure or self._driving_failure,
        }

    def _recorded(self) -> dict[str, Any]:
        return vars(self.recorder.state())

    def _after_cycle(self, inputs: Inputs, snapshot: Snapshot) -> None:
        if not self._driving_failure:
            try:
                self.driving.cycle(snapshot)  # first: a command must not wait for the recorder
            except Exception as error:
                # The view must outlive it; without commands every machine stands by itself.
                self._driving_failure = f"driving stopped: {error!r}"
                log.exception("%s", self._driving_failure)
        self.plans.keep(snapshot)
        self.surmounts.keep(snapshot)
        self._desk.recent.keep(snapshot)
        if self.people is not None:
            self.people.keep(snapshot)
        self.alarm_log.after_cycle(snapshot)
        self.recorder.after_cycle(inputs, snapshot)

    def _notices(self) -> tuple[Notice, ...]:
        people = () if self.people is None else self.people.notices()
        return self.recorder.notices() + self.alarm_log.notices() + self.gauge.notices() + people

    def _seen(self) -> Seen | None:
        return None if self.people is None else self.people.take()

    def _staged(self) -> StagedScan | None:
        return None if self.people is None else self.people.look().stages

    def _followed(self, machine: str) -> Progress | None:
        found = self.driving.followed(machine)
        if found is None:
            return None
        follow = found.follow
        return Progress(found.plan, follow.at, follow.ended, follow.arrived)

    def _event(self, what: str, who: str, details: dict[str, Any]) -> None:
        """What an operator did with a machine, for the recording and the audit log."""
        self.recorder.action(what, None, {"who": who, **details})
        self.access.audit(what, who, details)

    def _on_message(self, message: dict[str, Any], person: Person | None) -> None:
        """What a page asks of the recording, of alarms, or of the scene and the images."""
        if not may_say(message, person):
            return
        if message.get("type") == "marker":
            with contextlib.suppress(InputError):
                self.recorder.mark("note", str(message.get("text", "")))
        elif message.get("type") == "silence" and person is not None:
            name, machine = str(message.get("name")), str(message.get("machine"))
            self.alarm_log.silence(name, machine, person.who)
            self._event("silence", person.who, {"name": name, "machine": machine})
        else:
            self._desk.on_message(message)
