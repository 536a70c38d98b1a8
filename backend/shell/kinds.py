"""What images a running backend makes of its snapshots, and how often."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from backend.pipeline.config import Config
from backend.pipeline.exact import Cells, own_image, own_machines
from backend.pipeline.images import SunParameters, ordered_pairs, pair_image
from backend.pipeline.records import Snapshot
from backend.pipeline.regions import regions_image
from backend.pipeline.zones import zone_image

SUN, EXACT, ZONE, REGIONS = "sun", "exact", "zone", "regions"


class Image(Protocol):
    """A finished image: of what ("left", "left<-right"), and of which state."""

    @property
    def key(self) -> str: ...

    @property
    def state_time(self) -> float: ...


@dataclass(frozen=True)
class ImageKind:
    """hz: how often; targets: what to make one of for a snapshot; make: called with a target."""

    name: str
    hz: float
    targets: Callable[[Snapshot], list[tuple[str, ...]]]
    make: Callable[..., Image]


def image_kinds(
    config: Config,
    sun: SunParameters,
    image_hz: float,
    zone_hz: float,
    tip_height: Callable[[str], float | None],
    cells: Cells | None = None,
) -> tuple[ImageKind, ...]:
    """tip_height: of a machine's reach image, as its operator picked it [m]; None: as it is."""
    size = cells or Cells()

    def pairs(snapshot: Snapshot) -> list[tuple[str, ...]]:
        return [*ordered_pairs(snapshot, config)]

    def machines(snapshot: Snapshot) -> list[tuple[str, ...]]:
        return [(own,) for own in own_machines(snapshot, config)]

    return (
        ImageKind(
            SUN, image_hz, pairs, lambda s, own, other: pair_image(s, config, own, other, sun)
        ),
        ImageKind(
            EXACT,
            image_hz,
            machines,
            lambda s, own: own_image(s, config, own, size, tip_height(own)),
        ),
        ImageKind(ZONE, zone_hz, pairs, lambda s, own, other: zone_image(s, config, own, other)),
        ImageKind(REGIONS, zone_hz, machines, lambda s, own: regions_image(s, config, own)),
    )
