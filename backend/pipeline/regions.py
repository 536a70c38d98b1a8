"""How much of its joint space a machine can reach from here, and what is cut off."""

from __future__ import annotations

from dataclasses import dataclass

from backend.cspace.joint_image import certified4
from backend.cspace.regions import cell_of, regions
from backend.fusion.inflation import joint_slack
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import growth, surroundings_of
from backend.spatial.angles import wrap

SHAPE = (48, 24, 24, 24)
"""Cells of swing, boom, stick and bucket."""


@dataclass(frozen=True)
class RegionsImage:
    """Connected regions of the certified-free cells over swing, boom, stick and bucket.

    Shares of all cells. free: certified free; present: whether the present configuration's cell is;
    share: of the region that contains it; cut_off: regions that cannot be reached from it, and
    cut_off_share their cells.
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
    around, eta = (
        surroundings_of(own, snapshot.machines, config),
        growth(own, snapshot.machines, config),
    )
    image = certified4(machine, around.layers, eta, shape, pose.joints, slack=joint_slack(pose))
    grid, q = image.grid, pose.joints[:4].copy()
    continuous = machine.joints[0].continuous
    if continuous:
        q[0] = wrap(q[0])  # the grid begins at -pi
    here = cell_of(grid.lower, grid.steps, shape, q)
    found = regions(image.certified_free(), here, continuous)
    return RegionsImage(
        own=own,
        state_time=snapshot.state_time,
        shape=shape,
        eta=eta,
        free=found.free,
        present=found.present > 0,
        share=found.share,
        cut_off=len(found.cut_off),
        cut_off_share=found.free - found.share,
    )
