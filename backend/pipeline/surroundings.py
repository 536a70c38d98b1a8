"""What one machine can touch now, in its own root frame, by name and layer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.pipeline.records import Body3D
from backend.spatial import transform
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.types import BoolArray

PARTNER, SITE = "partner", "site"


@dataclass(frozen=True)
class SiteBodies:
    """Boxes that do not move, in the site frame, and their names."""

    boxes: Boxes = NO_BOXES
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.names) != len(self.boxes):
            raise ValueError(f"{len(self.boxes)} boxes have {len(self.names)} names")


NO_SITE_BODIES = SiteBodies()


@dataclass(frozen=True)
class Surroundings:
    """boxes: in the machine's root frame; names: "right:stick/0", "site:wall"; partner: (n,) the
    box is of another machine, else of the site.
    """

    boxes: Boxes
    names: tuple[str, ...]
    partner: BoolArray

    @property
    def layers(self) -> dict[str, Boxes]:
        """ "partner" and "site"."""
        return {PARTNER: self.boxes.take(self.partner), SITE: self.boxes.take(~self.partner)}


def surroundings(
    machine: Machine, body: Body3D, others: Mapping[str, tuple[Machine, Body3D]], site: SiteBodies
) -> Surroundings:
    """Everything within `machine`'s reach in any posture.

    body: where `machine` is; others: all other machines by name.
    """
    boxes = [site.boxes]
    names = [f"site:{name}" for name in site.names]
    partner = [False] * len(site.boxes)
    for name, (other, placed) in others.items():
        boxes.append(placed.boxes)
        names += [f"{name}:{part}" for part in other.body_names]
        partner += [True] * len(placed.boxes)
    everything = concatenated(boxes)
    near = within(everything, body, machine.bounding_radius)
    return Surroundings(
        everything.take(near).moved(transform.inverse(body.link_poses[0])),
        tuple(name for name, kept in zip(names, near, strict=True) if kept),
        np.array(partner, dtype=bool)[near],
    )


def within(boxes: Boxes, body: Body3D, radius: float) -> BoolArray:
    """(n,) whether a box comes closer to the swing centre than `radius` [m]."""
    to_center = body.swing_center - boxes.centers
    local = np.abs(np.einsum("nji,nj->ni", boxes.rotations, to_center))
    outside = np.maximum(local - boxes.half_extents, 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1) <= radius)
