"""The joint images as they are drawn and written: layers of blocked cells, and certificates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np

from backend.cspace.exact import (
    EXACT,
    INNER,
    OUTER,
    ArmModel,
    JointGrid,
    arm_model,
    blocked,
    joint_grid,
    self_blocked,
    unpacked,
)
from backend.cspace.ground import GROUND
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array, BoolArray

SELF = "self"
"""The layer of self-collision; the other layers are named by the caller ("partner", "site").

The layer "ground" is what the machine stands on: it does not count for the tracks."""

SHAPE = (72, 64, 64, 64)


@dataclass(frozen=True)
class JointImage:
    """Cells whose centre touches something, bodies as built. layers: name -> bits, uint64
    (swing, boom, stick, words), least significant bit first along the bucket.
    """

    grid: JointGrid
    layers: dict[str, AnyArray]

    def layer(self, name: str) -> BoolArray:
        """(swing, boom, stick, bucket) booleans of one layer."""
        return unpacked(self.layers[name], self.grid.shape[3])

    @property
    def bits(self) -> AnyArray:
        """All layers together."""
        return _union(self.grid, self.layers.values())

    def colliding(self) -> BoolArray:
        """(swing, boom, stick, bucket) whether the cell's centre touches anything."""
        return unpacked(self.bits, self.grid.shape[3])


@dataclass(frozen=True)
class CertifiedImage:
    """What holds for every configuration of a cell.

    open: layer -> bits of cells that are not certified free, bodies grown by `eta` [m]; blocked:
    layer -> bits of cells certified colliding, bodies as built. What is in `open` and not in
    `blocked` is undecided.
    """

    grid: JointGrid
    eta: float
    open: dict[str, AnyArray]
    blocked: dict[str, AnyArray]

    def certified_free(self) -> BoolArray:
        """(swing, boom, stick, bucket)."""
        return ~unpacked(_union(self.grid, self.open.values()), self.grid.shape[3])

    def certified_colliding(self) -> BoolArray:
        """(swing, boom, stick, bucket)."""
        return unpacked(_union(self.grid, self.blocked.values()), self.grid.shape[3])

    @property
    def undecided(self) -> float:
        """Share of the cells, 0..1."""
        neither = ~(self.certified_free() | self.certified_colliding())
        return float(neither.mean())


def joint4(
    machine: Machine,
    layers: Mapping[str, Boxes],
    shape: tuple[int, int, int, int] = SHAPE,
    rest: Array | None = None,
    own: AnyArray | None = None,
) -> JointImage:
    """The image over swing, boom, stick and bucket.

    layers: obstacles in the machine's root frame, by layer; rest: (n,) joint values, of which tilt
    and rotate are held; own: the layer "self" of an earlier image of the same shape, which does not
    depend on where the machine stands. Raises ValueError when the arm does not move in a plane.
    """
    return _exact(arm_model(machine, rest), joint_grid(machine, shape), layers, own)


def joint3(
    machine: Machine,
    layers: Mapping[str, Boxes],
    q: Array,
    shape: tuple[int, int, int] = (64, 64, 64),
) -> JointImage:
    """The image over boom, stick and bucket at the swing of q (n,) [rad]; as `joint4`."""
    return _exact(arm_model(machine, q), at_swing(machine, q, shape), layers, None)


def certified4(
    machine: Machine,
    layers: Mapping[str, Boxes],
    eta: float,
    shape: tuple[int, int, int, int] = SHAPE,
    rest: Array | None = None,
    own: tuple[AnyArray, AnyArray] | None = None,
    slack: Array | None = None,
) -> CertifiedImage:
    """The certified image over swing, boom, stick and bucket.

    eta: how much the machine's bodies are grown for "free", for its own and the obstacles'
    uncertainty together [m]; slack: (n,) what each joint may be wrong by, which is all that matters
    between the machine's own bodies; without it they are grown by eta [rad]; own: `open` and
    `blocked` of the layer "self" of an earlier image of the same shape, eta and slack. Otherwise as
    `joint4`.
    """
    return _certified(machine, joint_grid(machine, shape), layers, eta, rest, own, slack)


def certified3(
    machine: Machine,
    layers: Mapping[str, Boxes],
    eta: float,
    q: Array,
    shape: tuple[int, int, int] = (64, 64, 64),
    slack: Array | None = None,
) -> CertifiedImage:
    """The certified image at the swing of q (n,) [rad], which is taken to be exact."""
    return _certified(machine, at_swing(machine, q, shape), layers, eta, q, None, slack)


def at_swing(machine: Machine, q: Array, shape: tuple[int, int, int]) -> JointGrid:
    """The grid of boom, stick and bucket at the swing of q (n,) [rad]."""
    return joint_grid(machine, (1, *shape), float(np.asarray(q)[0]))


def _exact(
    model: ArmModel, grid: JointGrid, layers: Mapping[str, Boxes], own: AnyArray | None
) -> JointImage:
    _check(layers)
    images = {
        name: blocked(model, grid, boxes, EXACT, name == GROUND) for name, boxes in layers.items()
    }
    images[SELF] = self_blocked(model, grid, EXACT) if own is None else own
    return JointImage(grid, images)


def _certified(
    machine: Machine,
    grid: JointGrid,
    layers: Mapping[str, Boxes],
    eta: float,
    rest: Array | None,
    own: tuple[AnyArray, AnyArray] | None,
    slack: Array | None,
) -> CertifiedImage:
    _check(layers)
    as_built = arm_model(machine, rest)
    grown = arm_model(machine, rest, eta)
    outer = {
        name: blocked(grown, grid, boxes, OUTER, name == GROUND) for name, boxes in layers.items()
    }
    inner = {
        name: blocked(as_built, grid, boxes, INNER, name == GROUND)
        for name, boxes in layers.items()
    }
    if own is None:
        own = (
            self_blocked(grown, grid, OUTER)
            if slack is None
            else self_blocked(as_built, grid, OUTER, np.asarray(slack, dtype=float)[:4]),
            self_blocked(as_built, grid, INNER),
        )
    outer[SELF], inner[SELF] = own
    return CertifiedImage(grid, eta, outer, inner)


def _check(layers: Mapping[str, Boxes]) -> None:
    if SELF in layers:
        raise ValueError(f"a layer of obstacles must not be named '{SELF}'")


def _union(grid: JointGrid, layers: object) -> AnyArray:
    empty = np.zeros((*grid.shape[:3], grid.words), dtype=np.uint64)
    return reduce(np.bitwise_or, layers, empty)  # type: ignore[call-overload, no-any-return]
