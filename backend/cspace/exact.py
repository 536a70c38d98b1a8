"""Exact and certified joint images: which configurations of an excavator touch what.

Bodies are the machine's own boxes on tracks, upper body and arm. Obstacles are oriented boxes in
the root frame, so that a sloping base costs nothing. Images are bits, packed along the bucket.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from backend.cspace.exact_kernel import Chain, image_kernel
from backend.cspace.exact_levels import EXACT, INNER, OUTER, Axis, levels
from backend.cspace.exact_upper import touching_swings
from backend.cspace.planar_arm import PlanarArm, Profiles, planar_arm
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import PARTS, Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array, BoolArray, IntArray, frozen

__all__ = ["EXACT", "INNER", "OUTER", "ArmModel", "JointGrid", "arm_model", "blocked", "joint_grid"]


@dataclass(frozen=True)
class JointGrid:
    """Cells of swing, boom, stick and bucket. lower, upper: (4,) edges of the whole [rad], the same
    where a joint is held at one value; shape: cells of each joint.
    """

    lower: Array
    upper: Array
    shape: tuple[int, int, int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", frozen(self.lower, (4,), "lower"))
        object.__setattr__(self, "upper", frozen(self.upper, (4,), "upper"))
        span = self.upper - self.lower
        if (span < 0.0).any() or (span > 2.0 * np.pi + 1e-9).any():
            raise ValueError("a joint's cells must cover between none and one whole turn")
        if len(self.shape) != 4 or min(self.shape) < 1:
            raise ValueError(f"shape must be four numbers of at least 1, not {self.shape}")

    @cached_property
    def steps(self) -> Array:
        """(4,) width of a cell [rad]."""
        return np.asarray((self.upper - self.lower) / np.array(self.shape))

    def centers(self, joint: int) -> Array:
        """(n,) [rad]."""
        n = self.shape[joint]
        return np.asarray(self.lower[joint] + (np.arange(n) + 0.5) * self.steps[joint])

    def edges(self, joint: int) -> Array:
        """(n+1,) [rad]."""
        return np.linspace(self.lower[joint], self.upper[joint], self.shape[joint] + 1)

    @property
    def words(self) -> int:
        """Words of 64 cells in a row of the bucket."""
        return (self.shape[3] + 63) // 64


def joint_grid(
    machine: Machine, shape: tuple[int, int, int, int], swing: float | None = None
) -> JointGrid:
    """The joints' whole ranges, a full turn from -pi where there is no limit.

    swing: hold the swing at this value (its shape must then be 1) [rad].
    """
    lower, upper = machine.lower[:4].copy(), machine.upper[:4].copy()
    lower[~np.isfinite(lower)], upper[~np.isfinite(upper)] = -np.pi, np.pi
    if swing is not None:
        lower[0] = upper[0] = swing
    return JointGrid(lower, upper, shape)


@dataclass(frozen=True)
class SelfPart:
    """Bodies of the machine that the first `held` joints carry, as obstacles to what is farther
    out: where they stand at joint values 0, in the root frame, as built. pairs: (arm's bodies,
    obstacles) that count.
    """

    held: int
    obstacles: Boxes
    pairs: BoolArray


@dataclass(frozen=True)
class ArmModel:
    """A machine prepared for the kernels, its bodies grown by `inflation` [m] on every side.

    tracks, upper: bodies at joint values 0 (tilt and rotate as they are held) in the root frame,
    grown; itself: what of the machine can touch itself.
    """

    machine: Machine
    inflation: float
    arm: PlanarArm
    chain: Chain
    tracks: Boxes
    upper: Boxes
    itself: tuple[SelfPart, ...]


def arm_model(machine: Machine, rest: Array | None = None, inflation: float = 0.0) -> ArmModel:
    """Prepare `machine`. rest: (n,) joint values, of which tilt and rotate are held.

    Raises ValueError when the arm does not move in a plane, or inflation is not 0 or more.
    """
    if not (np.isfinite(inflation) and inflation >= 0.0):
        raise ValueError(f"inflation must be 0 or more metres, not {inflation}")
    q = np.zeros(len(machine.joints))
    if rest is not None:
        q[4:] = np.asarray(rest, dtype=float)[4:]
    arm = planar_arm(machine, rest, inflation)
    as_built = body_boxes(machine, link_poses(machine, q))
    part = np.array([PARTS.index(machine.part_of_body(b)) for b in range(len(machine.bodies))])
    pairs = np.zeros((len(part), len(part)), dtype=bool)
    for a, b in machine.self_pairs:
        pairs[a, b] = pairs[b, a] = True
    links = np.array([0.0, np.hypot(*arm.boom), np.hypot(*arm.boom) + np.hypot(*arm.stick)])
    far = [arm.outer.reach[arm.groups == k].max(initial=0.0) for k in range(3)]
    chain = Chain(
        arm.pivots,
        links + far,
        arm.boxes.centers.copy(),
        arm.boxes.rotations.copy(),
        arm.boxes.half_extents.copy(),
        ~arm.aligned,
    )
    return ArmModel(
        machine=machine,
        inflation=inflation,
        arm=arm,
        chain=chain,
        tracks=as_built.take(part == 0).inflated(inflation),
        upper=as_built.take(part == 1).inflated(inflation),
        itself=tuple(_self_parts(arm, as_built, part, pairs)),
    )


def _self_parts(
    arm: PlanarArm, as_built: Boxes, part: IntArray, self_pairs: BoolArray
) -> Iterator[SelfPart]:
    """part: (bodies,) number along the chain; self_pairs: (bodies, bodies)."""
    for held in range(5):
        others = np.flatnonzero(part == held if held < 4 else part >= 4)
        pairs = self_pairs[np.ix_(arm.bodies, others)]
        # Each pair once, seen from the body that is farther out.
        pairs = pairs & (arm.bodies[:, None] > others[None, :])
        used = pairs.any(axis=0)
        if used.any():
            yield SelfPart(held, as_built.take(others[used]), np.ascontiguousarray(pairs[:, used]))


def blocked(
    model: ArmModel,
    grid: JointGrid,
    obstacles: Boxes,
    kind: int = EXACT,
    standing: bool = False,
) -> AnyArray:
    """Which cells touch obstacles (in the root frame): uint64 (swing, boom, stick, words).

    kind: EXACT at the cells' centres; OUTER everything that is not certified free; INNER what is
    certified to be blocked. The whole machine counts: where the tracks touch, all is blocked,
    unless they are `standing` on the obstacles.
    """
    if not len(obstacles):
        return np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    T = transform.inverse(model.arm.T_root_arm)
    placed = obstacles.moved(T)

    def all_pairs(bodies: Boxes) -> BoolArray:
        return np.ones((len(bodies), len(obstacles)), dtype=bool)

    base = touching_swings(
        model.upper.moved(T), placed, all_pairs(model.upper),
        model.arm.swing_sign * grid.centers(0), float(grid.steps[0]) / 2.0, kind,
    )  # fmt: skip
    if not standing:
        base |= touching_swings(
            model.tracks.moved(T), placed, all_pairs(model.tracks), np.zeros(1), kind=kind
        )
    pairs = np.ones((len(model.arm.bodies), len(obstacles)), dtype=bool)
    return _image(model, grid, obstacles, pairs, base, kind)


def self_blocked(
    model: ArmModel, grid: JointGrid, kind: int = EXACT, slack: Array | None = None
) -> AnyArray:
    """Which cells touch the machine itself: uint64 (swing, boom, stick, words); as `blocked`.

    The body farther out is grown by the model's inflation, the other is as built. slack: (4,) how
    far each joint may be from its value, which widens the cells of OUTER [rad].
    """
    out = np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    none = np.zeros(grid.shape[0], dtype=bool)
    for part in model.itself:
        found = _image(model, _held(grid, part.held), part.obstacles, part.pairs, none, kind, slack)
        if part.held < 4:
            out |= found
        elif found.any():
            out[:] = _full_words(grid)
    return out


def _held(grid: JointGrid, count: int) -> JointGrid:
    """The grid with the first `count` joints held at 0: their one cell stands for all."""
    if count == 0:
        return grid
    lower, upper = grid.lower.copy(), grid.upper.copy()
    lower[:count] = upper[:count] = 0.0
    shape = (*([1] * count), *grid.shape[count:])
    return JointGrid(lower, upper, (shape[0], shape[1], shape[2], shape[3]))


def _image(
    model: ArmModel,
    grid: JointGrid,
    obstacles: Boxes,
    pairs: BoolArray,
    base: BoolArray,
    kind: int,
    slack: Array | None = None,
) -> AnyArray:
    out = np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    if not base.any() and not pairs.any():
        return out
    halves = np.zeros(4) if kind == EXACT else grid.steps / 2.0
    if kind == OUTER and slack is not None:
        halves = halves + slack
    boom, stick, bucket = levels(model.arm, _axes(model, grid, halves), kind)
    body: Profiles = model.arm.inner if kind == INNER else model.arm.outer
    arguments = (
        model.chain,
        body,
        (obstacles.centers.copy(), obstacles.rotations.copy(), obstacles.half_extents.copy()),
        np.ascontiguousarray(pairs),
        model.arm.T_arm_root(grid.centers(0))[:, :3, :].copy(),
        boom,
        stick,
        bucket,
        kind,
        float(halves[0]),
        base,
    )
    rows = out.reshape(grid.shape[0], -1, grid.words)
    # Swings side by side cost about the same: each thread takes every so many.
    every = min(os.cpu_count() or 1, grid.shape[0])

    def fill(first: int) -> None:
        image_kernel(*arguments, first, every, rows)

    others = [_pool().submit(fill, first) for first in range(1, every)]
    fill(0)
    for other in others:
        other.result()
    return out


def _axes(model: ArmModel, grid: JointGrid, halves: Array) -> tuple[Axis, Axis, Axis]:
    """Cells of boom, stick and bucket as angles in the arm's plane. halves: (4,) [rad]."""
    boom, stick, bucket = (
        Axis(
            float(sign * grid.centers(k)[0]),
            float(sign * _step(grid, k)),
            grid.shape[k],
            float(halves[k]),
        )
        for k, sign in enumerate(model.arm.signs, start=1)
    )
    return boom, stick, bucket


@lru_cache(maxsize=1)
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1, thread_name_prefix="cspace")


def _step(grid: JointGrid, joint: int) -> float:
    """The cells' width; any angle where there is only one cell without width."""
    return float(grid.steps[joint]) or 1e-3


def _full_words(grid: JointGrid) -> AnyArray:
    bits = np.zeros(64 * grid.words, dtype=bool)
    bits[: grid.shape[3]] = True
    return np.packbits(bits, bitorder="little").view(np.uint64)


def unpacked(bits: AnyArray, cells: int) -> BoolArray:
    """(..., cells) booleans of bits (..., words)."""
    octets = np.ascontiguousarray(bits).view(np.uint8)
    flat = np.unpackbits(octets, axis=-1, bitorder="little", count=cells)
    return np.asarray(flat.view(bool))
