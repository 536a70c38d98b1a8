"""/api/use-case: which use cases a site offers, and which of them has been worked out."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from backend.documents.use_case import MethodModel, NameModel


class OfferModel(BaseModel):
    """A use case whose limits are this site's."""

    name: NameModel
    title: str
    figures: str = Field(description="of Mäkinen 2021")
    machine: str = Field(description="of the site, whose place and model it has")
    label: str = Field(description="that machine's, for people")
    seconds: float = Field(description="a run lasts, in its own time [s]")


class MethodWordsModel(BaseModel):
    """A way to act near limits."""

    name: MethodModel
    words: str


class UseCaseRequest(BaseModel):
    """One run."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(max_length=32, description="of an offered use case")
    method: str = Field(max_length=32, description="none, scaling, potential or constrained")


class DoneModel(BaseModel):
    """A run that can be fetched from /api/use-case/NAME/METHOD."""

    name: NameModel
    method: MethodModel


class RunningModel(DoneModel):
    """The run that is being worked out."""

    progress: float = Field(ge=0.0, le=1.0)


class UseCaseStateDocument(BaseModel):
    """What a page shows beside the runs themselves. No machine moves by any of it."""

    offered: list[OfferModel]
    why: str = Field(description="why nothing is offered; else empty")
    methods: list[MethodWordsModel]
    running: RunningModel | None
    done: list[DoneModel]
    trouble: str = Field(description="why the last run came to nothing; else empty")
