"""What of joint space the resting machine would tip over in, as it stands now."""

from __future__ import annotations

import numpy as np

from backend.cspace.cells import COLLIDING, FREE, TIP_OVER
from backend.cspace.exact import JointGrid
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.spatial.types import AnyArray, Array, BoolArray
from backend.stability.resting import CENTRE, MAYBE, WHOLE, Resting, cells, resting


def resting_now(snapshot: Snapshot, config: Config, own: str) -> tuple[Resting | None, str | None]:
    """How `own` stands and "", or None and why not; (None, None) where nobody asks."""
    rules, found = config.stability, snapshot.stability.get(own)
    if rules is None or found is None:
        return None, None
    body = snapshot.machines[own].body
    if found.reason or body is None:
        return None, found.reason or "the pose is unknown"
    machine = config.machines[own]
    return resting(machine, found.payload, rules.keep, body.link_poses[0]), ""


def mark_tipping(
    coded: AnyArray, rest: Resting | None, grid: JointGrid, q: Array, slack: Array
) -> None:
    """In coded cells (swing, boom, stick, bucket): what may tip is not certified free, what must is
    blocked. q: (n,) present joint values; slack: (4,) what they may be wrong by [rad].
    """
    if rest is None:
        return
    found = cells(rest, grid.lower, grid.upper, grid.shape, q, slack)
    coded[(found & MAYBE) > 0] &= np.uint8(255 - FREE)
    coded[(found & CENTRE) > 0] |= np.uint8(TIP_OVER)
    coded[(found & WHOLE) > 0] |= np.uint8(COLLIDING)


def may_tip(rest: Resting, grid: JointGrid, q: Array, slack: Array) -> BoolArray:
    """(swing, boom, stick, bucket) whether a cell is not certified to stand."""
    found = cells(rest, grid.lower, grid.upper, grid.shape, q, slack[:4])
    return np.asarray((found & MAYBE) > 0)
