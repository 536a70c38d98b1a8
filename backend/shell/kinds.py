"""What images a running backend makes of its snapshots.

What makes them is imported where they are made: that is compiled code, a second of loading, and a
program that waits for it could have shown its page meanwhile.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters, ordered_pairs, pair_image
from backend.pipeline.records import Snapshot
from backend.shell.recent import SPAN

if TYPE_CHECKING:
    from backend.pipeline.exact import Cells
    from backend.site.travel import Way

SUN, EXACT, ZONE, REGIONS, ALONG = "sun", "exact", "zone", "regions", "along"
AROUND = "around"
"""Zones of people and the site, which are images of the kind ZONE."""


class Image(Protocol):
    """A finished image: of what ("left", "left<-right"), and of which state."""

    @property
    def key(self) -> str: ...

    @property
    def state_time(self) -> float: ...


@dataclass(frozen=True)
class Wishes:
    """What operators chose. tip_heights: of the reach images, by machine [m]; recent: postures of
    the last seconds, the oldest first, of the machines whose strip along the track is looked at.
    """

    tip_heights: Mapping[str, float]
    recent: Mapping[str, tuple[tuple[float, ...], ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Made:
    """An image, its kind, and how long it took [s]."""

    kind: str
    image: Image
    seconds: float


@dataclass(frozen=True)
class Recipe:
    """Kinds that are made together, one after the other. Plain data, for another process.

    cells: None for the usual number; ways: the site's tracks.
    """

    config: Config
    sun: SunParameters
    kinds: tuple[str, ...]
    cells: Cells | None = None
    ways: tuple[Way, ...] = ()


def make_images(recipe: Recipe, snapshot: Snapshot, wishes: Wishes) -> list[Made]:
    """All images of a recipe that mean something for this snapshot."""
    made: list[Made] = []
    for kind in recipe.kinds:
        for make in _makers(kind, recipe, snapshot, wishes):
            start = time.perf_counter()
            image = make()
            made.append(Made(ZONE if kind == AROUND else kind, image, time.perf_counter() - start))
    return made


def _makers(
    kind: str, recipe: Recipe, snapshot: Snapshot, wishes: Wishes
) -> list[Callable[[], Image]]:
    config = recipe.config
    if kind == ALONG:
        return _along(recipe, snapshot, wishes)
    if kind == AROUND:
        from backend.pipeline.zones_around import zones_around

        around = zones_around(snapshot, config)
        return [partial(make, snapshot, config, own) for make, own in around]
    if kind in (SUN, ZONE):
        pairs = ordered_pairs(snapshot, config)
        if kind == ZONE:
            from backend.pipeline.zones import zone_image

            return [partial(zone_image, snapshot, config, *pair) for pair in pairs]
        return [partial(pair_image, snapshot, config, *pair, recipe.sun) for pair in pairs]
    from backend.pipeline.exact import Cells, own_image, own_machines

    machines = own_machines(snapshot, config)
    if kind == REGIONS:
        from backend.pipeline.regions import regions_image

        return [partial(regions_image, snapshot, config, own) for own in machines]
    cells, heights = recipe.cells or Cells(), wishes.tip_heights
    return [partial(own_image, snapshot, config, own, cells, heights.get(own)) for own in machines]


def _along(recipe: Recipe, snapshot: Snapshot, wishes: Wishes) -> list[Callable[[], Image]]:
    """Strips of the machines that are looked at and stand on a track."""
    from backend.pipeline.along import along_image, own_way

    found: list[Callable[[], Image]] = []
    for own, recent in wishes.recent.items():
        way = own_way(snapshot, recipe.ways, own) if own in recipe.config.own else None
        if way is not None and recent:
            postures = np.array(recent)
            found.append(partial(along_image, snapshot, recipe.config, own, way, postures, SPAN))
    return found
