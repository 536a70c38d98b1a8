"""Random scenes for the exact images: a machine on a slope, a partner beside it, boxes around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation
from separating_axes import box_gaps, placed, touching

from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes, concatenated

STEEPEST = np.radians(15.0)


@dataclass(frozen=True)
class Scene:
    """layers: "partner" and "site", in the root frame of `machine`; gap: between the tracks [m]."""

    machine: Machine
    partner: Machine
    gap: float
    layers: dict[str, Boxes]

    @property
    def obstacles(self) -> Boxes:
        return concatenated(self.layers.values())

    @property
    def name(self) -> str:
        return f"{self.machine.name} by {self.partner.name}"


def base(rng: np.random.Generator, p: np.ndarray) -> np.ndarray:
    """(4, 4) of a base at p on a slope of up to 15 degrees each way, of any yaw."""
    T = np.eye(4)
    yaw, pitch, roll = rng.uniform(-np.pi, np.pi), *rng.uniform(-STEEPEST, STEEPEST, 2)
    T[:3, :3] = Rotation.from_euler("ZYX", [yaw, -pitch, roll]).as_matrix()
    T[:3, 3] = p
    return T


def configurations(rng: np.random.Generator, machine: Machine, count: int) -> np.ndarray:
    """(count, joints) within the limits [rad]."""
    low, high = np.maximum(machine.lower, -np.pi), np.minimum(machine.upper, np.pi)
    return rng.uniform(low, high, (count, len(low)))


def site_boxes(rng: np.random.Generator, reach: float, count: int) -> Boxes:
    """Blocks, walls, slabs and poles about a machine, turned any way but mostly upright."""
    bearing, away = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.3, 1.05, count) * reach
    centers = [
        away * np.cos(bearing),
        away * np.sin(bearing),
        rng.uniform(-0.2, 0.6, count) * reach,
    ]
    turns = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi, (count, 1)))
    tilts = Rotation.from_rotvec(rng.normal(0.0, 0.3, (count, 3)) * (rng.random((count, 1)) < 0.5))
    half = rng.uniform(0.03, 0.15, (count, 3)) * reach
    # A third are thin: a wall or slab, or a pole.
    thin = rng.integers(0, 9, count)
    half[thin == 0, 0] = 0.005
    half[thin == 1, 2] = 0.005
    half[thin == 2, :2] = 0.02
    return Boxes(np.stack(centers, axis=1), (turns * tilts).as_matrix(), half)


def random_scene(seed: int, models: Sequence[Machine], clear: float = 0.0) -> Scene:
    """Machine `seed` of the models, its partner 2 to 6 m away.

    Nothing is within `clear` [m] of the own tracks.
    """
    rng = np.random.default_rng(seed)
    machine, partner = models[seed % len(models)], models[rng.integers(len(models))]
    bearing, gap = rng.uniform(-np.pi, np.pi), rng.uniform(2.0, 6.0)
    away = gap + 0.5 * (machine.tracks.length + partner.tracks.length)
    own = base(rng, np.zeros(3))
    beside = np.array([np.cos(bearing), np.sin(bearing), 0.0]) * away
    beside[2] = rng.uniform(-0.1, 0.1) * away
    other = base(rng, beside)
    standing = placed(partner, configurations(rng, partner, 1))
    partner_boxes = Boxes(standing.centers[0], standing.rotations[0], standing.halves).moved(other)
    around = site_boxes(rng, machine.max_reach, int(rng.integers(4, 13)))
    T = np.linalg.inv(own)
    layers = {"partner": partner_boxes.moved(T), "site": around.moved(T)}
    return Scene(machine, partner, gap, {k: _away(machine, v, clear) for k, v in layers.items()})


def _away(machine: Machine, boxes: Boxes, clear: float) -> Boxes:
    """The boxes more than `clear` [m] from the tracks: others would block the whole image."""
    own = placed(machine, np.zeros((1, len(machine.joints))))
    apart = np.ones(len(boxes), dtype=bool)
    for b in range(len(machine.bodies)):
        if machine.part_of_body(b) == "tracks":
            one = own.centers[:, b], own.rotations[:, b], own.halves[b : b + 1]
            a = (np.repeat(v, len(boxes), axis=0) for v in one)
            gaps = box_gaps(*a, boxes.centers, boxes.rotations, boxes.half_extents)
            apart &= gaps > clear
    return boxes.take(apart)


def free_configurations(scene: Scene, count: int, seed: int, eta: float = 0.0) -> np.ndarray:
    """(count or fewer, joints) that touch nothing, grown by `eta` against obstacles [m]."""
    machine = scene.machine
    grown = replace(machine, bodies=machine.bodies.inflated(eta), self_pairs=())
    q = configurations(np.random.default_rng(seed), machine, 100 * count)
    q = q[~touching(machine, q, scene.obstacles).any(axis=1)]
    return q[~touching(grown, q, scene.obstacles).any(axis=1)][:count]


def campaign_models(shared_data: Path) -> list[Machine]:
    """The shipped machines, one of them with a bent boom, and a real one."""
    return [load_machine(m) for m in ("mini", "ex13", str(shared_data / "zx200" / "zx200.xacro"))]
