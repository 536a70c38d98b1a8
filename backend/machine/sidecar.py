"""The sidecar: what a URDF cannot say about an excavator, in TOML. All tables are optional.

Keys that end in `_deg` are degrees; everything else is SI.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from backend.errors import InputError

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Vector: TypeAlias = tuple[Finite, Finite, Finite]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]
Elevation = Annotated[float, Field(ge=-90.0, le=90.0)]
VLP_16 = tuple(float(elevation) for elevation in range(-15, 16, 2))
Role = Literal["swing", "boom", "stick", "bucket", "tilt", "rotate"]


class Table(BaseModel):
    """A table in which unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=False)


class PointOnLink(Table):
    """link: the URDF's name; position [m] in its frame."""

    link: str
    position: Vector


class Heading(Table):
    """of: what the heading sensor turns with. offset_deg: sensor minus that body, CCW."""

    of: Literal["tracks", "upper"] = "upper"
    offset_deg: Finite = 0.0


class TracksTable(Table):
    """length over all, gauge (centre to centre), shoe [m]; speed [m/s], acceleration [m/s^2]."""

    length: Positive
    gauge: Positive
    shoe: Positive
    max_speed: Positive
    max_acceleration: Positive


class Limit(Table):
    """Replaces the URDF's limits of one joint."""

    lower_deg: Finite | None = None
    upper_deg: Finite | None = None
    max_velocity_deg: Positive | None = None
    max_acceleration_deg: Positive | None = None
    max_velocity: Positive | None = None  # [rad/s]
    max_acceleration: Positive | None = None  # [rad/s^2]
    max_torque: Positive | None = None  # [N m]


class BoxTable(Table):
    """center, half_extents [m] in the link's frame; turned by rpy_deg as in a URDF."""

    center: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    half_extents: tuple[Positive, Positive, Positive]


class BodiesTable(Table):
    """How meshes are fitted: at most max_boxes a link, at most max_excess [m] beyond the mesh.

    boxes: by the URDF's link, boxes that stand for its meshes and cylinders instead of a fit.
    """

    max_boxes: Annotated[int, Field(ge=1, le=64)] = 12
    max_excess: Positive = 0.15
    boxes: dict[str, Annotated[tuple[BoxTable, ...], Field(min_length=1, max_length=64)]] = {}


class SelfCollision(Table):
    """exclude: pairs of bodies ("boom/0") or parts ("boom") that do not count.

    rest_deg: postures in which whatever touches does not count; joints not named are at the middle
    of their range.
    """

    exclude: tuple[tuple[str, str], ...] = ()
    rest_deg: tuple[dict[Role, Finite], ...] = ()


class LidarTable(Table):
    """One LiDAR. name: its clouds' frame_id; link: "base" is the URDF's root, "upper" what the
    swing turns; xyz: lever arm [m], turned by rpy_deg as in a URDF, z is the axis it spins about;
    elevations_deg: of its beams above the plane across that axis, as a VLP-16's by default.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=64)] = "lidar"
    link: Literal["upper", "base"] = "upper"
    xyz: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    elevations_deg: Annotated[tuple[Elevation, ...], Field(min_length=1, max_length=128)] = VLP_16


class Sidecar(Table):
    """One machine's sidecar as read."""

    title: str | None = None
    payload: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None = None
    masses_trusted: bool = False
    assumed: tuple[str, ...] = ()  # what of the description is, in words
    joints: dict[Role, str] = {}
    limits: dict[Role, Limit] = {}
    end_point: PointOnLink | None = None
    gnss: PointOnLink | None = None
    eye: PointOnLink | None = None
    heading: Heading | None = None
    tracks: TracksTable | None = None
    bodies: BodiesTable = BodiesTable()
    self_collision: SelfCollision = SelfCollision()
    lidar: Annotated[tuple[LidarTable, ...], Field(max_length=8)] = ()
    cylinder: tuple[dict[str, object], ...] = ()  # checked by cylinders_read


def read_sidecar(path: Path) -> Sidecar:
    """The sidecar in a TOML file. Raises InputError with file, field, value and what is allowed."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML: {error}.") from None
    try:
        return Sidecar.model_validate(data)
    except ValidationError as error:
        raise InputError(_sentence(path, error)) from None


def _sentence(path: Path, error: ValidationError) -> str:
    # A misspelt key also leaves the right one missing: say the misspelling first.
    found = error.errors()
    first = next((e for e in found if e["type"] == "extra_forbidden"), found[0])
    place = [str(part) for part in first["loc"] if part != "[key]"]
    field = ".".join(place)
    if first["type"] == "extra_forbidden":
        allowed = ", ".join(_fields_at(place[:-1]))
        return f"{path}: field '{field}' is not known; allowed are {allowed}."
    value = first["input"]
    shown = "" if isinstance(value, dict) else f" = {value!r}"
    if isinstance(value, float) and not math.isfinite(value):
        shown = f" = {value}"
    return f"{path}: field '{field}'{shown}: {first['msg']}."


def _fields_at(place: list[str]) -> list[str]:
    model: type[BaseModel] = Sidecar
    inner: dict[str, type[BaseModel]] = {
        "end_point": PointOnLink,
        "gnss": PointOnLink,
        "eye": PointOnLink,
        "heading": Heading,
        "tracks": TracksTable,
        "limits": Limit,
        "bodies": BodiesTable,
        "self_collision": SelfCollision,
        "lidar": LidarTable,
    }
    if place[:2] == ["bodies", "boxes"]:
        model = BoxTable
    elif place:
        model = inner.get(place[0], Sidecar)
    return list(model.model_fields)
