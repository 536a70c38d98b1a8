"""What `cockpit surmount` reads."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

from backend.documents.state import NotNegative, Number, Positive, StateDocument, Table
from backend.documents.surmount_document import SurmountParameters
from backend.errors import InputError
from backend.site.messages import sentence

Effort = Literal["quick", "thorough"]
HIGHEST = 10.0


class EdgeDocument(Table):
    """An edge across the machine's way."""

    distance: Number = Field(
        le=1000.0, description="from the crawler's middle to it along the way [m]"
    )
    rise: Number = Field(
        ge=-HIGHEST, le=HIGHEST, description="of the ground there; negative: down [m]"
    )


class GivenParameters(Table):
    """Fig. 2; the only edge is surmounted so, and nothing is searched for."""

    p1: Positive = Field(description="from P_b to the edge at the beginning [m]")
    p2: Positive = Field(description="from the bucket to the edge in stage 1 [m]")
    p3: Positive = Field(description="from the bucket to the edge in stage 2 [m]")
    p4: Positive = Field(description="from P_b to the edge at the end [m]")
    alpha_f: Positive = Field(le=1.5, description="lean after stage 1 [rad]")


class SurmountTaskDocument(Table):
    """From the state, at rest, over one edge or several."""

    state: StateDocument
    machine: str = Field(min_length=1, description="which machine of the state surmounts")
    obstacle: str | None = Field(
        None, max_length=200, description="name of a box of the state or the site, ahead"
    )
    over: bool = Field(False, description="with obstacle: down its other side, too")
    edges: list[EdgeDocument] = Field(default_factory=list, max_length=8)
    angle: Number = Field(
        0.0, ge=-0.8, le=0.8, description="with edges: of the machine to the way across them [rad]"
    )
    payload: NotNegative = Field(0.0, description="in the bucket [kg]")
    friction: Positive = Field(0.7, le=2.0, description="of tracks and bucket on the ground")
    clearance: NotNegative | None = Field(
        None, description="of bodies beside tracks and bucket; default: 1 % of the tracks [m]"
    )
    margin: NotNegative | None = Field(
        None, description="against tipping, to the edge; default: 5 % of the gauge [m]"
    )
    pace: Positive = Field(0.5, le=0.9, description="share of full speed of joints and tracks")
    p4: Positive | None = Field(
        None, description="where P_b ends past the edge; default: the least at which it stands [m]"
    )
    parameters: GivenParameters | None = None
    effort: Effort = Field(
        "thorough",
        description="quick: the dozen that quasi-statically need least are simulated; thorough: a "
        "coarse batch, and SLSQP from its best",
    )
    spline: bool = Field(
        False, description="thorough: whether sequence 1 may rise by a spline that needs less"
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> SurmountTaskDocument:
        if (self.obstacle is None) == (not self.edges):
            raise ValueError("needs either obstacle or edges")
        if self.obstacle is None and self.over:
            raise ValueError("over is for an obstacle; edges say where they fall")
        if self.parameters is not None and (len(self.edges) > 1 or self.over):
            raise ValueError("parameters are those of one edge, and there are several")
        return self


def parse_surmount_task(data: Any, where: str) -> SurmountTaskDocument:
    """A validated task; raises InputError naming `where`."""
    if not isinstance(data, dict):
        raise InputError(f"{where}: is not a JSON object; allowed is a task document.")
    try:
        return SurmountTaskDocument.model_validate(data)
    except ValidationError as error:
        raise InputError(f"{where}: {sentence(error, SurmountTaskDocument)}") from error


def as_parameters(given: GivenParameters) -> SurmountParameters:
    """The same as they are told."""
    return SurmountParameters(**given.model_dump())
