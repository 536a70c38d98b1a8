"""Which use cases of the working gauge a site is the scene of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.planning.use_cases import MODEL, NAMES, use_case
from backend.site.named_bodies import SiteBodies
from backend.site.site import Site
from backend.spatial import rotation, transform
from backend.spatial.boxes import CORNER_SIGNS, Boxes
from backend.spatial.types import Array

ALONG = 10.0
"""[m] of track each way from the machine on which the limits must be those of the use case."""
SAME = 0.05
"""[m] by which a limit of the site may fall short of the use case's."""


class Offer(NamedTuple):
    """machine: the site's, that stands where the use case begins; T_site_root: (4, 4) there."""

    name: str
    machine: str
    T_site_root: Array


def offers(site: Site, bodies: SiteBodies) -> tuple[Offer, ...]:
    """The use cases whose every limit the site has, seen from a machine of the same model where
    the site file starts it; one machine for each, the first. What else the site has is no matter.
    """
    found = {}
    for machine in site.machines:
        if machine.model != MODEL or machine.sidecar is not None or machine.start is None:
            continue
        position = site.frame.from_projected(np.array([machine.start.position]))[0]
        T = transform.make(rotation.from_attitude(*machine.start.attitude), position)
        for name in NAMES:
            if name not in found and covered(use_case(name).limits.boxes, T, bodies.boxes):
                found[name] = Offer(name, machine.name, T)
    return tuple(found.values())


def covered(limits: Boxes, T_site_root: Array, boxes: Boxes) -> bool:
    """Whether all corners of the limits, which lie along the axes of the root frame, are within
    one of the boxes each; ends beyond ALONG do not count.
    """
    if not len(limits):
        return False
    low = np.maximum(limits.centers - limits.half_extents, [-ALONG, -np.inf, -np.inf])
    high = np.minimum(limits.centers + limits.half_extents, [ALONG, np.inf, np.inf])
    half = np.maximum(0.5 * (high - low) - SAME, 0.0)
    corners = (0.5 * (low + high))[:, None] + CORNER_SIGNS * half[:, None]
    points = corners.reshape(-1, 3) @ T_site_root[:3, :3].T + T_site_root[:3, 3]
    local = np.einsum("byx,pby->pbx", boxes.rotations, points[:, None] - boxes.centers)
    inside = (np.abs(local) <= boxes.half_extents).all(axis=2)
    return bool(inside.any(axis=1).all())
