"""What operators choose of a working gauge while it is in use: areas they draw, and switches.

The record only, so that whoever plays a session without a gauge loads nothing of what makes one;
`gauge_in_force` makes bodies of it.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, Literal, TypeAlias, get_args

from backend.errors import InputError

DrawnKind: TypeAlias = Literal["keep_out", "keep_in"]
Corner: TypeAlias = tuple[float, float]

KINDS: tuple[str, ...] = get_args(DrawnKind)
NAME = r"[^\W_][\w .-]{0,31}"
MOST_AREAS, MOST_CORNERS, MOST_IN_ALL, LEAST_AREA = 50, 40, 400, 0.01
"""Areas drawn on a site, corners of one and of all, and the smallest that is one [m²]. What is made
of 40 corners takes a second at worst, and is made anew at every start."""
FARTHEST = 1.0e5
"""Of a corner or height from the site's origin [m]."""


@dataclass(frozen=True)
class Drawn:
    """One area as drawn, in the site frame [m]; no clearance is added. polygon: corners in order;
    bottom, top: heights, which only a keep-in area may leave out.
    """

    name: str
    kind: DrawnKind
    polygon: tuple[Corner, ...]
    bottom: float | None = None
    top: float | None = None


@dataclass(frozen=True)
class GaugeChoice:
    """drawn: areas, with different names; switched: (name, on) of limit volumes, by name: on holds
    whatever the volume's state, and for who stands on it; off holds for nobody.
    """

    drawn: tuple[Drawn, ...] = ()
    switched: tuple[tuple[str, bool], ...] = ()

    def __hash__(self) -> int:
        """Quick, for caches that are asked in every cycle; equality counts every corner."""
        return hash((tuple(area.name for area in self.drawn), self.switched))

    @cached_property
    def digest(self) -> str:
        """Tells one choice from another, for who looks whether it changed."""
        return f"{zlib.crc32(repr((self.drawn, self.switched)).encode()):08x}"

    @property
    def names(self) -> tuple[str, ...]:
        """Of the drawn areas."""
        return tuple(area.name for area in self.drawn)

    def with_area(self, area: Drawn) -> GaugeChoice:
        """With an area, in the place of one of the same name, else at the end."""
        if area.name not in self.names:
            return GaugeChoice((*self.drawn, area), self.switched)
        kept = tuple(area if known.name == area.name else known for known in self.drawn)
        return GaugeChoice(kept, self.switched)

    def without_area(self, name: str) -> GaugeChoice:
        """Without an area and its switch."""
        kept = tuple(area for area in self.drawn if area.name != name)
        return GaugeChoice(kept, self.switched).with_switch(name, None)

    def with_switch(self, name: str, on: bool | None) -> GaugeChoice:
        """on: None for as its state says."""
        switches = {known: value for known, value in self.switched if known != name}
        if on is not None:
            switches[name] = on
        return GaugeChoice(self.drawn, tuple(sorted(switches.items())))


NO_CHOICE = GaugeChoice()


def checked(choice: GaugeChoice, taken: Collection[str] = ()) -> GaugeChoice:
    """The choice itself. taken: names of the site's own limit volumes.

    Raises InputError with one sentence for an area that cannot be kept, names that occur twice and
    too many areas.
    """
    if len(choice.drawn) > MOST_AREAS:
        raise InputError(f"gauge: {len(choice.drawn)} areas are drawn; allowed are {MOST_AREAS}.")
    corners = sum(len(area.polygon) for area in choice.drawn)
    if corners > MOST_IN_ALL:
        raise InputError(
            f"gauge: the areas have {corners} corners in all; allowed are {MOST_IN_ALL}."
        )
    seen: set[str] = set()
    for area in choice.drawn:
        _check_area(area)
        if area.name in seen or area.name in taken:
            raise InputError(f'gauge: the name "{area.name}" is taken; allowed is another one.')
        seen.add(area.name)
    return choice


def _check_area(area: Drawn) -> None:
    if not re.fullmatch(NAME, area.name) or area.name != area.name.strip():
        raise InputError(
            f"gauge: {area.name[:40]!r} is no name of an area; allowed are 1 to 32 letters, "
            "digits, spaces and _.-, the first a letter or digit."
        )
    where = f"gauge: {area.name}"
    if area.kind not in KINDS:
        raise InputError(f"{where}: kind is {area.kind!r}; allowed are {', '.join(KINDS)}.")
    if not 3 <= len(area.polygon) <= MOST_CORNERS:
        raise InputError(
            f"{where}: the polygon has {len(area.polygon)} corners; "
            f"allowed are 3 to {MOST_CORNERS}."
        )
    heights = [height for height in (area.bottom, area.top) if height is not None]
    numbers = [*heights, *(value for corner in area.polygon for value in corner)]
    if not all(math.isfinite(value) and abs(value) <= FARTHEST for value in numbers):
        raise InputError(
            f"{where}: a coordinate is not a number within {FARTHEST:.0f} m of the site's origin; "
            "allowed are such numbers."
        )
    if area.kind == "keep_out" and len(heights) < 2:
        raise InputError(f"{where}: has no bottom or no top; allowed is a keep-out area with both.")
    if area.bottom is not None and area.top is not None and not area.bottom < area.top:
        raise InputError(
            f"{where}: top is {area.top:g} m; allowed is more than bottom ({area.bottom:g} m)."
        )
    _check_polygon(area, where)


def _check_polygon(area: Drawn, where: str) -> None:
    import numpy as np

    from backend.gauge.convex import polygon_of  # shapely, for who draws

    if polygon_of(np.array(area.polygon), where).area <= LEAST_AREA:
        raise InputError(
            f"{where}: the polygon encloses {LEAST_AREA:g} m² or less; allowed is more."
        )


def as_document(choice: GaugeChoice) -> dict[str, Any]:
    """Plain lists and dicts, from which `from_document` makes the same again, bit by bit."""
    return {
        "drawn": [
            {**asdict(area), "polygon": [list(corner) for corner in area.polygon]}
            for area in choice.drawn
        ],
        "switched": dict(choice.switched),
    }


def from_document(document: Mapping[str, Any]) -> GaugeChoice:
    """Not checked. Raises KeyError, TypeError or ValueError for what is no such document."""

    def height(value: Any) -> float | None:
        return None if value is None else float(value)

    drawn = tuple(
        Drawn(
            name=str(area["name"]),
            kind=area["kind"],
            polygon=tuple((float(x), float(y)) for x, y in area["polygon"]),
            bottom=height(area.get("bottom")),
            top=height(area.get("top")),
        )
        for area in document["drawn"]
    )
    switched = ((str(name), bool(on)) for name, on in document["switched"].items())
    return GaugeChoice(drawn, tuple(sorted(switched)))
