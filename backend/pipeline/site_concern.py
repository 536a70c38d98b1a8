"""What stands on the site, as a safety concern: how near it is, and what braking is judged by."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from backend.collision.box_distance import away
from backend.collision.cover import cover
from backend.collision.scene import Scene, scene
from backend.collision.server import Closest, closest
from backend.fusion.inflation import spread
from backend.fusion.pose import Validity
from backend.machine import kinematics
from backend.machine.model import Machine
from backend.pipeline.braking import LONGEST_DELAY, age_of, motion_of
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState
from backend.safety import site
from backend.safety.approach import Approach, approach_standing, standing_reach
from backend.safety.hulls import hulls
from backend.safety.record import Concern
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import Boxes
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array

NEAR = 1.0
"""Bodies of the site nearer than this to a machine's hulls are judged one by one [m]."""


def site_concern(
    own: str,
    state: MachineState,
    now: float,
    config: Config,
    driven: bool,
    around: SiteBodies,
) -> Concern:
    """The verdict on one own machine. around: the bodies that hold for it, at least one."""
    machine = config.machines[own]
    joints = len(machine.joints)
    if state.pose.validity is not Validity.VALID or state.body is None:
        reason = state.pose.reasons[0] if state.pose.reasons else "is unknown"
        return site.unknown(own, joints, f"{config.labels[own]} {reason}", now)
    bodies = standing(around)
    # The pose may be wrong by what its inflation holds beyond the configured factor.
    doubt = state.eta - config.eta
    found = closest(bodies, state.body.boxes, config.limits.slow_below + doubt)
    names = tuple(f"{own}:{name}" for name in machine.body_names), bodies.names
    rows = rows_to(machine, state, bodies, found, doubt)
    braking = _approach(machine, state, bodies, now, config) if driven else None
    return site.judge(own, joints, rows, names, config.limits, now, braking)


def standing(bodies: SiteBodies) -> Scene:
    """The site's bodies, prepared once."""
    return _standing(ByIdentity(bodies))


@lru_cache(maxsize=16)
def _standing(bodies: ByIdentity[SiteBodies]) -> Scene:
    return scene(bodies.value.boxes, bodies.value.full_names)


def rows_to(
    machine: Machine,
    state: MachineState,
    bodies: Scene,
    found: Closest,
    doubt: float,
    velocity: Array | None = None,
) -> site.Rows:
    """What `found` says, as rows to judge. doubt: what the poses may be wrong by [m]; velocity:
    (k, 3) of the scene's bodies [m/s], None where they stand.
    """
    assert state.body is not None
    n = len(machine.joints)
    if not len(found):
        none, nothing = np.zeros(0, np.int64), np.zeros(0)
        return site.Rows(
            none, none, nothing, nothing, found.points, np.zeros((0, n)), nothing, nothing
        )
    direction = _away(state.body.boxes, bodies, found)
    J = kinematics.body_point_jacobians(
        machine, state.body.link_poses, found.link, found.points[:, 0]
    )
    ahead = np.array([np.cos(state.pose.yaw), np.sin(state.pose.yaw), 0.0])
    moving = J @ state.pose.joint_velocities + state.pose.base_velocity
    if velocity is not None:
        moving = moving - velocity[found.body]
    signed = found.distance - found.depth
    return site.Rows(
        own=found.link,
        other=found.body,
        distance=signed,
        margin=signed - doubt,
        points=found.points,
        gradient=np.einsum("kx,kxn->kn", direction, J),
        travel=direction @ ahead,
        closing=-np.einsum("kx,kx->k", direction, moving),
    )


def _away(links: Boxes, bodies: Scene, found: Closest) -> Array:
    """Unit vectors (r, 3) from the site to the machine; out by the shortest way on overlap."""
    delta = found.points[:, 0] - found.points[:, 1]
    length = np.linalg.norm(delta, axis=1)
    unit = delta / np.maximum(length, 1e-300)[:, None]
    held = bodies.sets[0]
    boxes = (
        Boxes(held.centers, held.rotations, held.half_extents) if (length < 1e-9).any() else None
    )
    for k in np.flatnonzero(length < 1e-9):
        assert boxes is not None
        unit[k] = away(links, boxes, int(found.link[k]), int(found.body[k]))
    return np.asarray(unit)


def _approach(
    machine: Machine, state: MachineState, bodies: Scene, now: float, config: Config
) -> Approach | None:
    """None when nothing can be reached before everything stands."""
    assert state.body is not None
    keep = config.limits.stop_below + spread(machine, state.pose)
    reach = standing_reach(machine, keep, LONGEST_DELAY)
    boxes, names = cover(bodies, hulls(machine).around(state.body.link_poses), reach, NEAR)
    if not len(boxes):
        return None
    return approach_standing(
        machine, motion_of(state), boxes, names, keep, age_of(state, now), LONGEST_DELAY
    )
