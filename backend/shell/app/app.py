"""The HTTP side: the page, the API, the page's websocket and the 3D view behind one origin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastapi import APIRouter, FastAPI, Request, Response, WebSocket
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from fastapi_offline import FastAPIOffline
from starlette.middleware.trustedhost import TrustedHostMiddleware

from backend.documents.alarms import AlarmsDocument
from backend.errors import InputError
from backend.fusion.pose import Validity
from backend.pipeline.records import Snapshot
from backend.shell.access.access import Access
from backend.shell.app.feed import Feed, Frames, OnMessage, Seats
from backend.shell.app.gate import Gate, from_here
from backend.shell.app.login import login_router
from backend.shell.app.models import (
    HealthModel,
    MachineDescriptionModel,
    SiteModel,
    SnapshotModel,
    WhatIfModel,
    WhatIfRequest,
)
from backend.shell.app.recording import RecordingSources, recording_router
from backend.shell.app.security import SecurityHeaders
from backend.shell.app.wire import dumps

STATIC = Path(__file__).resolve().parents[3] / "static"


@dataclass(frozen=True)
class Sources:
    """What the app reads. site: its document; frames: snapshots and images, encoded once.

    backend: live timings; on_message: what a page asks of the views (camera, own machine);
    what_if: judges a posture, called with a machine and joint values by role, in a worker thread;
    raises InputError for what it does not know; recording: None where nothing is ever recorded;
    seats: None where nobody can drive; alarms: of this run, None where none are kept.
    """

    site: dict[str, Any]
    frames: Frames
    backend: Callable[[], dict[str, Any]]
    on_message: OnMessage
    what_if: Callable[[str, dict[str, float]], dict[str, Any]]
    recording: RecordingSources | None = None
    seats: Seats | None = None
    alarms: Callable[[], list[dict[str, Any]]] | None = None


def create_app(
    sources: Sources,
    viewer: APIRouter | None = None,
    hosts: tuple[str, ...] = ("*",),
    routers: tuple[APIRouter, ...] = (),
    access: Access | None = None,
    streams: tuple[str, ...] = (),
) -> FastAPI:
    """The application. viewer: routes of the 3D view, served below /view; routers: more routes.

    hosts: names under which it answers. A page that binds to the loopback answers to no other
    name, so that a foreign name that resolves to the loopback leads nowhere.
    access: who may do what; every websocket and request that passes it has `state.person`. Without
    it nobody is asked and nobody is known: state.person is None.
    streams: origins of cameras that the page opens by itself.
    """
    app: FastAPI = FastAPIOffline(  # its documentation page needs no network
        title="Excavator cockpit",
        description="Fused poses, distances, warning zones and C-space images of a site's "
        "excavators. SI units and radians; null where a value is unknown. An operator aid, not a "
        "safety-rated function.",
        docs_url="/api/docs",
        openapi_url="/api/openapi.json",
        redoc_url=None,
    )
    # The last one added is asked first.
    if access is not None:
        app.add_middleware(Gate, access=access)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(hosts))
    https = access is not None and access.https
    app.add_middleware(SecurityHeaders, https=https, streams=streams)
    app.state.access = access
    feed = Feed(sources.frames, sources.site, sources.on_message, sources.seats)
    hub = sources.frames.hub

    @app.get("/", include_in_schema=False)
    async def page() -> FileResponse:
        return FileResponse(STATIC / "index.html")

    @app.get("/favicon.ico", include_in_schema=False)
    async def icon() -> Response:
        return Response(status_code=204)

    @app.get("/api/health", responses={200: {"model": HealthModel}}, tags=["state"])
    async def health(request: Request) -> Response:
        """Whether the backend and every machine are well, and what is wrong in words.

        Without a session: `ok` and `status` only.
        """
        newest = hub.latest()
        found = _health(newest, sources)
        if access is not None and request.state.person is None:
            found = {"ok": found["ok"], "status": found["status"]}
        return _json(found)

    @app.get("/api/site", responses={200: {"model": SiteModel}}, tags=["description"])
    async def site() -> Response:
        """The site's frame, machines, obstacles and limits."""
        return _json(sources.site)

    @app.get(
        "/api/machines",
        responses={200: {"model": dict[str, MachineDescriptionModel]}},
        tags=["description"],
    )
    async def machines() -> Response:
        """Every machine's description."""
        return _json(sources.site["machines"])

    @app.get("/api/snapshot", responses={200: {"model": SnapshotModel}}, tags=["state"])
    async def snapshot() -> Response:
        """The newest cycle's conclusions; 503 before the first."""
        newest = hub.latest()
        if newest is None:
            return JSONResponse({"detail": "no cycle has finished yet"}, status_code=503)
        return _json(sources.frames.document(newest))

    @app.get("/api/alarms", responses={200: {"model": AlarmsDocument}}, tags=["state"])
    def alarms() -> Response:
        """What lasts and what ended, with causes and how it ended; 404 in playback."""
        if sources.alarms is None:
            return JSONResponse({"detail": "a recorded session has its events"}, status_code=404)
        return _json({"alarms": sources.alarms()})

    @app.post("/api/whatif", responses={200: {"model": WhatIfModel}}, tags=["state"])
    def what_if(request: WhatIfRequest) -> Response:
        """Whether a machine would touch something in another posture. Moves nothing."""
        try:
            return _json(sources.what_if(request.machine, request.joints))
        except InputError as error:
            return JSONResponse({"detail": str(error)}, status_code=422)

    @app.websocket("/ws")
    async def socket(websocket: WebSocket) -> None:
        if not from_here(websocket):
            await websocket.close(code=1008)
            return
        person = None if access is None else websocket.scope["state"]["person"]
        await websocket.accept()
        await feed.serve(websocket, person)

    if access is not None:
        app.include_router(login_router(access, STATIC / "login.html"))
    if sources.recording is not None:
        app.include_router(recording_router(sources.recording))
    for router in (*routers, *((viewer,) if viewer is not None else ())):
        app.include_router(router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    return app


def _health(newest: Snapshot | None, sources: Sources) -> dict[str, Any]:
    backend = sources.backend()
    machines = {} if newest is None else newest.machines
    status = [backend["failure"]] if backend["failure"] else []
    age = sources.frames.hub.age()
    if age is None:
        status.append("no cycle has finished yet")
    elif age > 0.5:
        status.append(f"the newest snapshot is {age:.1f} s old")
    for state in machines.values():
        if state.pose.validity is not Validity.VALID:
            label = sources.site["machines"][state.pose.machine]["label"]
            status.extend(f"{label} {reason}" for reason in state.pose.reasons)
    if newest is not None and newest.people is not None and newest.people.reason:
        status.append(f"people: {newest.people.reason}")
    counters: dict[str, Any] = {"malformed": {}, "foreign": {}, "lost": 0}
    if newest is not None:
        counters = {
            "malformed": newest.health.malformed,
            "foreign": newest.health.foreign,
            "lost": newest.health.lost,
        }
    return {
        "ok": not status,
        "status": status,
        "mode": sources.site["mode"],
        "cycle": -1 if newest is None else newest.cycle,
        "snapshot_age": age,
        "machines": {name: state.pose.validity.value for name, state in machines.items()},
        "backend": backend,
        "counters": counters,
    }


def _json(document: Any) -> Response:
    return Response(dumps(document), media_type="application/json")
