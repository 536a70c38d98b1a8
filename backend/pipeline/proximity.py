"""Distances between machines, and what each of them may still do."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from backend.collision.closest import ClosePairs, closest_pairs
from backend.fusion.pose import Validity
from backend.machine import kinematics
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState, PairDistance
from backend.safety.partner import Proximity
from backend.spatial.types import Array


def measure(
    states: dict[str, MachineState], config: Config
) -> tuple[tuple[PairDistance, ...], dict[str, list[Proximity]], dict[str, str]]:
    """Closest bodies of every pair of machines that concerns an own machine.

    Returns the pairs; per own machine all close pairs of bodies; per own machine the reason why a
    distance is unknown.
    """
    pairs: list[PairDistance] = []
    close: dict[str, list[Proximity]] = {name: [] for name in config.own}
    unknown: dict[str, str] = {}
    for a, b in combinations(config.machines, 2):
        if a not in config.own and b not in config.own:
            continue
        reason = why_unknown(states[a], states[b], config)
        if reason:
            pairs.append(_unknown(a, b, reason))
            unknown.update({name: reason for name in (a, b) if name in config.own})
            continue
        gap = _workspace_gap(states[a], states[b], config)
        if gap > config.far:
            pairs.append(PairDistance(a, b, "", "", gap, None, "", 0, near=False))
            continue
        pair, near = _closest(a, b, states, config)
        pairs.append(pair)
        for proximity in near:
            owner = proximity.own.partition(":")[0]
            if owner in close:
                close[owner].append(proximity)
    return tuple(pairs), close, unknown


def why_unknown(a: MachineState, b: MachineState, config: Config) -> str:
    """Empty when both machines are placed and valid."""
    for state in (a, b):
        label = config.labels[state.pose.machine]
        if state.pose.validity is not Validity.VALID or state.body is None:
            return f"{label} {state.pose.reasons[0] if state.pose.reasons else 'is unknown'}"
    return ""


def _closest(
    a: str, b: str, states: dict[str, MachineState], config: Config
) -> tuple[PairDistance, list[Proximity]]:
    state_a, state_b = states[a], states[b]
    assert state_a.body is not None
    assert state_b.body is not None
    # Both poses may be wrong by what their inflation holds beyond the configured factor.
    doubt = state_a.eta + state_b.eta - 2.0 * config.eta
    found = closest_pairs(
        state_a.body.boxes, state_b.body.boxes, within=config.limits.slow_below + doubt
    )
    near, closing = _both_sides(a, b, states, config, found, doubt)
    i, j = found.index[0]
    pair = PairDistance(
        a,
        b,
        config.machines[a].body_names[i],
        config.machines[b].body_names[j],
        float(found.distance[0]),
        found.points[0],
        "",
        len(found.distance),
        near=True,
        approach=float(closing[0]),
    )
    return pair, near


def _both_sides(
    a: str,
    b: str,
    states: dict[str, MachineState],
    config: Config,
    found: ClosePairs,
    doubt: float,
) -> tuple[list[Proximity], Array]:
    """Every close pair seen from a and from b, and the closing speeds (k,) [m/s]."""
    away = _away(found.points, states, a, b)
    gradients, forward, velocities = [], [], []
    for side, (name, sign) in enumerate(((a, 1.0), (b, -1.0))):
        machine, state = config.machines[name], states[name]
        assert state.body is not None
        J = kinematics.body_point_jacobians(
            machine, state.body.link_poses, found.index[:, side], found.points[:, side]
        )
        ahead = np.array([np.cos(state.pose.yaw), np.sin(state.pose.yaw), 0.0])
        gradients.append(sign * np.einsum("kx,kxn->kn", away, J))
        forward.append(sign * away @ ahead)
        velocities.append(J @ state.pose.joint_velocities + state.pose.base_velocity)
    closing = -np.einsum("kx,kx->k", away, velocities[0] - velocities[1])
    near = []
    for k, pair in enumerate(found.index):
        names = [
            f"{name}:{config.machines[name].body_names[pair[side]]}"
            for side, name in enumerate((a, b))
        ]
        near += [
            Proximity(
                own=names[side],
                other=names[1 - side],
                distance=float(found.distance[k]),
                margin=float(found.distance[k]) - doubt,
                points=found.points[k, ::-1] if side else found.points[k],
                gradient=gradients[side][k],
                travel_gradient=float(forward[side][k]),
                closing=float(closing[k]),
            )
            for side in (0, 1)
        ]
    return near, closing


def _away(points: Array, states: dict[str, MachineState], a: str, b: str) -> Array:
    """Unit vectors (k, 3) from b's points to a's; between swing centres where they coincide."""
    body_a, body_b = states[a].body, states[b].body
    assert body_a is not None
    assert body_b is not None
    delta = points[:, 0] - points[:, 1]
    apart = np.linalg.norm(delta, axis=1) > 1e-9
    delta = np.where(apart[:, None], delta, body_a.swing_center - body_b.swing_center)
    return np.asarray(delta / np.maximum(np.linalg.norm(delta, axis=1, keepdims=True), 1e-9))


def _workspace_gap(a: MachineState, b: MachineState, config: Config) -> float:
    """Lower bound of the distance: swing centres apart less both maximum reaches [m]."""
    assert a.body is not None
    assert b.body is not None
    apart = float(np.linalg.norm(a.body.swing_center - b.body.swing_center))
    radii = (config.machines[s.pose.machine].bounding_radius for s in (a, b))
    return apart - sum(radii)


def _unknown(a: str, b: str, reason: str) -> PairDistance:
    return PairDistance(a, b, "", "", float("nan"), None, reason, 0, near=True)
