"""What `cockpit bench --json` prints."""

from __future__ import annotations

from pydantic import BaseModel, Field


class BenchMachine(BaseModel):
    cpu: str
    cores: int


class BenchRow(BaseModel):
    """One measurement."""

    name: str
    value: float = Field(description="median, or the percentile that the name states")
    unit: str
    spread: tuple[float, float] = Field(description="5th and 95th percentile")
    target: float | None = Field(None, description="what the value should stay below")
    peer: str | None = Field(None, description="what it is compared with, in the same run")
    peer_value: float | None = None
    ratio: float | None = Field(None, description="peer_value / value")


class BenchDocument(BaseModel):
    machine: BenchMachine
    rows: list[BenchRow]
