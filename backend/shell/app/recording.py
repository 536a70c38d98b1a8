"""The API of the recorder: its state, markers, and pinning what was just recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from backend.errors import InputError
from backend.shell.app.models import RecordingStateModel
from backend.shell.app.wire import dumps


class PinRequest(BaseModel):
    """What to keep for good."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field("", max_length=64, description="of the folder; empty for one by the time")
    minutes: Annotated[float, Field(gt=0.0, le=100_000.0)] = Field(
        10.0, description="back from now [min]"
    )


class PinModel(BaseModel):
    folder: str = Field(description="where the pinned parts are")


class MarkerRequest(BaseModel):
    """An operator's note on the timeline, now."""

    model_config = ConfigDict(extra="forbid")

    text: str = Field(min_length=1, max_length=500)


class RecordingModel(RecordingStateModel):
    """The recorder, and all recordings of the site that are not pinned."""

    folder: str | None = Field(description="of the site's recordings; null when off")
    bytes: int = Field(description="of all their parts")
    parts: int
    oldest: float | None = Field(description="last change of the oldest part [s since 1970]")


@dataclass(frozen=True)
class RecordingSources:
    """status: a RecordingModel; pin: name and seconds, the folder; mark: a note's text. All are
    called in worker threads; pin and mark raise InputError.
    """

    status: Callable[[], dict[str, Any]]
    pin: Callable[[str, float], Path]
    mark: Callable[[str], None]


def recording_router(sources: RecordingSources) -> APIRouter:
    router = APIRouter(prefix="/api/recording", tags=["recording"])

    @router.get("", responses={200: {"model": RecordingModel}})
    def status() -> Response:
        """Whether it records, and how much there is."""
        return _json(sources.status())

    @router.post("/pin", responses={200: {"model": PinModel}})
    def pin(request: PinRequest) -> Response:
        """Keep the last minutes for good: the ring will not delete them."""
        try:
            return _json({"folder": str(sources.pin(request.name, 60.0 * request.minutes))})
        except InputError as error:
            return JSONResponse({"detail": str(error)}, status_code=422)

    @router.post("/marker", status_code=204)
    def marker(request: MarkerRequest) -> Response:
        """A note on the timeline, now."""
        try:
            sources.mark(request.text)
        except InputError as error:
            return JSONResponse({"detail": str(error)}, status_code=422)
        return Response(status_code=204)

    return router


def _json(document: Any) -> Response:
    return Response(dumps(document), media_type="application/json")
