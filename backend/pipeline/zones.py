"""The exact driving zones of one snapshot: where own's base must not go because of a partner.

`zones_around` has those because of people and the site, as the same record.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving import (
    ANY_POSTURE,
    ANY_SWING,
    AS_IS,
    TURNING,
    Exit,
    driving_zone,
    turning_zone,
    way_out,
    whole_reach,
)
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.images import pair_key
from backend.pipeline.place import base_transform
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import PARTNER, growth
from backend.spatial import rotation, transform
from backend.spatial.types import Array

TOLERANCE = 0.01
"""How far the live zones may exceed the true ones [m]."""

NEARLY_LEVEL = 0.01
"""Less tilt than this counts as level ground, in return for growing the partner by what it moves:
the swept zones of an upright machine take a fraction of the time [rad]."""


@dataclass(frozen=True)
class ZoneImage:
    """Zones of own's base beside one layer: a partner, people or the site, in the site frame, with
    what is not known exactly.

    partner: None for people and the site; base: (2,) own's base point then [m]; eta: growth of the
    bodies [m]; zones, exits: "as_is", "any_swing", "any_posture", and "turning": as it is, while
    the heading turns on the spot. layer: PARTNER, PEOPLE or SITE; view: the zones are complete
    within this distance of the base [m], and no signed distance is larger; reason: why nothing is
    known of the layer, else empty; then there are no zones.
    """

    own: str
    partner: str | None
    state_time: float
    base: Array
    eta: float
    zones: dict[str, BaseGeometry]
    exits: dict[str, Exit]
    layer: str = PARTNER
    view: float = math.inf
    reason: str = ""

    @property
    def key(self) -> str:
        return pair_key(self.own, self.partner or f"layer:{self.layer}")


def zone_image(snapshot: Snapshot, config: Config, own: str, partner: str) -> ZoneImage:
    """Raises ValueError when one of the machines is not placed."""
    machine, state = config.machines[own], snapshot.machines[own]
    body = snapshot.machines[partner].body
    if state.body is None or body is None:
        raise ValueError(f"{own} or {partner} is not placed yet")
    q, eta = state.pose.joints, growth(own, snapshot.machines, config)
    T, eta = set_upright(machine, base_transform(state.pose), state.pose.yaw, eta)
    zone = driving_zone(machine, q, T, body.boxes, eta, TOLERANCE)
    base = np.array(T[:2, 3])
    turning = turning_zone(machine, q, T, body.boxes, eta=eta, tolerance=TOLERANCE)
    zones = {
        AS_IS: zone.as_is,
        ANY_SWING: zone.any_swing,
        ANY_POSTURE: zone.any_posture,
        TURNING: turning,
    }
    exits = {**zone.exits, TURNING: way_out(turning, base)}
    return ZoneImage(own, partner, snapshot.state_time, base, eta, zones, exits)


def set_upright(machine: Machine, T: Array, yaw: float, eta: float) -> tuple[Array, float]:
    """A nearly level base T (4, 4) without its tilt, and eta [m] grown by what that moves; both as
    they are on a slope. yaw: of the base [rad].
    """
    upright = rotation.rz(np.asarray(yaw))
    turn = float(np.arccos(np.clip((np.trace(upright.T @ T[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    if turn >= NEARLY_LEVEL:
        return T, eta
    # Set upright, no point of the machine moves farther than this.
    return transform.make(upright, T[:3, 3]), eta + turn * whole_reach(machine)
