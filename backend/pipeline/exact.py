"""The exact images of one machine among its partners and the site, for one snapshot.

Three slices through the present configuration, one bar per joint, the volume over boom, stick and
bucket at the present swing, and the reach image. Every cell says what it hits and is certified free,
certified colliding or undecided.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from backend.cspace.cells import CellModels, cell_models, coded
from backend.cspace.exact import JointGrid, joint_grid
from backend.cspace.reach_image import ReachImage, reach_image
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.place import base_transform
from backend.pipeline.records import Snapshot
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array

ARM = ("swing", "boom", "stick", "bucket")
PLANES = ((1, 2), (1, 3), (2, 3))  # boom-stick, boom-bucket, stick-bucket
PATCH_CELLS, PATCH_FINER = 6, 4


@dataclass(frozen=True)
class Resolution:
    """Cells of the images of the image loop."""

    slice: int = 64
    bar: int = 256
    volume: int = 32
    reach: tuple[int, int] = (90, 60)


@dataclass(frozen=True)
class Slice:
    """A plane through the present configuration. across, up: joints; x, y: (2,) its edges [rad];
    cells: (nx, ny) uint8, see backend.cspace.cells; patch: the same around the present
    configuration in finer cells, None where the slice is decided there.
    """

    across: str
    up: str
    x: Array
    y: Array
    cells: AnyArray
    patch: Slice | None = None


@dataclass(frozen=True)
class Bar:
    """One joint moving alone. edges: (2,) [rad]; cells: (n,) uint8."""

    joint: str
    edges: Array
    cells: AnyArray


@dataclass(frozen=True)
class OwnImage:
    """What `own` must avoid, stamped with the time of the state it shows.

    eta: growth of the bodies for "certified free" [m]; q: (n,) the present joint values [rad];
    volume: (boom, stick, bucket) uint8 at the present swing over volume_edges (3, 2) [rad];
    stopping: (n, 2) how far each joint still moves after a stop is asked for at its present rate,
    latency included, and at its full rate [rad].
    """

    own: str
    state_time: float
    eta: float
    q: Array
    slices: tuple[Slice, ...]
    bars: tuple[Bar, ...]
    volume: AnyArray
    volume_edges: Array
    reach: ReachImage
    stopping: Array

    @property
    def key(self) -> str:
        return self.own
