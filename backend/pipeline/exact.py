"""The exact images of one machine among its partners and the site, for one snapshot.

Three slices through the present configuration, one bar per joint, the volume over boom, stick and
bucket at the present swing, and the reach image. Every cell says what it hits and is certified
free, certified colliding or undecided; where the resting machine would tip over, too, is neither
free nor undecided.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from backend.cspace.cells import COLLIDING, FREE, CellModels, cell_models, coded
from backend.cspace.exact import JointGrid
from backend.cspace.joint_bars import joint_bars
from backend.cspace.reach_image import ReachImage, reach_image
from backend.cspace.regions import cell_of
from backend.fusion.inflation import joint_slack
from backend.machine.model import Machine
from backend.machine.stopping import full_stopping_distances, stopping_distances
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import growth, surroundings_of, why_unknown
from backend.pipeline.tipping import mark_tipping, resting_now
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import AnyArray, Array
from backend.stability.resting import Resting, tips

ARM = ("swing", "boom", "stick", "bucket")
PLANES = ((1, 2), (1, 3), (2, 3))  # boom-stick, boom-bucket, stick-bucket

PATCH = 6  # cells each way around the present configuration that are refined
FINER = 4  # cells of a patch across one cell of its slice


@dataclass(frozen=True)
class Cells:
    """How many cells the images have along each axis."""

    slice: int = 64
    bar: int = 180
    volume: int = 32
    reach: tuple[int, int] = (72, 48)


@dataclass(frozen=True)
class Slice:
    """A plane through the present configuration. across, up: joints; x, y: (2,) its edges [rad];
    cells: (nx, ny) uint8, see backend.cspace.cells; patch: finer cells around the present
    configuration, None where all of the cells there are decided.
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
    stopping: (n, 2) how far each joint still moves after a stop is asked for, latency included:
    at its present rate (signed), at its full rate [rad]; tip_over: empty where cells tell in which
    postures the machine, at rest, keeps less of its support polygon than it must, else why they do
    not; None where nobody asks.
    """

    own: str
    partners: tuple[str, ...]
    state_time: float
    eta: float
    q: Array
    slices: tuple[Slice, ...]
    bars: tuple[Bar, ...]
    volume: AnyArray
    volume_edges: Array
    reach: ReachImage
    tip_height: float | None
    stopping: Array
    tip_over: str | None = None

    @property
    def key(self) -> str:
        return self.own


@dataclass(frozen=True)
class _Around:
    """One machine and what it can touch, in its root frame; together: the boxes of all layers;
    rest: how it stands, None where that is not known.
    """

    models: CellModels
    layers: dict[str, Boxes]
    together: Boxes
    rest: Resting | None


def own_machines(snapshot: Snapshot, config: Config) -> list[str]:
    """Own machines whose surroundings are known now."""
    return [name for name in config.own if not why_unknown(name, snapshot.machines, snapshot.pairs)]


def own_image(
    snapshot: Snapshot,
    config: Config,
    own: str,
    cells: Cells,
    tip_height: float | None = None,
) -> OwnImage:
    """The images of `own`; see OwnImage. tip_height: of the reach image, above the swing joint [m],
    the present one when None. Raises ValueError when `own` is not placed.
    """
    machine, state = config.machines[own], snapshot.machines[own]
    q, layers = (
        state.pose.joints,
        surroundings_of(own, snapshot.machines, config, snapshot.gauge, snapshot.people).layers,
    )
    eta = growth(own, snapshot.machines, config)
    slack = joint_slack(state.pose)
    models = cell_models(machine, q, eta, slack)
    edges = joint_edges(machine, q)
    rest, why = resting_now(snapshot, config, own)
    around = _Around(models, layers, concatenated(layers.values()), rest)
    volume = _cells(around, edges, q, dict.fromkeys((1, 2, 3), cells.volume))
    bars = joint_bars(machine, q, dict(enumerate(edges)), cells.bar, layers, models.eta, slack)
    for k, bar in enumerate(bars):
        grid = _grid(edges, q, {k: cells.bar})
        mark_tipping(bar.reshape(grid.shape), rest, grid, q, models.slack)
    return OwnImage(
        own=own,
        partners=tuple(name for name in snapshot.machines if name != own),
        state_time=snapshot.state_time,
        eta=models.eta,
        q=q,
        slices=tuple(_slice(around, edges, q, plane, cells.slice) for plane in PLANES),
        bars=tuple(Bar(role, edges[k], bars[k]) for k, role in enumerate(ARM)),
        volume=volume[0],
        volume_edges=edges[1:],
        reach=reach_image(
            *(machine, q, layers, cells.reach, tip_height),
            judges=None if rest is None else {"tip-over": partial(tips, rest)},
        ),
        tip_height=tip_height,
        stopping=np.stack(
            [
                stopping_distances(machine, state.pose.joint_velocities, config.stop_latency),
                full_stopping_distances(machine, config.stop_latency),
            ],
            axis=1,
        ),
        tip_over=why,
    )


def joint_edges(machine: Machine, q: Array) -> Array:
    """(4, 2) limits of swing, boom, stick and bucket; a full turn about q where there are none."""
    lower, upper = machine.lower[:4].copy(), machine.upper[:4].copy()
    free = ~np.isfinite(lower) | ~np.isfinite(upper)
    middle = np.where(np.arange(4) == 0, 0.0, q[:4])
    lower[free], upper[free] = middle[free] - np.pi, middle[free] + np.pi
    return np.stack([lower, upper], axis=1)


def _slice(
    around: _Around,
    edges: Array,
    q: Array,
    plane: tuple[int, int],
    n: int,
) -> Slice:
    i, j = plane
    found = _plane(around, edges, q, plane, (n, n))
    steps = np.diff(edges[[i, j]], axis=1).ravel() / n
    here = np.array(cell_of(edges[[i, j], 0], steps, (n, n), q[[i, j]]))
    first, last = np.maximum(here - PATCH, 0), np.minimum(here + PATCH + 1, n)
    near = found.cells[first[0] : last[0], first[1] : last[1]]
    if (near & (FREE | COLLIDING)).all():
        return found
    part = edges.copy()
    part[[i, j], 0] = edges[[i, j], 0] + first * steps
    part[[i, j], 1] = edges[[i, j], 0] + last * steps
    size = (FINER * (last - first)).tolist()
    patch = _plane(around, part, q, plane, (size[0], size[1]))
    return Slice(found.across, found.up, found.x, found.y, found.cells, patch)


def _plane(
    around: _Around,
    edges: Array,
    q: Array,
    plane: tuple[int, int],
    shape: tuple[int, int],
) -> Slice:
    i, j = plane
    cells = _cells(around, edges, q, {i: shape[0], j: shape[1]}).reshape(shape)
    return Slice(ARM[i], ARM[j], edges[i], edges[j], cells)


def _cells(around: _Around, edges: Array, q: Array, spread: dict[int, int]) -> AnyArray:
    """Cells over the joints of `spread` (joint: cells), the others held at q."""
    grid = _grid(edges, q, spread)
    found = coded(around.models, grid, around.layers, around.together)
    mark_tipping(found, around.rest, grid, q, around.models.slack)
    return found


def _grid(edges: Array, q: Array, spread: dict[int, int]) -> JointGrid:
    lower, upper, shape = q[:4].copy(), q[:4].copy(), [1, 1, 1, 1]
    for k, n in spread.items():
        lower[k], upper[k], shape[k] = edges[k, 0], edges[k, 1], n
    return JointGrid(lower, upper, (shape[0], shape[1], shape[2], shape[3]))
