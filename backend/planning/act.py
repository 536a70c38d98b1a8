"""One step of any of the three methods: a wish and what is near in, joint rates and reasons out."""

from __future__ import annotations

import numpy as np

from backend.errors import InputError
from backend.machine.kinematics import body_boxes
from backend.machine.model import Machine
from backend.machine.pose import damped_inverse, tool_jacobian_at
from backend.planning import constrained, potential, velocity_scaling
from backend.planning.cushion import rate_bounds
from backend.planning.proximity import Proximities, Sight, gradients, posed
from backend.planning.records import Action, Method, Settings, State, Wish, damper_rate
from backend.spatial.types import Array, IntArray

_REASONS = 2  # told at most


def act(
    method: Method,
    machine: Machine,
    q: Array,
    wish: Wish,
    near: Proximities,
    state: State,
    dt: float,
    settings: Settings | None = None,
    bounds: tuple[Array, Array] | None = None,
) -> Action:
    """Joint rates (n,) [rad/s] for the next dt [s], and in words what limited them.

    q: (n,) [rad]; near: the pairs within `sight`. The same pairs
    serve all methods: A and C take corners as well, B picks the closest pair of each part.
    bounds: lowest and highest rates (n,) [rad/s] in the place of the machine's own, where its ends
    and accelerations are kept by somebody else afterwards: as that may slow any joint, C then
    relies on none that moves away to make up for one that approaches.
    """
    settings = settings or Settings()
    T = posed(machine, q, state.T_site_root)
    low, high = bounds or rate_bounds(machine, q, state.rates, dt, settings.accelerations)
    if method == "scaling":
        return _scaled(machine, q, wish, near, state, dt, settings, T, low, high)
    if method == "potential":
        return _repelled(machine, wish, near, settings, T, low, high)
    if method == "constrained":
        return _constrained(machine, wish, near, settings, T, low, high, bounds is not None)
    raise InputError(
        f"method '{method}' is not known; allowed are scaling, potential, constrained."
    )


def sight(
    machine: Machine,
    T_site_links: Array,
    method: Method,
    settings: Settings,
    state: State,
    dt: float,
    most: Array | None = None,
) -> Sight:
    """How near pairs must be to be told to `act`: p_u; for C all that could be damped.

    No distance shrinks faster than the joints' speeds, the highest that they can have after dt,
    times the levers of the bodies' farthest points. T_site_links: (L, 4, 4); most: (n,) speeds
    that `act` is given as bounds [rad/s], None where it is given none.
    """
    if method != "constrained":
        return Sight.everywhere(machine, settings.thresholds.upper)
    T = T_site_links[machine.joint_links]
    boxes = body_boxes(machine, T_site_links)
    radius = np.linalg.norm(boxes.half_extents, axis=1)
    z = (T[:, :3, :3] @ machine.joint_axes[:, :, None])[..., 0]
    r = boxes.centers[:, None] - T[None, :, :3, 3]
    along = np.einsum("bjx,jx->bj", r, z)
    lever = np.sqrt(np.maximum((r**2).sum(axis=2) - along**2, 0.0)) + radius[:, None]
    fastest = machine.max_velocity if most is None else most
    if settings.accelerations:
        fastest = np.minimum(fastest, np.abs(state.rates) + machine.max_acceleration * dt)
    speed = lever * machine.body_joints * fastest
    pairs = machine.self_pair_index
    own = (speed[pairs[:, 1]] * machine.self_pair_joints).sum(axis=1)
    scale, keep = 1.0 / _rate(machine, settings), settings.thresholds.lower
    return Sight(keep + scale * speed.sum(axis=1), keep + scale * own)


def task_rates(machine: Machine, T_site_links: Array, wish: Wish, damping: float) -> Array:
    """(n,) [rad/s] the wish alone, by damped least squares where it is a twist, Eq. (3.7), (3.9);
    slowed as a whole where a joint would be too fast. T_site_links: (L, 4, 4).
    """
    if wish.rates is not None:
        return np.clip(wish.rates, -machine.max_velocity, machine.max_velocity)
    assert wish.twist is not None
    J = tool_jacobian_at(machine, T_site_links)
    return _slowed(damped_inverse(J, damping) @ wish.twist, machine.max_velocity)


def _scaled(
    machine: Machine,
    q: Array,
    wish: Wish,
    near: Proximities,
    state: State,
    dt: float,
    settings: Settings,
    T: Array,
    low: Array,
    high: Array,
) -> Action:
    wanted = np.clip(task_rates(machine, T, wish, settings.damping), low, high)
    scale = velocity_scaling.scale_task if wish.rates is None else velocity_scaling.scale_joints
    found = scale(machine, q, wanted, T, near, settings.thresholds, dt, state.T_site_root)
    rates = np.clip(wanted * found.factors, low, high)
    return _told(rates, float(found.factors.min()), machine, near, found.binding)


def _repelled(
    machine: Machine,
    wish: Wish,
    near: Proximities,
    settings: Settings,
    T: Array,
    low: Array,
    high: Array,
) -> Action:
    wanted = task_rates(machine, T, wish, settings.damping)
    points = potential.obstacle_avoidance_points(machine, near)
    away = potential.repulsion(
        machine,
        T,
        near.take(points),
        tool_jacobian_at(machine, T),
        settings.gain,
        settings.thresholds,
        settings.damping,
        settings.projector,
    )
    rates = np.clip(wanted + away, low, high)
    pushing = points[near.distance[points] < settings.thresholds.upper]
    return _told(rates, 1.0, machine, near, pushing)


def _constrained(
    machine: Machine,
    wish: Wish,
    near: Proximities,
    settings: Settings,
    T: Array,
    low: Array,
    high: Array,
    alone: bool,
) -> Action:
    wanted = task_rates(machine, T, wish, settings.damping)
    if wish.rates is not None:
        H, g = constrained.nearest_to_rates(wanted, machine.max_velocity)
    else:
        J = tool_jacobian_at(machine, T)
        H, g = constrained.nearest_by_tool(wanted, J, settings.damping)
    parting = constrained.damper_bounds(near.distance, settings, _rate(machine, settings))
    gradient = gradients(machine, T, near)
    if alone:
        gradient = constrained.approaching(gradient, low, high)
    found = constrained.constrain(H, g, gradient, parting, low, high)
    moved = float(np.abs(wanted).max())
    scale = 1.0 if moved == 0.0 else min(1.0, float(np.abs(found.rates).max()) / moved)
    return _told(found.rates, scale, machine, near, found.binding)


def _rate(machine: Machine, settings: Settings) -> float:
    return damper_rate(machine) if settings.rate is None else settings.rate


def _slowed(rates: Array, most: Array) -> Array:
    return np.asarray(rates / max(1.0, float((np.abs(rates) / most).max())))


def _told(
    rates: Array, scale: float, machine: Machine, near: Proximities, index: IntArray
) -> Action:
    order = index[np.argsort(near.distance[index], kind="stable")]
    return Action(rates, scale, reasons(machine, near, order), order)


def reasons(machine: Machine, near: Proximities, order: IntArray) -> tuple[str, ...]:
    """The first of the pairs `order` in words, each once."""
    words = dict.fromkeys(near.words(machine, int(k)) for k in order[:8])
    return tuple(words)[:_REASONS]
