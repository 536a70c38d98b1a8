"""The API of the working gauge: what holds and why, areas that are drawn, switches."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from backend.documents.gauge_choice import AreaDocument, GaugeStateDocument, area_of
from backend.errors import InputError
from backend.shell.app.answers import who
from backend.shell.app.wire import dumps
from backend.site.gauge_choice import Drawn, DrawnKind


class ShapeRequest(BaseModel):
    """The shape of an area, in the site frame."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    kind: DrawnKind = Field(description="stay out of it, or stay in it")
    polygon: list[tuple[float, float]] = Field(
        max_length=1000, description="3 to 40 corners in order, east and north [m]"
    )
    bottom: float | None = Field(None, description="height; null only of a keep-in area [m]")
    top: float | None = Field(None, description="height; null only of a keep-in area [m]")


class AreaRequest(ShapeRequest):
    """A new area, in the site frame."""

    name: str = Field(min_length=1, max_length=64)


class SwitchRequest(BaseModel):
    """A limit volume on, off, or as its state says."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(min_length=1, max_length=200)
    on: bool | None


class Gauge(Protocol):
    """What the API asks: a GaugeStateDocument, and changes, which raise InputError. All are called
    in worker threads.
    """

    @property
    def editable(self) -> bool: ...

    def document(self) -> dict[str, Any]: ...

    def draw(self, area: Drawn, replacing: bool, who: str) -> None: ...

    def erase(self, name: str, who: str) -> None: ...

    def switch(self, name: str, on: bool | None, who: str) -> None: ...


def gauge_router(gauge: Gauge) -> APIRouter:
    """Routes below /api/gauge. Whoever may drive may change it; see access.rules."""
    router = APIRouter(prefix="/api/gauge", tags=["working gauge"])
    answers: dict[int | str, dict[str, Any]] = {200: {"model": GaugeStateDocument}}

    def changed(change: Callable[[], None]) -> Response:
        try:
            change()
        except InputError as error:
            return _json({"detail": str(error)}, 422 if gauge.editable else 409)
        return _json(gauge.document())

    @router.get("", responses=answers)
    def now() -> Response:
        """Every limit volume: whether it holds, why not, and for whom it is left out."""
        return _json(gauge.document())

    @router.post("/drawn", responses=answers)
    def draw(asked: AreaRequest, request: Request) -> Response:
        """A new area to stay out of, or to stay in."""
        area = area_of(AreaDocument(**asked.model_dump()))
        return changed(lambda: gauge.draw(area, False, who(request)))

    @router.put("/drawn/{name}", responses=answers)
    def redraw(name: str, asked: ShapeRequest, request: Request) -> Response:
        """An area's other shape; a new area where there is none of that name."""
        area = area_of(AreaDocument.model_construct(name=name, **asked.model_dump()))
        return changed(lambda: gauge.draw(area, True, who(request)))

    @router.delete("/drawn/{name}", responses=answers)
    def erase(name: str, request: Request) -> Response:
        """A drawn area goes."""
        return changed(lambda: gauge.erase(name, who(request)))

    @router.put("/switch", responses=answers)
    def switch(asked: SwitchRequest, request: Request) -> Response:
        """A limit volume holds whatever its state, for nobody, or as its state says."""
        return changed(lambda: gauge.switch(asked.name, asked.on, who(request)))

    return router


def _json(document: Any, status: int = 200) -> Response:
    return Response(dumps(document), status, media_type="application/json")
