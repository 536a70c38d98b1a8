"""What a machine must not come near, as pairs of boxes, and the certified check of a way."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from backend.machine.model import Machine
from backend.planning.trajectory import sweep_kernels
from backend.planning.trajectory.records import Obstacles
from backend.planning.trajectory.sweep_kernels import Boxed, Chain, Pairs
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array

OWN = 0.03
"""How far apart the machine's own bodies are kept [m]."""
GROUND = 0.02
"""And what moves from the ground [m]."""
CONTACT = 0.01
"""Nearer than this counts as touching [m]."""
THE_GROUND = "the ground"
_KEPT = 0.8  # of the distance at samples that holds between them, too
_MORE = 1.15  # times the distances asked for are kept by a way that is rounded off later


@dataclass(frozen=True)
class Sweep:
    """A machine among obstacles, in its root frame. names: (p,) of what each pair is about."""

    chain: Chain
    boxes: Boxed
    pairs: Pairs
    names: tuple[str, ...]

    def distances(self, q: Array) -> Array:
        """(p,) signed distance of every pair at q (n,) [m]."""
        out = np.empty(len(self.names))
        sweep_kernels.distances(self.chain, self.boxes, self.pairs, np.ascontiguousarray(q), out)
        return out

    def near(self, q: Array) -> list[tuple[float, str]]:
        """Pairs nearer at q (n,) than they may be: distance [m] and name, the nearest first, each
        name once.
        """
        found: dict[str, float] = {}
        d = self.distances(q)
        for p in np.flatnonzero(d < self.pairs[2]):
            found[self.names[p]] = min(float(d[p]), found.get(self.names[p], np.inf))
        return sorted((distance, name) for name, distance in found.items())

    def least_along(self, q: Array) -> tuple[float, float, float]:
        """Shortest distances in postures (m, n): of own bodies to each other, to obstacles, and to
        the ground; infinite where there are none [m].
        """
        kinds = np.array([0 if name.startswith("its own") else 1 for name in self.names])
        kinds[[name == THE_GROUND for name in self.names]] = 2
        least = np.full(3, np.inf)
        sweep_kernels.least_along(
            self.chain, self.boxes, self.pairs, kinds, np.ascontiguousarray(q), least
        )
        return float(least[0]), float(least[1]), float(least[2])

    def blocked(self, points: Array) -> str | None:
        """What is in the way along the polyline (m, n), None where all of it is free: no pair comes
        nearer than its distance at the samples, or 0.8 of that between them.
        """
        for a, b in pairwise(points):
            pair = sweep_kernels.blocker(
                self.chain, self.boxes, self.pairs, np.ascontiguousarray(a), np.ascontiguousarray(b)
            )
            if pair >= 0:
                return str(self.names[pair])
        return None

    @property
    def kept(self) -> float:
        """The least that any pair with an obstacle keeps [m], the ground not counted."""
        outer = [not name.startswith("its own") and name != THE_GROUND for name in self.names]
        return float(self.pairs[3][outer].min(initial=np.inf))

    def widened(self, q: Array) -> Sweep:
        """With more distance where postures (m, n) have it: room for a way to be rounded off."""
        room = np.min([self.distances(posture) for posture in q], axis=0)
        clear = np.maximum(self.pairs[2], np.minimum(_MORE * self.pairs[2], room - 1e-9))
        return replace(self, pairs=(*self.pairs[:2], clear, _KEPT * clear, self.pairs[4]))

    def relaxed(self, q: Array) -> Sweep:
        """With the distances of q (n,) where they are shorter: nothing comes nearer than it is."""
        clear = np.minimum(self.pairs[2], np.maximum(self.distances(q) - 1e-9, 0.0))
        return replace(self, pairs=(*self.pairs[:2], clear, _KEPT * clear, self.pairs[4]))


def make_sweep(machine: Machine, obstacles: Obstacles, clearance: float) -> Sweep:
    """clearance: to obstacles [m]; own bodies keep OWN, the ground GROUND."""
    bodies, count = machine.bodies, len(machine.bodies)
    held, names = [bodies, obstacles.boxes], list(obstacles.names)
    if obstacles.ground:
        wide = 2.0 * machine.bounding_radius
        held.append(Boxes(np.array([[0, 0, -wide]]), np.eye(3)[None], np.full((1, 3), wide)))
        names.append(THE_GROUND)
    boxes = concatenated(held)
    moving = np.flatnonzero(machine.body_joints.any(axis=1))
    own = machine.self_pair_index
    outer = np.stack(
        [np.repeat(moving, len(names)), count + np.tile(np.arange(len(names)), len(moving))], axis=1
    )
    pairs = np.concatenate([own, outer])
    clear = np.full(len(pairs), float(clearance))
    clear[: len(own)] = OWN
    if obstacles.ground:
        clear[pairs[:, 1] == len(boxes) - 1] = GROUND
    reach = machine.stretched_levers
    own_levers = np.maximum(reach[own[:, 0]], reach[own[:, 1]]) * machine.self_pair_joints
    levers = np.concatenate([own_levers, reach[outer[:, 0]]])
    words = [f"its own {machine.body_names[i]} and {machine.body_names[j]}" for i, j in own]
    words += [names[j - count] for j in outer[:, 1]]
    return Sweep(
        (
            machine.link_matrices,
            machine.link_parents,
            machine.link_joints,
            machine.body_link_index,
        ),
        (
            boxes.centers.copy(),
            boxes.rotations.copy(),
            boxes.half_extents.copy(),
            np.linalg.norm(boxes.half_extents, axis=1),
        ),
        (
            np.ascontiguousarray(pairs[:, 0]),
            np.ascontiguousarray(pairs[:, 1]),
            clear,
            _KEPT * clear,
            np.ascontiguousarray(levers),
        ),
        tuple(words),
    )
