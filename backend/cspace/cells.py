"""Cells as views draw them: one byte each, a bit for every layer and for both certificates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.cspace.exact import (
    INNER,
    OUTER,
    ArmModel,
    JointGrid,
    arm_model,
    blocked,
    self_blocked,
    unpacked,
)
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.identity import ByIdentity
from backend.spatial.types import AnyArray, Array

PARTNER, SITE, SELF, PEOPLE, TIP_OVER = 1, 2, 4, 8, 16
"""Bits of a cell: its centre touches that layer, bodies as built; or the resting machine tips."""

FREE, COLLIDING = 64, 128
"""Bits of a cell: certified for every configuration in it. With neither, the cell is undecided."""

ETA_STEP = 0.005
"""Models are made for multiples of this growth [m]."""

LAYER_BITS = {
    "partner": PARTNER,
    "site": SITE,
    "self": SELF,
    "people": PEOPLE,
    "tip-over": TIP_OVER,
}


@dataclass(frozen=True)
class CellModels:
    """A machine prepared once for many images. built: bodies as they are; grown: by `eta` [m], for
    what the obstacles' and the own places may be wrong by; slack: (4,) what the own joints may be
    wrong by, which is all that matters between the machine's own bodies [rad].
    """

    machine: Machine
    eta: float
    slack: Array
    built: ArmModel
    grown: ArmModel


def cell_models(machine: Machine, q: Array, eta: float, slack: Array) -> CellModels:
    """q: (n,) [rad], of which tilt and rotate are held; eta, slack: see CellModels.

    eta is taken up to the next ETA_STEP, so that models can be kept from cycle to cycle.
    """
    steps = math.ceil(eta / ETA_STEP - 1e-9)
    rest = tuple(np.asarray(q, dtype=float)[4:].tolist())
    built, grown = (_model(ByIdentity(machine), rest, k) for k in (0, steps))
    return CellModels(machine, grown.inflation, np.asarray(slack, dtype=float)[:4], built, grown)


@lru_cache(maxsize=256)
def _model(machine: ByIdentity[Machine], rest: tuple[float, ...], steps: int) -> ArmModel:
    q = np.zeros(len(machine.value.joints))
    q[4:] = rest
    return arm_model(machine.value, q, ETA_STEP * steps)


def coded(
    models: CellModels, grid: JointGrid, layers: Mapping[str, Boxes], together: Boxes | None = None
) -> AnyArray:
    """uint8 (swing, boom, stick, bucket) of a grid. layers: "partner", "site", "people", in the
    root frame; together: all of their boxes, when they are at hand.
    """
    cells = np.zeros(grid.shape, dtype=np.uint8)
    for name, boxes in layers.items():
        if len(boxes):
            _mark(cells, blocked(models.built, grid, boxes), LAYER_BITS[name])
    _mark(cells, self_blocked(models.built, grid), SELF)
    everything = concatenated(layers.values()) if together is None else together
    inner = blocked(models.built, grid, everything, INNER) | self_blocked(models.built, grid, INNER)
    outer = blocked(models.grown, grid, everything, OUTER)
    outer |= self_blocked(models.built, grid, OUTER, models.slack)
    _mark(cells, inner, COLLIDING)
    _mark(cells, ~outer, FREE)
    return cells


def _mark(cells: AnyArray, bits: AnyArray, flag: int) -> None:
    cells |= unpacked(bits, cells.shape[3]).view(np.uint8) * np.uint8(flag)
