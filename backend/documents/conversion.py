"""What `cockpit convert --json` and `cockpit export --json` print."""

from __future__ import annotations

from pydantic import BaseModel, Field


class ProblemModel(BaseModel):
    """One kind of problem."""

    where: str = Field(description="where it was met first: file, line or frame, topic")
    text: str = Field(description="in words")
    count: int = Field(description="how often")


class ConversionDocument(BaseModel):
    """A recording of another program as a session of this one."""

    recording: str = Field(description="path of what was read")
    out: str = Field(description="path of the session")
    origin: str = Field(description="what it was")
    note: str = Field(description="what a viewer must know, or empty")
    messages: int = Field(description="written, all topics")
    topics: dict[str, int] = Field(description="messages by topic of the session")
    begin: float = Field(description="first message [s since 1970]")
    end: float = Field(description="last message [s since 1970]")
    duration: float = Field(description="end - begin [s]")
    problems: list[ProblemModel]
    skipped: dict[str, int] = Field(
        description="topics, identifiers, machines or columns that are not of the site, with counts"
    )


class ExportDocument(BaseModel):
    """A session as tables or as a plain ROS 2 recording; what `cockpit export --json` prints."""

    session: str = Field(description="path of what was read")
    out: str = Field(description="path of the folder written")
    format: str = Field(description="csv, parquet or ros2")
    source: str = Field(description="recorded, or evaluated by today's pipeline")
    counts: dict[str, int] = Field(description="rows by file, or messages by topic")
    notes: list[str] = Field(description="what could not be read or written, in words")
