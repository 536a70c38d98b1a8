"""All that a machine passes on an announced trajectory, as boxes that others keep away from."""

from __future__ import annotations

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.types import Array, BoolArray

STEP = 0.4
"""A body moves no farther than this between the postures whose boxes are taken [m]."""


def passed(machine: Machine, q: Array, T_site_root: Array) -> Boxes:
    """What holds every moving body in postures (m, n) and on the straight ways between them, in the
    site frame. T_site_root: (4, 4) where it stands.

    Whatever is between two postures is within half a STEP of one of them, by the levers of the
    joints: the boxes are grown by that.
    """
    if not len(q):
        return NO_BOXES
    moving = moved(machine, q)
    taken = [
        body_boxes(machine, link_poses(machine, at, T_site_root)) for at in postures(machine, q)
    ]
    return concatenated(boxes.take(moving).inflated(0.5 * STEP) for boxes in taken)


def moved(machine: Machine, q: Array) -> BoolArray:
    """(bodies,) whether any posture of (m, n) has a body elsewhere than the first."""
    far = np.abs(q - q[0]).max(axis=0)
    return np.asarray((machine.stretched_levers @ far) > 1e-6)


def postures(machine: Machine, q: Array) -> Array:
    """(k, n) along the polyline (m, n), its ends among them, with at most STEP from one to the next
    for any body.
    """
    levers = machine.stretched_levers
    found = [q[0]]
    for b in q[1:]:
        a = found[-1]
        ways = float((levers @ np.abs(b - a)).max(initial=0.0))
        count = max(int(np.ceil(ways / STEP)), 1)
        found += [a + (b - a) * (k + 1) / count for k in range(count)]
    return np.array(_thinned(np.array(found), levers))


def _thinned(q: Array, levers: Array) -> list[Array]:
    """Without postures that the ones before and after them make unnecessary."""
    kept, way = [q[0]], 0.0
    steps = (np.abs(np.diff(q, axis=0)) @ levers.T).max(axis=1, initial=0.0)
    for k, step in enumerate(steps):
        if way + step > STEP:
            kept.append(q[k])
            way = 0.0
        way += step
    return [*kept, q[-1]]
