"""Joint torques and contact forces at rest, and the energy of a slow motion.

The ground bears the crawler along one line and the bucket's edge along another. With the forces
upright they follow from the weight; forces along the ground may be added against each other, within
friction (the internal force): they change the torques, and nothing else. Friction of the drives and
losses of the hydraulics are not counted (Jayasekara and Arisumi 2015, Eq. (19)).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import link_poses
from backend.spatial.types import Array, BoolArray, IntArray
from backend.stability.dynamics import centres
from backend.stability.masses import GRAVITY
from backend.surmount.machine import Climber


class Weights(NamedTuple):
    """centre: (m, 3) of all mass [m], step frame; gravity: (m, n) torques that hold the arm against
    its weight alone [N m]; lift: (m, n, 2) torques that a force of 1 N on the bucket's edge needs,
    along x and z [m].
    """

    centre: Array
    gravity: Array
    lift: Array


def weights_of(climber: Climber, T_step_root: Array, q: Array) -> Weights:
    """T_step_root: (m, 4, 4); q: (m, n) [rad]."""
    machine, model = climber.machine, climber.masses
    T = link_poses(machine, q, T_step_root)
    c_root = np.moveaxis(centres(model, q), 0, 1)
    c = np.einsum("mij,mbj->mbi", T_step_root[:, :3, :3], c_root) + T_step_root[:, None, :3, 3]
    centre = np.einsum("b,mbi->mi", model.masses, c) / model.total
    n = q.shape[1]
    gravity, lift = np.zeros((len(q), n)), np.zeros((len(q), n, 2))
    end = T[:, machine.end_link]
    edge = np.einsum("mij,j->mi", end[:, :3, :3], machine.end_point) + end[:, :3, 3]
    order = {int(k): b for b, k in enumerate(model.joints)}
    for k in range(n):
        link = machine.joint_links[k]
        axis = T[:, link, :3, :3] @ machine.joint_axes[k]
        pivot = T[:, link, :3, 3]
        moved = _moved_by(model.parents, order[k])
        arms = np.einsum("b,mbi->mi", model.masses[moved], c[:, moved] - pivot[:, None])
        # The servo's torque is against that of the weight, and of the ground's force on the edge.
        down = np.cross(arms, np.array([0.0, 0.0, -GRAVITY]))
        gravity[:, k] = -(axis * down).sum(axis=1)
        lever = edge - pivot
        for i, direction in enumerate(([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])):
            lift[:, k, i] = -(axis * np.cross(lever, np.array(direction))).sum(axis=1)
    return Weights(centre, gravity, lift)


def _moved_by(parents: IntArray, first: int) -> BoolArray:
    inside = np.zeros(len(parents), dtype=bool)
    for b in range(len(parents)):
        inside[b] = b == first or (parents[b] >= 0 and inside[parents[b]])
    return inside


class Loads(NamedTuple):
    """bucket: (m,) upright force on the edge of the bucket [N]; crawler: (m,) the rest; torques:
    (m, n) of the joints with upright forces [N m]; internal: (m, n) more for each newton along the
    ground, forwards on the crawler, backwards on the bucket; shift: (m,) what the bucket's upright
    force gains by that.
    """

    bucket: Array
    crawler: Array
    torques: Array
    internal: Array
    shift: Array


def loads_of(climber: Climber, found: Weights, line: Array, held: Array) -> Loads:
    """line: (m, 2) x and z of where the ground bears the crawler; held: (2,) of the bucket [m]."""
    weight = climber.weight
    apart = held[0] - line[:, 0]
    bucket = weight * (found.centre[:, 0] - line[:, 0]) / apart
    # Moment about the line: f at the bucket backwards has the lever of its height over the line.
    shift = -(held[1] - line[:, 1]) / apart
    torques = found.gravity + bucket[:, None] * found.lift[..., 1]
    internal = -found.lift[..., 0] + shift[:, None] * found.lift[..., 1]
    return Loads(bucket, weight - bucket, torques, internal, shift)


def slow_energy(loads: Loads, q: Array, belt: Array, friction: float) -> float:
    """The least mechanical energy [J] of going through rows slowly, Eq. (19): the sum of all
    |torque x angle| and |force x way of the belts|, the force along the ground being at each row
    the one that needs least, within friction.

    q: (m, n) [rad]; belt: (m,) its way [m].
    """
    dq, db = np.diff(q, axis=0), np.diff(belt)

    def middle(values: Array) -> Array:
        return 0.5 * (values[1:] + values[:-1])

    torques, internal = middle(loads.torques), middle(loads.internal)
    most = friction * np.minimum(middle(loads.bucket), middle(loads.crawler)).clip(0.0)
    # Convex and piecewise linear in the force: its least is at a bend, at 0 or at an end.
    with np.errstate(divide="ignore", invalid="ignore"):
        bends = np.where(np.abs(internal) > 1e-12, -torques / internal, 0.0)
    tried = np.concatenate([bends, np.zeros((len(dq), 1)), most[:, None], -most[:, None]], axis=1)
    tried = np.clip(tried, -most[:, None], most[:, None])
    work = np.abs((torques[:, None] + tried[..., None] * internal[:, None]) * dq[:, None]).sum(-1)
    # The belts push the crawler forwards over the ground where f does, against their own way back.
    work = work + np.abs(tried * db[:, None])
    return float(work.min(axis=1).sum())
