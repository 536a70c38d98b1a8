"""The three ways while somebody drives: what the levers ask for in, less of it out.

Levers are direct: a joint whose stick is in neutral stands, and one whose stick is deflected is
neither turned back nor made faster than asked. Of each method only what lies between standing and
the wish counts, so that standing is always among it. Tracks pass unchanged, ends of travel are the
limiter's, which comes afterwards in any case and may slow any joint: C therefore counts on none
that moves away to make up for one that approaches. Own bodies are left out: a boom's foot is always
nearer to its own tracks than p_u.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses, swing_center
from backend.machine.model import Machine
from backend.planning.act import act, reasons, sight
from backend.planning.proximity import Limits, Proximities, Sight, near_points
from backend.planning.records import Method, Settings, State, Thresholds
from backend.planning.records import Wish as Rates
from backend.safety.limiter import Wish
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

STEP = 0.02
"""[s] between two commands."""


@dataclass(frozen=True)
class Around:
    """Where a machine is and what is around it, by the newest snapshot.

    q: (n,) [rad]; T_site_links: (L, 4, 4); limits: what stands on the site and the partners'
    bodies where they are now; doubt: (k,) how much nearer each may be than it seems [m]; unknown:
    why a pose is not certain, else empty.
    """

    q: Array
    T_site_links: Array
    limits: Limits
    doubt: Array
    unknown: str = ""


class Shaped(NamedTuple):
    """wish: for the limiter; scale: the smallest share that a deflected joint has left of what was
    asked, 1 where nothing was cut; why: in words what limited, the closest first.
    """

    wish: Wish
    scale: float
    why: tuple[str, ...]


def shape(
    method: Method, machine: Machine, around: Around, wish: Wish, thresholds: Thresholds
) -> Shaped:
    """What `method` leaves of the joints' wish; distances count less their doubt.

    Where a pose is not certain the wish passes, as the limiter lets nothing of it through. A
    method that fails for whatever reason leaves the joints standing, and says so.
    """
    if around.unknown:
        return Shaped(wish, 1.0, (f"{method} is left out: {around.unknown}",))
    fastest = machine.max_velocity
    asked = np.where(np.isfinite(wish.joints), wish.joints, 0.0)
    asked = np.clip(asked, -fastest, fastest)
    moving = asked != 0.0
    if not moving.any():
        return Shaped(wish, 1.0, ())
    low, high = np.minimum(asked, 0.0), np.maximum(asked, 0.0)
    try:
        rates, why = _acted(method, machine, around, asked, (low, high), thresholds)
        if not np.isfinite(rates).all():
            raise ArithmeticError("a joint's rate is not a number")
    except Exception as error:  # whatever it is: a machine must not move because of it
        return failed(method, wish, error)
    # What differs by rounding is not cut.
    whole = np.abs(rates - asked) <= 1e-9 * np.abs(asked)
    rates = np.where(whole, asked, np.clip(rates, low, high))
    scale = float((rates[moving] / asked[moving]).min())
    return Shaped(replace(wish, joints=rates), scale, why if scale < 1.0 else ())


def rehearse(machine: Machine) -> None:
    """Each method once, about a box beside the machine: whatever is slow the first time is done."""
    q = np.zeros(len(machine.joints))
    T = link_poses(machine, q)
    beside = body_boxes(machine, T)
    limits = Limits(machine.body_names, beside.moved(transform.make(np.eye(3), np.full(3, 0.1))))
    around = Around(q, T, limits, np.zeros(len(beside)))
    wish = Wish(machine.max_velocity, np.zeros(2))
    for method in get_args(Method):
        shape(method, machine, around, wish, Thresholds())


def failed(method: Method, wish: Wish, error: Exception) -> Shaped:
    """Joints that stand because the method failed."""
    what = str(error) or type(error).__name__
    still = replace(wish, joints=np.zeros_like(wish.joints))
    return Shaped(still, 0.0, (f"STOP: {method} failed: {what}",))


def _acted(
    method: Method,
    machine: Machine,
    around: Around,
    asked: Array,
    bounds: tuple[Array, Array],
    thresholds: Thresholds,
) -> tuple[Array, tuple[str, ...]]:
    # Without retreat: inside of p_l the dampers ask for no more than standing.
    settings = Settings(thresholds, retreat=0.0)
    # Copies: kernels are compiled anew for arrays that are read-only.
    q, T = np.array(around.q), np.array(around.T_site_links)
    state = State(np.zeros(len(q)), T[0])
    reach = sight(machine, T, method, settings, state, STEP, np.abs(asked))
    seen, less = _seen(machine, T, around, reach, corners=method != "potential")
    near = replace(seen, distance=seen.distance - less)
    done = act(method, machine, q, Rates(asked), near, state, STEP, settings, bounds)
    # Told as on the rest of the page: the distances of the bodies as built.
    return done.rates, reasons(machine, seen, done.binding)


def _seen(
    machine: Machine, T_site_links: Array, around: Around, reach: Sight, corners: bool
) -> tuple[Proximities, Array]:
    """The pairs within `reach` of what is near the machine, and the doubt of each (k,) [m]."""
    most = float(around.doubt.max(initial=0.0))
    center = swing_center(machine, T_site_links[0])
    boxes, names = around.limits.boxes, around.limits.names
    far = np.linalg.norm(boxes.centers - center, axis=1) - _radii(boxes)
    kept = np.flatnonzero(far < machine.bounding_radius + most + reach.limits.max(initial=0.0))
    limits = Limits(tuple(names[k] for k in kept), boxes.take(kept))
    wide = Sight(reach.limits + most, reach.own)
    near = near_points(machine, T_site_links, limits, wide, corners, own=False)
    return near, around.doubt[kept][near.obstacle]


def _radii(boxes: Boxes) -> Array:
    return np.asarray(np.linalg.norm(boxes.half_extents, axis=1))
