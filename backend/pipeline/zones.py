"""The exact driving zones of one snapshot: where own's base must not go because of a partner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving import Exit, driving_zone, turning_zone, way_out
from backend.pipeline.config import Config
from backend.pipeline.images import pair_key
from backend.pipeline.place import base_transform
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import growth
from backend.spatial import rotation, transform
from backend.spatial.types import Array

TURNING = "turning"

TOLERANCE = 0.01
"""How far the live zones may exceed the true ones [m]."""

NEARLY_LEVEL = 0.01
"""Less tilt than this counts as level ground, in return for growing the partner by what it moves:
the swept zones of an upright machine take a fraction of the time [rad]."""


@dataclass(frozen=True)
class ZoneImage:
    """Zones of own's base beside partner, in the site frame, with what is not known exactly.

    base: (2,) own's base point then [m]; eta: growth of the bodies [m]; zones, exits: "as_is",
    "any_swing", "any_posture", and "turning": as it is, while the heading turns on the spot.
    """

    own: str
    partner: str
    state_time: float
    base: Array
    eta: float
    zones: dict[str, BaseGeometry]
    exits: dict[str, Exit]

    @property
    def key(self) -> str:
        return pair_key(self.own, self.partner)


def zone_image(snapshot: Snapshot, config: Config, own: str, partner: str) -> ZoneImage:
    """Raises ValueError when one of the machines is not placed."""
    machine, state = config.machines[own], snapshot.machines[own]
    body = snapshot.machines[partner].body
    if state.body is None or body is None:
        raise ValueError(f"{own} or {partner} is not placed yet")
    T, q = base_transform(state.pose), state.pose.joints
    eta = growth(own, snapshot.machines, config)
    upright = rotation.rz(np.asarray(state.pose.yaw))
    turn = float(np.arccos(np.clip((np.trace(upright.T @ T[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)))
    if turn < NEARLY_LEVEL:
        # Set upright, no point of the machine moves farther than this.
        reach = machine.bounding_radius + float(np.linalg.norm(machine.arm.T_root_swing[:3, 3]))
        eta += turn * reach
        T = transform.make(upright, T[:3, 3])
    zone = driving_zone(machine, q, T, body.boxes, eta, TOLERANCE)
    base = np.array(T[:2, 3])
    turning = turning_zone(machine, q, T, body.boxes, eta=eta, tolerance=TOLERANCE)
    zones = {
        "as_is": zone.as_is,
        "any_swing": zone.any_swing,
        "any_posture": zone.any_posture,
        TURNING: turning,
    }
    exits = {**zone.exits, TURNING: way_out(turning, base)}
    return ZoneImage(own, partner, snapshot.state_time, base, eta, zones, exits)
