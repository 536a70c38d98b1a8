"""What every table of a site file is made of."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

Vector: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]
Degrees: TypeAlias = Annotated[float, Field(ge=-360.0, le=360.0)]
Tilt: TypeAlias = Annotated[float, Field(ge=-45.0, le=45.0)]
Positive: TypeAlias = Annotated[float, Field(gt=0.0)]
NotNegative: TypeAlias = Annotated[float, Field(ge=0.0)]
Name: TypeAlias = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=64)]
MachineName: TypeAlias = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=32)]
Prefix: TypeAlias = Annotated[
    str, Field(pattern=r"^[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*$", max_length=128)
]

RosTopic: TypeAlias = Annotated[
    str, Field(pattern=r"^/[A-Za-z0-9_-]+(/[A-Za-z0-9_-]+)*$", max_length=256)
]


class Table(BaseModel):
    """One table: unknown fields, wrong types, NaN and infinities are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)
