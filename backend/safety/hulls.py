"""One box about all bodies of each link: enough where machines are far apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray, IntArray


@dataclass(frozen=True)
class Hulls:
    """The bodies of a machine, then the hulls, each in the frame of its link: k in all.

    link, group: (k,) the link and the hull of each, as an index into these k; moves: (k, n) whether
    a joint moves it; names: "boom/0", and "boom" for hulls.
    """

    centers: Array
    rotations: Array
    half_extents: Array
    link: IntArray
    group: IntArray
    moves: BoolArray
    names: tuple[str, ...]

    def placed(self, T_site_links: Array) -> tuple[Array, Array, Array]:
        """Centers (k, 3), rotations (k, 3, 3) and half extents (k, 3) in the site frame [m]."""
        T = T_site_links[self.link]
        R = T[:, :3, :3]
        centers = (R @ self.centers[:, :, None])[:, :, 0] + T[:, :3, 3]
        return centers, R @ self.rotations, self.half_extents

    def around(self, T_site_links: Array) -> Boxes:
        """The hulls alone, in the site frame."""
        return Boxes(*self.placed(T_site_links)).take(self.group == np.arange(len(self.group)))


_KEPT: dict[int, tuple[Machine, Hulls]] = {}


def hulls(machine: Machine) -> Hulls:
    """The hulls of a machine's description, which does not change."""
    kept = _KEPT.get(id(machine))
    if kept is None or kept[0] is not machine:
        kept = _KEPT[id(machine)] = (machine, _made(machine))
    return kept[1]


def _made(machine: Machine) -> Hulls:
    links = machine.body_link_index
    carrying = list(dict.fromkeys(links.tolist()))
    corners = machine.body_corners
    low = np.array([corners[links == k].min(axis=(0, 1)) for k in carrying])
    high = np.array([corners[links == k].max(axis=(0, 1)) for k in carrying])
    n = len(links)
    first = [int(np.flatnonzero(links == k)[0]) for k in carrying]
    return Hulls(
        centers=np.concatenate([machine.bodies.centers, 0.5 * (low + high)]),
        rotations=np.concatenate([machine.bodies.rotations, np.tile(np.eye(3), (len(low), 1, 1))]),
        half_extents=np.concatenate([machine.bodies.half_extents, 0.5 * (high - low)]),
        link=np.concatenate([links, np.array(carrying)]),
        group=np.concatenate(
            [n + np.array([carrying.index(k) for k in links]), n + np.arange(len(carrying))]
        ),
        moves=np.concatenate([machine.body_joints, machine.body_joints[first]]),
        names=(*machine.body_names, *(machine.part_of_body(k) for k in first)),
    )
