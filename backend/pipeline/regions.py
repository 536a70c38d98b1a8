"""How much of its joint space a machine can reach from here, and what is cut off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.cspace.exact import OUTER, JointGrid, arm_model, blocked, joint_grid, unpacked
from backend.cspace.regions import cell_of, regions
from backend.fusion.inflation import joint_slack
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import MachineMargins, Snapshot
from backend.pipeline.static_layers import self_not_free, site_not_free
from backend.pipeline.stood_on import but_ground
from backend.pipeline.surroundings import PARTNER, growth, surroundings_of
from backend.pipeline.tipping import may_tip, resting_now
from backend.pipeline.working_gauge import site_of
from backend.spatial.angles import wrap
from backend.spatial.types import AnyArray, Array

SHAPE = (48, 24, 24, 24)
"""Cells of swing, boom, stick and bucket."""


@dataclass(frozen=True)
class RegionsImage:
    """Connected regions of the certified-free cells over swing, boom, stick and bucket.

    Shares of all cells. free: certified free; present: whether the present configuration is in one
    of the regions, or comes into one by moving one joint within its margin; share: of what can be
    reached so; cut_off: regions that cannot, and cut_off_share their cells.
    """

    own: str
    state_time: float
    shape: tuple[int, int, int, int]
    eta: float
    free: float
    present: bool
    share: float
    cut_off: int
    cut_off_share: float

    @property
    def key(self) -> str:
        return self.own


def regions_image(
    snapshot: Snapshot, config: Config, own: str, shape: tuple[int, int, int, int] = SHAPE
) -> RegionsImage:
    """Raises ValueError when `own` is not placed."""
    machine, pose = config.machines[own], snapshot.machines[own].pose
    eta, slack = growth(own, snapshot.machines, config), joint_slack(pose)
    partners = surroundings_of(own, snapshot.machines, config).layers[PARTNER]
    grid = joint_grid(machine, shape)
    taken = blocked(arm_model(machine, pose.joints, eta), grid, partners, OUTER)
    around = but_ground(site_of(own, snapshot.gauge, config), snapshot.machines[own])
    taken |= site_not_free(machine, pose, around, eta, shape)
    taken |= self_not_free(machine, pose.joints, slack, shape)
    free = ~unpacked(taken, shape[3])
    rest, _ = resting_now(snapshot, config, own)
    if rest is not None:
        free &= ~may_tip(rest, grid, pose.joints, slack)
    found = regions(free, (0, 0, 0, 0), machine.joints[0].continuous)
    reached = _reached(found.labels, grid, machine, pose.joints, snapshot.margins[own])
    shares = found.sizes / found.labels.size
    share = float(shares[[label - 1 for label in reached]].sum())
    return RegionsImage(
        own=own,
        state_time=snapshot.state_time,
        shape=shape,
        eta=eta,
        free=found.free,
        present=bool(reached),
        share=share,
        cut_off=len(found.sizes) - len(reached),
        cut_off_share=found.free - share,
    )


def _reached(
    labels: AnyArray, grid: JointGrid, machine: Machine, q: Array, margins: MachineMargins
) -> list[int]:
    """Labels of the regions that the present configuration is in, or comes into by moving one joint
    within its margin: its own cell may be too near to something to be certified as a whole.
    """
    steps, continuous = grid.steps, machine.joints[0].continuous
    found = set()
    for joint, both in enumerate(margins.joints[:4]):
        for sign, freedom in zip((-1.0, 1.0), both, strict=True):
            count = max(int(freedom.free / steps[joint] * 2.0), 1)
            for distance in np.linspace(0.0, freedom.free, count + 1)[:-1]:
                there = q[:4].copy()
                there[joint] += sign * distance
                if continuous:
                    there[0] = wrap(there[0])  # the grid begins at -pi
                found.add(int(labels[cell_of(grid.lower, steps, grid.shape, there)]))
    return sorted(found - {0})
