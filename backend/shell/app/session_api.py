"""The API of a recorded session that is played."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from backend.documents.session import DiffDocument, SeriesDocument, SessionDocument, Source
from backend.errors import InputError
from backend.shell.app.wire import dumps

MOST_POINTS = 20_000


class Playback(Protocol):
    """What the API reads; documents as backend.documents.session describes them."""

    def session(self) -> dict[str, Any]: ...

    def series(
        self, source: str | None, start: float, end: float | None, points: int
    ) -> dict[str, Any] | None:
        """None for a source that the session does not have."""

    def start_diff(self) -> None: ...

    def diff(self) -> dict[str, Any]: ...

    def file(self, kind: str) -> Path:
        """The report, or an export, in a folder of its own. Raises InputError."""


def session_router(playback: Playback) -> APIRouter:
    """Routes below /api/session."""
    router = APIRouter(prefix="/api/session", tags=["playback"])

    @router.get("", responses={200: {"model": SessionDocument}})
    def session() -> Response:
        """What the recording is, what happened in it, and what could not be read."""
        return _json(playback.session())

    @router.get("/series", responses={200: {"model": SeriesDocument}})
    def series(
        start: Annotated[float, Query(ge=0.0, description="since the beginning [s]")] = 0.0,
        end: Annotated[float | None, Query(ge=0.0, description="omitted: to the end [s]")] = None,
        points: Annotated[int, Query(ge=2, le=MOST_POINTS, description="at most")] = 600,
        source: Annotated[Source | None, Query(description="omitted: the first it has")] = None,
    ) -> Response:
        """Clearances, ages, joint angles and levels over time, as far as the index is built."""
        found = playback.series(source, start, end, points)
        if found is None:
            detail = {"detail": f"source is {source}; this session does not have it"}
            return _json(detail, 422)
        return _json(found)

    @router.post("/diff", status_code=202, responses={202: {"model": DiffDocument}})
    def start_diff() -> Response:
        """Begin to judge the whole session anew and to compare; ask for it with GET."""
        playback.start_diff()
        return _json(playback.diff(), 202)

    @router.get("/diff", responses={200: {"model": DiffDocument}})
    def diff() -> Response:
        """As it was against as this program judges it."""
        return _json(playback.diff())

    @router.post("/report", response_class=FileResponse)
    def report() -> Response:
        """What happened, plots, incursions, a 3D replay: one HTML file that needs nothing else."""
        return _file(playback, "report", "text/html")

    @router.post("/export", response_class=FileResponse)
    def export(
        kind: Annotated[
            Literal["csv", "parquet", "ros2"],
            Query(alias="format", description="tables, or messages only"),
        ],
    ) -> Response:
        """The session as tables or as a plain ROS 2 recording, in one .zip file."""
        return _file(playback, kind, "application/zip")

    return router


def _file(playback: Playback, kind: str, media: str) -> Response:
    try:
        path = playback.file(kind)
    except InputError as error:
        return _json({"detail": str(error)}, 422)
    gone = BackgroundTask(shutil.rmtree, path.parent, ignore_errors=True)
    return FileResponse(path, media_type=media, filename=path.name, background=gone)


def _json(document: Any, status: int = 200) -> Response:
    return Response(dumps(document), status, media_type="application/json")
