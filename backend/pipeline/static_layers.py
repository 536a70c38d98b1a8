"""What does not change while a machine stands: what its own bodies and the site keep from free.

Both are kept for a quantised base pose, with everything grown by what the rounding may move, so
that a position's noise does not make them anew. The functions depend on their arguments alone.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from backend.cspace.exact import OUTER, arm_model, blocked, self_blocked
from backend.cspace.exact import joint_grid as whole_grid
from backend.fusion.pose import FusedPose
from backend.machine.model import Machine
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.identity import ByIdentity
from backend.spatial.types import AnyArray, Array

POSITION, ANGLE, LENGTH = 0.05, 0.005, 0.02
"""Quanta of a base's coordinates [m], its yaw, pitch and roll and joint slack [rad], of eta [m]."""

Shape = tuple[int, int, int, int]


def site_not_free(
    machine: Machine, pose: FusedPose, site: SiteBodies, eta: float, shape: Shape
) -> AnyArray:
    """Bits (swing, boom, stick, words) of the cells that the site keeps from certified free."""
    place = tuple(round(float(v) / POSITION) for v in pose.position)
    turn = tuple(round(float(v) / ANGLE) for v in (pose.yaw, pose.pitch, pose.roll))
    length = math.ceil(eta / LENGTH)
    rest = tuple(pose.joints[4:].tolist())
    return _site(ByIdentity(machine), ByIdentity(site), place, turn, length, shape, rest)


def self_not_free(machine: Machine, rest: Array, slack: Array, shape: Shape) -> AnyArray:
    """The same of the machine itself. rest: (n,) joint values, of which tilt and rotate count;
    slack: (n,) what its joints may be wrong by [rad].
    """
    steps = tuple(math.ceil(float(v) / ANGLE) for v in slack[:4])
    return _itself(ByIdentity(machine), steps, shape, tuple(rest[4:].tolist()))


@lru_cache(maxsize=16)
def _site(
    machine: ByIdentity[Machine],
    site: ByIdentity[SiteBodies],
    place: tuple[int, ...],
    turn: tuple[int, ...],
    length: int,
    shape: Shape,
    rest: tuple[float, ...],
) -> AnyArray:
    model = machine.value
    yaw, pitch, roll = (ANGLE * k for k in turn)
    T_site_root = transform.make(
        rotation.from_attitude(yaw, pitch, roll), POSITION * np.array(place, dtype=float)
    )
    far = model.bounding_radius + float(np.linalg.norm(model.arm.T_root_swing[:3, 3]))
    rounding = 0.5 * POSITION * math.sqrt(3.0) + 0.5 * ANGLE * 3.0 * far
    boxes = site.value.boxes.moved(transform.inverse(T_site_root))
    near = np.linalg.norm(boxes.centers, axis=1)
    near = near - np.linalg.norm(boxes.half_extents, axis=1) <= far + rounding + LENGTH * length
    grown = arm_model(model, _joints(model, rest), LENGTH * length + rounding)
    return blocked(grown, whole_grid(model, shape), boxes.take(near), OUTER)


@lru_cache(maxsize=16)
def _itself(
    machine: ByIdentity[Machine], steps: tuple[int, ...], shape: Shape, rest: tuple[float, ...]
) -> AnyArray:
    model = machine.value
    slack = ANGLE * np.array(steps, dtype=float)
    as_built = arm_model(model, _joints(model, rest))
    return self_blocked(as_built, whole_grid(model, shape), OUTER, slack)


def _joints(machine: Machine, rest: tuple[float, ...]) -> Array:
    q = np.zeros(len(machine.joints))
    q[4:] = rest
    return q
