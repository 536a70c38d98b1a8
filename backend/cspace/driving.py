"""Where a machine's base must not stand, exact: its driving zone against bodies that stand.

Three variants: the machine as it is now, moved without turning; swinging freely in its posture;
in any posture. And the zone while the heading turns. Polygons contain the true zone and exceed it
by at most `tolerance` on an upright axis (see `driving_tilted`, `driving_turning` for the rest);
distances are measured to them, so they err to the safe side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from backend.cspace.driving_cover import cover
from backend.cspace.driving_posture import moved, swept_arm
from backend.cspace.driving_profile import Revolved, revolve
from backend.cspace.driving_revolved import revolved_pieces
from backend.cspace.driving_tilted import tilted_pieces
from backend.cspace.driving_turning import turning_pieces
from backend.cspace.minkowski import Pieces, joined_pieces, slice_pieces
from backend.machine import kinematics
from backend.machine.model import Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray

TOLERANCE = 8e-4
"""How far a drawn zone may exceed the true one [m]."""

SLOPE_TOLERANCE = 1e-2
"""The same for what swings about an axis that is not upright [m]: cavities are larger than this."""

AS_IS, ANY_SWING, ANY_POSTURE, TURNING = "as_is", "any_swing", "any_posture", "turning"

_LEVEL = 1e-9
"""A swing axis this close to upright counts as upright [rad]."""


@dataclass(frozen=True)
class Exit:
    """The way from a point to the edge of a zone.

    signed_distance: [m], positive outside, inf when there is no zone. direction: (2,) unit vector
    in the plane, the shortest way out from inside; from outside, the way that leads straight away.
    length: to drive in that direction until free [m], 0 outside.
    """

    signed_distance: float
    direction: Array
    length: float


@dataclass(frozen=True)
class DrivingZone:
    """Positions (x, y) of the base, in the frame of its pose, that bring contact.

    Geometries are shapely Polygons or MultiPolygons with holes [m], empty when nothing is in reach.
    """

    as_is: BaseGeometry
    any_swing: BaseGeometry
    any_posture: BaseGeometry
    exits: dict[str, Exit]  # "as_is", "any_swing", "any_posture": from the base's own position

    @property
    def signed_distances(self) -> dict[str, float]:
        """Variant -> distance of the base from the zone's edge [m], positive outside."""
        return {name: exit_.signed_distance for name, exit_ in self.exits.items()}


def driving_zone(
    own_machine: Machine,
    own_q: Array,
    T_own_base: Array,
    partner_boxes: Boxes,
    eta: float = 0.0,
    tolerance: float = TOLERANCE,
    view: float = np.inf,
) -> DrivingZone:
    """All three variants of the zone that `own_machine` must not drive into.

    own_q: (n,) [rad]; T_own_base: (4, 4), the URDF root in any frame with z up; partner_boxes: in
    the same frame; eta: inflation [m], every partner box grown by it on every side (this contains
    the ball of radius eta); view: the zone is complete within this distance of the base [m], boxes
    that cannot matter there are left out, and a distance above it means "farther than the view".
    The first call for a machine sweeps its arm and takes about a second.
    Raises ValueError for a negative or infinite eta and a tolerance that is not positive.
    """
    _check(eta, tolerance)
    near = partner_boxes
    if np.isfinite(view):
        near = _in_view(partner_boxes, T_own_base, whole_reach(own_machine) + view + 2.0 * eta)
    scene = _Scene.of(own_machine, own_q, T_own_base, near, eta, tolerance)
    base = np.asarray(T_own_base, dtype=float)[:2, 3]
    zones = {name: scene.zone(name) for name in (AS_IS, ANY_SWING, ANY_POSTURE)}
    exits = {name: way_out(zone, np.zeros(2)) for name, zone in zones.items()}
    placed = {name: shapely.transform(zone, lambda p: p + base) for name, zone in zones.items()}
    return DrivingZone(exits=exits, **placed)


def one_zone(
    variant: str,
    own_machine: Machine,
    own_q: Array,
    T_own_base: Array,
    boxes: Boxes,
    eta: float = 0.0,
    tolerance: float = TOLERANCE,
) -> BaseGeometry:
    """A single variant of the zone: AS_IS, ANY_SWING, ANY_POSTURE or TURNING (a full circle).

    boxes: of whatever must not be touched. Other arguments as in `driving_zone`; ANY_SWING asks for
    no swing angle, ANY_POSTURE for no joint values at all.
    """
    if variant == TURNING:
        return turning_zone(own_machine, own_q, T_own_base, boxes, eta=eta, tolerance=tolerance)
    _check(eta, tolerance)
    base = np.asarray(T_own_base, dtype=float)[:2, 3]
    zone = _Scene.of(own_machine, own_q, T_own_base, boxes, eta, tolerance).zone(variant)
    return shapely.transform(zone, lambda p: p + base)


def whole_reach(machine: Machine) -> float:
    """No point of a machine is farther from the origin of its root frame in any posture [m]."""
    return machine.bounding_radius + float(np.linalg.norm(machine.arm.T_root_swing[:3, 3]))


def turning_zone(
    own_machine: Machine,
    own_q: Array,
    T_own_base: Array,
    partner_boxes: Boxes,
    turn: tuple[float, float] = (0.0, 2.0 * np.pi),
    eta: float = 0.0,
    tolerance: float = TOLERANCE,
) -> BaseGeometry:
    """The zone of the machine as it is while its heading turns on the spot about the base.

    turn: first and last heading relative to the present one [rad]; a full circle is exact to
    `tolerance`, less than that is covered in steps (see `turning_pieces`). Other arguments as in
    `driving_zone`.
    """
    _check(eta, tolerance)
    if not turn[0] <= turn[1]:
        raise ValueError(f"turn must lead from a smaller to a larger angle, not {turn}")
    T, bodies = _local(T_own_base, partner_boxes, eta)
    own = kinematics.body_boxes(own_machine, kinematics.link_poses(own_machine, own_q, T))
    if turn[1] - turn[0] >= 2.0 * np.pi:
        pieces = revolved_pieces(revolve(own, 0.5 * tolerance), bodies, 0.5 * tolerance)
    else:
        pieces = turning_pieces(bodies, own, turn[0], turn[1], tolerance)
    base = np.asarray(T_own_base, dtype=float)[:2, 3]
    return shapely.transform(cover(pieces), lambda p: p + base)


def way_out(zone: BaseGeometry, point: Array) -> Exit:
    """Signed distance and shortest way from a point (2,) to the edge of a zone."""
    if zone.is_empty:
        return Exit(float("inf"), np.array([1.0, 0.0]), 0.0)
    here = shapely.Point(point)
    inside = bool(shapely.covers(zone, here))
    line = shapely.get_coordinates(shapely.shortest_line(here, zone.boundary))
    step = line[1] - line[0] if inside else line[0] - line[1]
    length = float(np.hypot(*step))
    direction = step / length if length > 0.0 else np.array([1.0, 0.0])
    return Exit(-length if inside else length, direction, length if inside else 0.0)


@dataclass(frozen=True)
class _Scene:
    """Own bodies and those that it must not touch, about the own base. part: of the tolerance."""

    machine: Machine
    q: Array
    T: Array
    own: Boxes
    bodies: Boxes
    part: float

    @staticmethod
    def of(
        machine: Machine, q: Array, T_base: Array, boxes: Boxes, eta: float, tolerance: float
    ) -> _Scene:
        T, bodies = _local(T_base, boxes, eta)
        own = kinematics.body_boxes(machine, kinematics.link_poses(machine, q, T))
        upright = np.hypot(*T[:2, 2]) <= _LEVEL
        # Half of the tolerance for the radii of the solid, half for drawing its arcs.
        part = 0.5 * (tolerance if upright else max(tolerance, SLOPE_TOLERANCE))
        return _Scene(machine, q, T, own, bodies, part)

    @cached_property
    def tracks(self) -> BoolArray:
        """(n,) which of the own bodies do not swing."""
        parts = (self.machine.part_of_body(b) for b in range(len(self.own)))
        return np.array([part == "tracks" for part in parts])

    @cached_property
    def parked(self) -> Pieces:
        return slice_pieces(self.bodies, self.own.take(self.tracks))

    def zone(self, variant: str) -> BaseGeometry:
        """Shifts of the base; not for TURNING."""
        if variant == AS_IS:
            return cover(slice_pieces(self.bodies, self.own))
        if variant == ANY_SWING:
            args = (self.machine, self.own, self.q, self.tracks, self.T, self.bodies, self.part)
            return cover(joined_pieces([self.parked, _swinging(*args)]))
        if variant != ANY_POSTURE:
            raise ValueError(f"no variant of a zone is called {variant}")
        arm, axis = swept_arm(self.machine, self.part), self.T @ self.machine.arm.T_root_swing
        return cover(joined_pieces([self.parked, _about(arm, axis, self.bodies, self.part)]))


def _swinging(
    machine: Machine, own: Boxes, q: Array, tracks: BoolArray, T: Array, bodies: Boxes, part: float
) -> Pieces:
    """The bodies above the swing joint, swung over their limits, or all the way round."""
    T_site_swing = T @ machine.arm.T_root_swing
    upper = moved(own.take(~tracks), transform.inverse(T_site_swing))
    swing = machine.joints[0]
    upright = np.hypot(*T_site_swing[:2, 2]) <= _LEVEL
    if upright and not swing.continuous and swing.upper - swing.lower < 2.0 * np.pi:
        link = next(link for link in machine.links if link.joint == 0)
        i = machine.links.index(link)
        axis = kinematics.link_poses(machine, q, T)[i, :3, :3] @ link.axis
        ends = sorted(np.sign(axis[2]) * (np.array([swing.lower, swing.upper]) - q[0]))
        origin = T_site_swing[:3, 3]
        still = Boxes(bodies.centers - origin, bodies.rotations, bodies.half_extents)
        R = T_site_swing.copy()
        R[:3, 3] = 0.0
        return turning_pieces(still, moved(upper, R), float(ends[0]), float(ends[1]), 2.0 * part)
    return _about(revolve(upper, part), T_site_swing, bodies, part)


def _about(solid: Revolved, T_site_axis: Array, bodies: Boxes, part: float) -> Pieces:
    if np.hypot(*T_site_axis[:2, 2]) > _LEVEL:
        return tilted_pieces(solid, T_site_axis, bodies, part)
    shifted = Boxes(bodies.centers - T_site_axis[:3, 3], bodies.rotations, bodies.half_extents)
    return revolved_pieces(solid, shifted, part)


def _local(T_own_base: Array, partner_boxes: Boxes, eta: float) -> tuple[Array, Boxes]:
    """Both machines with the own base at the origin, where numbers are small; partner inflated."""
    T = np.array(T_own_base, dtype=float)
    base = T[:3, 3].copy()
    T[:3, 3] = 0.0
    bodies = Boxes(
        partner_boxes.centers - base, partner_boxes.rotations, partner_boxes.half_extents
    )
    return T, bodies.inflated(eta) if eta > 0.0 else bodies


def _in_view(bodies: Boxes, T_base: Array, radius: float) -> Boxes:
    """The boxes whose bounding spheres come within `radius` [m] of the vertical at the base."""
    apart = np.hypot(*(bodies.centers[:, :2] - np.asarray(T_base, dtype=float)[:2, 3]).T)
    return bodies.take(apart - np.linalg.norm(bodies.half_extents, axis=1) <= radius)


def _check(eta: float, tolerance: float) -> None:
    if not (np.isfinite(eta) and eta >= 0.0):
        raise ValueError(f"eta must be 0 or more metres, not {eta}")
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise ValueError(f"tolerance must be more than 0 metres, not {tolerance}")
