"""Simulated people and vehicles of a site, as its file lists them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, TypeAlias

from pydantic import Field, model_validator

from backend.site.base import Name, NotNegative, Positive, Table

Point: TypeAlias = tuple[float, float]
Path: TypeAlias = Annotated[tuple[Point, ...], Field(min_length=1, max_length=256)]
Speed: TypeAlias = Annotated[float, Field(gt=0.0, le=30.0)]


class Person(Table):
    """Somebody who walks, either along `path` and back again, or at random (`seed`) about `around`.

    path, around: east, north in the projected CRS [m]; pause: at each end and corner of the path
    [s]; one point: stands there; within: radii of the ring about `around` [m]; speed: on the path
    [m/s]; height [m].
    """

    name: Name
    path: Path | None = None
    speed: Speed = 1.2
    pause: NotNegative = 0.0
    seed: Annotated[int, Field(ge=0)] | None = None
    around: Point | None = None
    within: tuple[Positive, Positive] = (3.0, 12.0)
    height: Annotated[float, Field(ge=0.5, le=2.5)] = 1.75

    @model_validator(mode="after")
    def _one_way(self) -> Person:
        random = (self.seed, self.around)
        if None in random if self.path is None else random != (None, None):
            raise ValueError('needs one way to go; allowed is "path", or "seed" with "around"')
        if self.within[1] < self.within[0] + 3.0:
            raise ValueError(
                f"within is {list(self.within)}; allowed is a ring of 3 m in width or more"
            )
        _refuse_standing(self.path or ())
        return self


class Vehicle(Table):
    """A box that drives along `path` and back again, backwards, on the ground. path: east, north of
    its middle in the projected CRS [m]; size: length, width, height [m]; pause: at each end and
    corner [s]; speed [m/s].
    """

    name: Name
    path: Annotated[Path, Field(min_length=2)]
    size: tuple[Positive, Positive, Positive]
    speed: Speed = 2.0
    pause: NotNegative = 0.0

    @model_validator(mode="after")
    def _moves(self) -> Vehicle:
        _refuse_standing(self.path)
        return self


def _refuse_standing(path: tuple[Point, ...]) -> None:
    for a, b in pairwise(path):
        if math.dist(a, b) < 0.01:
            raise ValueError(f"path has {list(a)} twice in a row; allowed are different points")
