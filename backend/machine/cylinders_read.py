"""The sidecar's `[[cylinder]]` tables as cylinders.

[[cylinder]]
name = "boom"
barrel_link = "body_link"           # the URDF's link names
barrel_pivot = [0.69, 0.0, 0.25]    # in that link's frame [m]
rod_link = "boom_link"
rod_pivot = [1.41, 0.0, 2.01]       # left out with a linkage
carried_by = "boom_link"            # whose bodies enclose the sweep; without bodies: the barrel's
hinge = [0.0, 1.0, 0.0]             # direction of the pins, in carried_by's frame
closed_length = 1.5                 # from pin to pin where its sensor reads 0; default: shortest

[cylinder.barrel]                   # and the same for [cylinder.rod]; neither: no bodies, pins only
mesh = "package://.../barrel.dae"   # as in the URDF
pin = [0.0, 0.0, 0.0]               # its own pin, in the mesh's frame [m]
toward = [0.56, 0.0, 1.55]          # a point of its axis, toward the other pin
# or, without a mesh:
# radius = 0.09
# length = 1.4                      # from its own pin toward the other
# spread = 0.3                      # a pair: half the distance between the two

[cylinder.linkage]                  # where a rocker and a tie stand between rod and bucket
rocker_pivot = [1.58, 0.0, 1.88]    # in barrel_link's frame [m]
tie_pivot = [-0.29, 0.0, 0.35]      # in rod_link's frame [m]
rocker_length = 0.58
tie_length = 0.56
side = 1                            # which of the two ways the linkage can close
# rocker and tie: tables like barrel and rod
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from backend.errors import InputError
from backend.machine.cylinders import Cylinder, Linkage, Strut, tube
from backend.spatial.types import Array

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Vector: TypeAlias = tuple[Finite, Finite, Finite]
LoadMesh: TypeAlias = Callable[[str], Array]
"""From a mesh's name as the URDF writes it to its triangles (n, 3, 3) [m]."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StrutTable(_Table):
    """A mesh with its pin and axis, or a round bar."""

    mesh: str | None = None
    pin: Vector = (0.0, 0.0, 0.0)
    toward: Vector | None = None
    hinge: Vector = (0.0, 1.0, 0.0)
    radius: Positive | None = None
    length: Positive | None = None
    spread: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0

    @model_validator(mode="after")
    def _one_of(self) -> StrutTable:
        if self.mesh is not None and self.toward is None:
            raise ValueError("a mesh needs 'toward', a point of its axis")
        if self.mesh is None and (self.radius is None or self.length is None):
            raise ValueError("give 'mesh' with 'toward', or 'radius' with 'length'")
        return self


class LinkageTable(_Table):
    rocker_pivot: Vector
    tie_pivot: Vector
    rocker_length: Positive
    tie_length: Positive
    side: Literal[-1, 1]
    rocker: StrutTable | None = None
    tie: StrutTable | None = None


class CylinderFields(_Table):
    name: str
    barrel_link: str
    barrel_pivot: Vector
    rod_link: str
    rod_pivot: Vector | None = None
    carried_by: str | None = None
    hinge: Vector = (0.0, 1.0, 0.0)
    barrel: StrutTable | None = None
    rod: StrutTable | None = None
    linkage: LinkageTable | None = None
    closed_length: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None = None

    @model_validator(mode="after")
    def _either(self) -> CylinderFields:
        if (self.rod_pivot is None) == (self.linkage is None):
            raise ValueError("give either 'rod_pivot' or a 'linkage'")
        if (self.barrel is None) != (self.rod is None):
            raise ValueError("give both 'barrel' and 'rod', or neither for pins alone")
        if self.barrel is not None and self.carried_by is None:
            raise ValueError("give 'carried_by', the link whose bodies enclose the cylinder")
        return self


def read_cylinder(table: Mapping[str, object], load_mesh: LoadMesh, file: str) -> Cylinder:
    """One `[[cylinder]]` table as a cylinder. Raises InputError naming file, field and value."""
    label = f"cylinder {table.get('name', '')}".strip()
    try:
        t = CylinderFields.model_validate(dict(table))
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "cylinder"
        given = first["input"]
        shown = "" if isinstance(given, Mapping | BaseModel) else f" = {given!r}"
        raise InputError(f"{file}: {label}: field '{field}'{shown}: {first['msg']}.") from None
    try:
        linkage = None
        if t.linkage is not None:
            k = t.linkage
            linkage = Linkage(
                rocker_pivot=np.array(k.rocker_pivot),
                tie_pivot=np.array(k.tie_pivot),
                rocker_length=k.rocker_length,
                tie_length=k.tie_length,
                side=k.side,
                rocker=None if k.rocker is None else _strut(k.rocker, load_mesh),
                tie=None if k.tie is None else _strut(k.tie, load_mesh),
            )
        return Cylinder(
            name=t.name,
            barrel_link=t.barrel_link,
            barrel_pivot=np.array(t.barrel_pivot),
            rod_link=t.rod_link,
            rod_pivot=None if t.rod_pivot is None else np.array(t.rod_pivot),
            carried_by=t.carried_by or t.barrel_link,
            hinge=_unit(t.hinge),
            barrel=None if t.barrel is None else _strut(t.barrel, load_mesh),
            rod=None if t.rod is None else _strut(t.rod, load_mesh),
            linkage=linkage,
            closed_length=t.closed_length,
        )
    except ValueError as error:
        raise InputError(f"{file}: {label}: {error}.") from None


def _strut(table: StrutTable, load_mesh: LoadMesh) -> Strut:
    if table.mesh is not None:
        assert table.toward is not None
        pin, toward = np.array(table.pin), np.array(table.toward)
        triangles = load_mesh(table.mesh)
        if table.length is not None and np.linalg.norm(toward - pin) > 0.0:
            along = (toward - pin) / np.linalg.norm(toward - pin)
            from backend.machine.fitting_clip import clip

            triangles = clip(triangles, along, float(along @ pin) + table.length)
        return Strut(triangles, pin, toward, _unit(table.hinge))
    assert table.radius is not None
    assert table.length is not None
    bar = tube(table.radius, table.length, table.spread)
    return Strut(bar, np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))


def _unit(v: Vector) -> Array:
    size = float(np.linalg.norm(v))
    if size < 1e-9:
        raise ValueError("hinge must not be zero")
    return np.array(v) / size
