"""The header of a driving zone's frame on the page's websocket."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, Field

from backend.documents.driving import ExitDocument, Plane


class ZoneVariantDocument(BaseModel):
    signed_distance: float | None = Field(
        description="of the base from the zone's edge, positive outside, view at most: then it is "
        "that far or farther; null: no zone at all [m]"
    )
    empty: bool = Field(description="whether nothing is in the view")
    exit: ExitDocument | None = Field(description="the shortest way out; null outside")


class ZoneFrameHeader(BaseModel):
    """Where own's base must not go because of one layer: a partner, people or the site."""

    type: Literal["zone"]
    key: str = Field(description='"left<-right", "left<-layer:people" or "left<-layer:site"')
    own: str
    partner: str | None = Field(description="null for people and the site")
    layer: Literal["partner", "people", "site"]
    state_time: float = Field(description="of the poses it shows [s]")
    eta: float | None = Field(description="growth of the bodies; null while not known [m]")
    base: Plane = Field(description="own's base point then [m]")
    variants: dict[Literal["as_is", "any_swing", "any_posture", "turning"], ZoneVariantDocument] = (
        Field(description="the site has no turning; none while the layer is not known")
    )
    view: float | None = Field(
        description="the zone is complete within this distance of the base; null: everywhere [m]"
    )
    reason: str = Field(description="why the layer is not known, else empty")
