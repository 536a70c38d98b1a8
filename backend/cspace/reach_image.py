"""The reach image: the present posture swung to another direction and extended to another reach."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from backend.cspace.exact_points import touching_layers
from backend.machine import inverse
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.machine.sun_map import sun_angles
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array, BoolArray

SELF = "self"

NEAR = np.deg2rad(5.0)
"""A joint this close to its limit counts as near it [rad]."""


class ReachState(IntEnum):
    """Of one cell. What is out of reach or beyond a limit is not asked for collision. COLLIDING:
    blocked by any layer.
    """

    FREE = 0
    COLLIDING = 1
    OUT_OF_REACH = 2
    BEYOND_LIMIT = 3


@dataclass(frozen=True)
class ReachImage:
    """swing: (s,) joint values [rad]; reach: (r,) of the tip from the swing axis [m], cell centres.

    state: (s, r) ReachState as uint8; layers: name -> (s, r) whether a colliding cell touches it,
    "self" among them, and those of `judges`; near_limit: (s, r) a joint is within NEAR of its
    limit, or beyond; height: of the tip above the swing joint's origin, along the swing axis [m];
    attitude: of the bucket [rad]; elbow: +1 up, -1 down.
    """

    swing: Array
    reach: Array
    swing_edges: Array
    reach_edges: Array
    state: AnyArray
    layers: dict[str, BoolArray]
    near_limit: BoolArray
    height: float
    attitude: float
    elbow: int


def reach_image(
    machine: Machine,
    q: Array,
    layers: Mapping[str, Boxes],
    shape: tuple[int, int] = (90, 60),
    height: float | None = None,
    judges: Mapping[str, Callable[[Array], BoolArray]] | None = None,
) -> ReachImage:
    """Every cell's configuration has the tip at q's height and the bucket at q's attitude.

    q: (n,) present joint values [rad]; layers: obstacles in the machine's root frame, by layer;
    height of the tip above the swing joint's origin, along the swing axis [m], the present one when
    None. The elbow stays on its present side. Swing covers the joint's range, a full turn when
    continuous; reach 0 to the machine's largest. judges: of further layers; given configurations
    (m, n) each tells (m,) which are blocked.
    """
    q = np.asarray(q, dtype=float)
    joint = machine.joints[0]
    low = joint.lower if np.isfinite(joint.lower) else -np.pi
    high = joint.upper if np.isfinite(joint.upper) else np.pi
    swing_edges = np.linspace(low, high, shape[0] + 1)
    reach_edges = np.linspace(0.0, machine.max_reach, shape[1] + 1)
    swing = 0.5 * (swing_edges[:-1] + swing_edges[1:])
    reach = 0.5 * (reach_edges[:-1] + reach_edges[1:])

    theta = sun_angles(machine, q)
    attitude = float(theta.sum())
    elbow = 1 if np.sin(theta[1]) <= 0.0 else -1
    p_now = transform.apply(
        transform.inverse(machine.arm.T_root_swing), end_point(machine, q)[None]
    )[0]
    z = float(p_now[2]) if height is None else float(height)

    # The inverse takes a point; where the tip stands beside the arm's plane, its direction from the
    # axis differs from the arm's by the same angle that the inverse takes off again. What it gives
    # for boom, stick and bucket is the same in every direction.
    lateral = machine.arm.tip_lateral
    beside = np.arctan2(lateral, np.sqrt(np.maximum(reach**2 - lateral**2, 0.0)))
    azimuth = machine.sun.azimuth_sign * swing[0] + machine.sun.azimuth_offset + beside
    p_swing = np.stack(
        [reach * np.cos(azimuth), reach * np.sin(azimuth), np.full_like(reach, z)], axis=-1
    )
    solution = inverse.inverse(
        machine, transform.apply(machine.arm.T_root_swing, p_swing), attitude, elbow
    )
    arm = solution.q.copy()
    arm[:, 4:] = q[4:]
    configurations = np.repeat(arm[None], len(swing), axis=0)
    configurations[..., 0] = swing[:, None]

    slack = np.minimum(arm[:, 1:] - machine.lower[1:], machine.upper[1:] - arm[:, 1:]).min(axis=1)
    state = np.full((len(swing), len(reach)), ReachState.FREE, dtype=np.uint8)
    state[:, ~(slack >= -1e-9)] = ReachState.BEYOND_LIMIT
    state[:, ~solution.reachable] = ReachState.OUT_OF_REACH
    asked = state == ReachState.FREE
    judges = judges or {}
    hit = {name: np.zeros(state.shape, dtype=bool) for name in (*layers, SELF, *judges)}
    against, itself = touching_layers(machine, configurations[asked], layers)
    judged = [(name, judge(configurations[asked])) for name, judge in judges.items()]
    for name, found in (*against.items(), (SELF, itself), *judged):
        hit[name][asked] = found
    state[np.any(list(hit.values()), axis=0)] = ReachState.COLLIDING
    near = np.repeat((solution.reachable & (slack < NEAR))[None], len(swing), axis=0)
    return ReachImage(swing, reach, swing_edges, reach_edges, state, hit, near, z, attitude, elbow)
