"""What operators chose of a working gauge: the file it is kept in, and what /api/gauge answers."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.site.gauge_choice import Corner, Drawn, DrawnKind, GaugeChoice


class AreaDocument(BaseModel):
    """One drawn area."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    name: str = Field(min_length=1, max_length=64)
    kind: DrawnKind = Field(description="stay out of it, or stay in it")
    polygon: list[tuple[float, float]] = Field(description="corners in order, east and north [m]")
    bottom: float | None = Field(None, description="height; null only of a keep-in area [m]")
    top: float | None = Field(None, description="height; null only of a keep-in area [m]")


class GaugeChoiceFile(BaseModel):
    """Areas drawn and volumes switched on a site, as they are kept from run to run. Coordinates
    are in the site's projected CRS, heights in its vertical datum, as in a site file.
    """

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    format: Literal[1] = 1
    epsg: int = Field(description="of the projected CRS")
    drawn: list[AreaDocument] = Field(default_factory=list)
    switched: dict[str, bool] = Field(
        default_factory=dict,
        description="by name of a limit volume: true holds whatever its state, and for a machine "
        "that stands on it; false holds for nobody",
    )


class VolumePlan(BaseModel):
    exterior: list[list[float]] = Field(description="site frame [m]")
    holes: list[list[list[float]]] = Field(description="site frame [m]")


class VolumeState(BaseModel):
    """One limit volume now."""

    name: str
    kind: str = Field(description="track, overhead, pole, ..., keep_out or keep_in")
    state: str = Field(description="of the feature: existing, proposed, ...; drawn")
    rule: str = Field(description="what was applied, in words")
    drawn: bool = Field(description="on this page, not given by the site file")
    in_force: bool = Field(description="whether it holds for any machine")
    why: str = Field(description="why it holds for nobody; empty where it holds")
    switched: bool | None = Field(description="by an operator; null for as its state says")
    left_out_by: list[str] = Field(description="machines that stand on it: for them it does not")
    plan: list[VolumePlan] = Field(description="seen from above")


class GaugeStateDocument(BaseModel):
    """The working gauge as it is now: of the site file, drawn, and switched."""

    choice: str = Field(description="changes with what operators draw and switch")
    editable: bool = Field(description="whether it can be changed here: not in playback")
    volumes: list[VolumeState]
    drawn: list[AreaDocument] = Field(description="in the site frame")


def choice_file(choice: GaugeChoice, frame: SiteFrame) -> GaugeChoiceFile:
    """What is written of a choice."""
    east, north, up = (float(value) for value in frame.origin)
    drawn = [document_of(area, (east, north, up)) for area in choice.drawn]
    return GaugeChoiceFile(epsg=frame.epsg, drawn=drawn, switched=dict(choice.switched))


def choice_of(kept: GaugeChoiceFile, frame: SiteFrame) -> GaugeChoice:
    """The choice that was written, not checked. Raises InputError for another CRS."""
    if kept.epsg != frame.epsg:
        raise InputError(f"epsg is {kept.epsg}; allowed is the site's, {frame.epsg}.")
    east, north, up = (float(value) for value in frame.origin)
    drawn = tuple(area_of(area, (-east, -north, -up)) for area in kept.drawn)
    return GaugeChoice(drawn, tuple(sorted(kept.switched.items())))


def area_of(area: AreaDocument, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Drawn:
    """An area as a record, moved by `offset` [m]; not checked."""
    corners: tuple[Corner, ...] = tuple((x + offset[0], y + offset[1]) for x, y in area.polygon)
    bottom, top = (_moved(height, offset[2]) for height in (area.bottom, area.top))
    return Drawn(area.name, area.kind, corners, bottom, top)


def document_of(area: Drawn, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> AreaDocument:
    """A record as a document, moved by `offset` [m]."""
    polygon = [(x + offset[0], y + offset[1]) for x, y in area.polygon]
    bottom, top = (_moved(height, offset[2]) for height in (area.bottom, area.top))
    return AreaDocument(name=area.name, kind=area.kind, polygon=polygon, bottom=bottom, top=top)


def _moved(height: float | None, offset: float) -> float | None:
    return None if height is None else height + offset
