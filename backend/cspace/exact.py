"""Exact and certified joint images: which configurations of an excavator touch what.

Bodies are the machine's own boxes on tracks, upper body and arm. Obstacles are oriented boxes in
the root frame, so that a sloping base costs nothing. Images are bits, packed along the bucket.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from backend.cspace.arm_model import ArmModel, arm_model
from backend.cspace.exact_images import image_kernel, self_kernel
from backend.cspace.exact_levels import EXACT, INNER, OUTER
from backend.cspace.planar_arm import Profiles
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array, BoolArray, frozen

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


def blocked(
    model: ArmModel,
    grid: JointGrid,
    obstacles: Boxes,
    kind: int = EXACT,
    standing: bool = False,
    out: AnyArray | None = None,
) -> AnyArray:
    """Which cells touch obstacles (in the root frame): uint64 (swing, boom, stick, words).

    kind: EXACT at the cells' centres; OUTER everything that is not certified free; INNER what is
    certified to be blocked. The whole machine counts: where the tracks touch, all is blocked,
    unless they are `standing` on the obstacles. out: an earlier image, to be written over.
    """
    fresh = out is None
    if out is None:
        out = np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    if not len(obstacles):
        out[...] = 0
        return out
    # Copies can be written to: what cannot is another type to the compiler.
    boxes = (obstacles.centers.copy(), obstacles.rotations.copy(), obstacles.half_extents.copy())
    axes = _axes(model, grid, kind, None)
    rows = out.reshape(grid.shape[0], -1, grid.words)

    next_swing = np.zeros(1, dtype=np.int64)

    def fill(first: int, every: int) -> None:
        image_kernel(
            model.chain, _profiles(model, kind), model.tracks, model.upper, boxes, axes, kind,
            standing, fresh, next_swing, rows,
        )  # fmt: skip

    _shared(fill, grid.shape[0])
    return out


def self_blocked(
    model: ArmModel, grid: JointGrid, kind: int = EXACT, slack: Array | None = None
) -> AnyArray:
    """Which cells touch the machine itself: uint64 (swing, boom, stick, words); as `blocked`.

    The body farther out is grown by the model's inflation, the other is as built. slack: (4,) how
    far each joint may be from its value, which widens the cells of OUTER [rad].
    """
    out = np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    if not len(model.itself.held):
        return out
    axes = _axes(model, grid, kind, slack)
    rows = out.reshape(grid.shape[0], -1, grid.words)

    def fill(first: int, every: int) -> None:
        self_kernel(
            model.chain, _profiles(model, kind), model.itself, axes, kind, first, every, rows
        )

    _shared(fill, grid.shape[0])
    return out


def _profiles(model: ArmModel, kind: int) -> Profiles:
    return model.arm.inner if kind == INNER else model.arm.outer


def _axes(model: ArmModel, grid: JointGrid, kind: int, slack: Array | None) -> Array:
    """(4, 4) cells of all joints as angles in the arm's plane; see exact_levels."""
    steps = grid.steps
    axes = np.empty((4, 4))
    axes[:, 0] = model.signs * (grid.lower + 0.5 * steps)
    # Any angle where there is only one cell without width.
    axes[:, 1] = model.signs * np.where(steps > 0.0, steps, 1e-3)
    axes[:, 2] = grid.shape
    axes[:, 3] = 0.0 if kind == EXACT else 0.5 * steps
    if kind == OUTER and slack is not None:
        axes[:, 3] += slack
    return axes


def _shared(fill: Callable[[int, int], None], swings: int) -> None:
    """Run fill(first, every) on all processors."""
    every = min(_PROCESSORS, swings)
    others = [_pool().submit(fill, first, every) for first in range(1, every)]
    fill(0, every)
    for other in others:
        other.result()


_PROCESSORS = os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_PROCESSORS, thread_name_prefix="cspace")


def unpacked(bits: AnyArray, cells: int) -> BoolArray:
    """(..., cells) booleans of bits (..., words)."""
    octets = np.ascontiguousarray(bits).view(np.uint8)
    flat = np.unpackbits(octets, axis=-1, bitorder="little", count=cells)
    return np.asarray(flat.view(bool))
