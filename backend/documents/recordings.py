"""What `cockpit recordings` and `cockpit recover` print."""

from __future__ import annotations

from pydantic import BaseModel, Field


class RecordingRow(BaseModel):
    site: str = Field(description="the site's name")
    name: str = Field(description="when the recording began, or a pin's name")
    folder: str
    pinned: bool
    live: bool = Field(description="being written at this moment")
    parts: int
    bytes: int
    begin: float | None = Field(description="of finished parts [s since 1970]; null without any")
    end: float = Field(description="last change [s since 1970]")


class RecordingsDocument(BaseModel):
    """All recordings below one folder."""

    root: str
    recordings: list[RecordingRow]


class SkippedRow(BaseModel):
    at: int = Field(description="where the skipped bytes begin")
    bytes: int
    why: str


class RecoveredFile(BaseModel):
    path: str
    bytes: int = Field(description="size of the file")
    whole: bool = Field(description="it had its summary, and nothing was skipped")
    chunks: int = Field(description="saved")
    messages: int = Field(description="saved")
    seconds: float = Field(description="between its first and last message saved [s]")
    skipped: list[SkippedRow]
    unknown: int = Field(description="messages whose channel was lost with the damage")


class RecoverDocument(BaseModel):
    """What was saved of a damaged recording."""

    out: str = Field(description="the new file")
    files: list[RecoveredFile] = Field(description="that were read, in their order")
    chunks: int
    messages: int
    seconds: float = Field(description="between the first and the last message saved [s]")
    bytes: int = Field(description="of the new file")
    skipped_bytes: int
