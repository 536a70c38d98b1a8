"""What `cockpit detect --json` prints."""

from __future__ import annotations

from pydantic import BaseModel, Field


class PlaneModel(BaseModel):
    """The ground: normal . x = offset on it."""

    normal: tuple[float, float, float] = Field(description="unit vector, upwards")
    offset: float = Field(description="[m]")
    slope: float = Field(description="against level [rad]")
    share: float = Field(description="of the points within reach that lie on it, 0 to 1")


class StagesModel(BaseModel):
    """How many points each stage left."""

    points: int = Field(description="in the file")
    numbers: int = Field(description="of them, whose x, y and z are finite numbers")
    near: int = Field(description="of them, within reach of the sensor")
    ground: int = Field(description="of those near, on or below the ground, and so taken out")
    clustered: int = Field(description="of those near, in one of the objects")


class ObjectModel(BaseModel):
    """One upright box."""

    position: tuple[float, float, float] = Field(description="its middle, in the file's frame [m]")
    size: tuple[float, float, float] = Field(description="length, width, height [m]")
    yaw: float = Field(description="of its length, counter-clockwise from x [rad]")
    points: int = Field(description="in it")


class ScanModel(BaseModel):
    """One file."""

    file: str
    format: str = Field(description="what it is, in words")
    time: float = Field(description="[s]")
    origin: tuple[float, float, float] = Field(description="of the sensor, in the file's frame [m]")
    stages: StagesModel
    plane: PlaneModel | None = Field(description="null where no ground was found or looked for")
    objects: list[ObjectModel]
    notes: list[str] = Field(description="what a reader must know, in words")


class DetectionDocument(BaseModel):
    """People and objects in point clouds, file by file."""

    scans: list[ScanModel]
