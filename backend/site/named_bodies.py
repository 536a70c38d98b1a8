"""What stands on a site, and what its working gauge keeps machines from: the record.

Apart from `bodies`, which makes it: a playback without a gauge loads none of what that takes.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array

if TYPE_CHECKING:
    from backend.gauge.volumes import LimitVolume


@dataclass(frozen=True)
class SiteBodies:
    """Boxes that do not move, in the site frame, and their names ("wall", "hall/0", "hall/1").

    After the obstacles come the boxes of the working gauge ("gauge:T1/0"), of all volumes but the
    idle ones. volumes: of the working gauge; idle: by name of a volume, why it holds for nobody;
    always: names of volumes that hold for a machine that stands on them, too.
    """

    boxes: Boxes = NO_BOXES
    names: tuple[str, ...] = ()
    volumes: tuple[LimitVolume, ...] = ()
    idle: Mapping[str, str] = field(default_factory=dict)
    always: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if len(self.names) != len(self.boxes):
            raise ValueError(f"{len(self.boxes)} boxes have {len(self.names)} names")

    @cached_property
    def radii(self) -> Array:
        """(n,) of the spheres around the boxes [m]."""
        return np.asarray(np.linalg.norm(self.boxes.half_extents, axis=1))

    @cached_property
    def full_names(self) -> tuple[str, ...]:
        """ "site:wall", "site:hall/0", "gauge:T1/0"."""
        return tuple(name if _of_gauge(name) else f"site:{name}" for name in self.names)

    def without(self, names: Collection[str]) -> SiteBodies:
        """Without the boxes of these limit volumes, such as of the track that a machine stands on;
        itself when it has none of them.
        """
        dropped = {
            box for volume in self.volumes if volume.name in names for box in volume.box_names
        }
        kept = np.array([name not in dropped for name in self.names], dtype=bool)
        if kept.all():
            return self
        names_kept = tuple(name for name in self.names if name not in dropped)
        return replace(self, boxes=self.boxes.take(kept), names=names_kept)

    @cached_property
    def standing(self) -> SiteBodies:
        """Without the working gauge: what can be seen and touched."""
        kept = np.array([not _of_gauge(name) for name in self.names], dtype=bool)
        names = tuple(name for name in self.names if not _of_gauge(name))
        return SiteBodies(self.boxes.take(kept), names)


NO_SITE_BODIES = SiteBodies()


def _of_gauge(name: str) -> bool:
    return name.startswith("gauge:")
