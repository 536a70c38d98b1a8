"""In which postures a machine at rest would tip over, for images of joint space.

Certified: the moment of the weight about an edge is linear in the bodies' centres, and turning a
joint moves a centre no farther than its distance from the joint, so that a cell's least moment is
that of its centre less a bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.machine.model import Machine
from backend.spatial.identity import ByIdentity
from backend.spatial.types import AnyArray, Array, BoolArray
from backend.stability.dynamics import down
from backend.stability.masses import MassModel
from backend.stability.polygon import Polygon, shrunk
from backend.stability.rest_kernel import CENTRE, MAYBE, WHOLE, tipping_cells, tipping_postures
from backend.stability.state import models

__all__ = ["CENTRE", "MAYBE", "WHOLE", "Resting", "cells", "resting", "tips"]


@dataclass(frozen=True)
class Resting:
    """model: what the machine and its payload weigh; support: less the share that is to be kept;
    g: (3,) [m/s^2], root frame; slope: (4,) the most that a moment changes when swing, boom, stick
    or bucket turn [N m/rad].
    """

    model: MassModel
    support: Polygon
    g: Array
    slope: Array

    @property
    def arguments(self) -> tuple[object, ...]:
        """Of both kernels."""
        model, support = self.model, self.support
        return (
            model.tree,
            model.frames,
            (model.masses, model.coms),
            (support.normals.copy(), (support.vertices * support.normals).sum(axis=1)),
            np.array(self.g),
        )


def resting(
    machine: Machine, payload: float, keep: float, T_site_root: Array | None = None
) -> Resting:
    """payload [kg]; keep: share of the support polygon that is to be kept, 0..1; T_site_root:
    (4, 4), level when None. Raises InputError where the masses are not known.
    """
    model, kept, slope = _models(ByIdentity(machine), payload, keep)
    return Resting(model, kept, down(T_site_root), slope)


def tips(rest: Resting, q: Array) -> BoolArray:
    """(m,) of postures q (m, n) [rad]."""
    moments = tipping_postures(*rest.arguments, np.array(q, dtype=float))
    return np.asarray(moments < 0.0)


def cells(
    rest: Resting, lower: Array, upper: Array, shape: tuple[int, ...], q: Array, slack: Array
) -> AnyArray:
    """uint8 (swing, boom, stick, bucket): CENTRE, MAYBE and WHOLE of each cell.

    lower, upper: (4,) of the whole grid [rad], the same where a joint is held; q: (n,) present
    joint values, of which those behind the bucket are held; slack: (4,) by how much the joints may
    be off [rad], for MAYBE.
    """
    counts = np.array(shape, dtype=np.int64)
    steps = (np.array(upper, dtype=float) - lower) / counts
    grid = np.array(lower, dtype=float), steps, counts
    turning = rest.slope, np.array(slack, dtype=float)
    found: AnyArray = tipping_cells(*rest.arguments, np.array(q, dtype=float), grid, turning)
    return found


@lru_cache(maxsize=32)
def _models(
    machine: ByIdentity[Machine], payload: float, keep: float
) -> tuple[MassModel, Polygon, Array]:
    model, support = models(machine, payload)
    pull = float(np.linalg.norm(down(None)))
    return model, shrunk(support, keep), pull * _levers(model)


def _levers(model: MassModel) -> Array:
    """(4,) of the first four joints: sum of masses times how far from the joint they can be [kg m].

    Along the links, straightened: nothing that turns can be farther.
    """
    levers = np.zeros(4)
    for b, mass in enumerate(model.masses):
        away, at = float(np.linalg.norm(model.coms[b])), b
        while model.parents[at] >= 0:
            if model.joints[at] < 4:
                levers[model.joints[at]] += mass * away
            away += float(np.linalg.norm(model.T_parent_joint[at, :3, 3]))
            at = int(model.parents[at])
    return levers
