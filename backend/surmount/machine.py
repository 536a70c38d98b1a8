"""A machine that surmounts: its crawler, masses and arm, worked out once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backend.contact.crawler import Crawler, crawler_of
from backend.contact.outfit import edge_half_width, edge_radius
from backend.machine.inverse import inverse
from backend.machine.kinematics import link_poses
from backend.machine.model import Machine
from backend.spatial import rotation
from backend.spatial.types import Array, BoolArray, IntArray
from backend.stability.masses import GRAVITY, MassModel, mass_model
from backend.surmount.records import Demands


@dataclass(frozen=True, eq=False)
class Climber:
    """machine; demands; crawler, facing the step with the end that goes first: `middle` is that
    much before the swing axis in the direction of climbing [m]; masses, with the payload; edge:
    radius of the bar at the bucket's edge, and half its width [m].
    """

    machine: Machine
    demands: Demands
    crawler: Crawler
    masses: MassModel
    edge: tuple[float, float]

    @property
    def a(self) -> float:
        """Half of the base [m]."""
        return self.crawler.half_base

    @property
    def r(self) -> float:
        """Of the end wheels [m]."""
        return self.crawler.radius

    @property
    def weight(self) -> float:
        """[N]"""
        return self.masses.total * GRAVITY

    def root_poses(self, x: Array, z: Array, alpha: Array) -> Array:
        """(m, 4, 4) T_step_root of P_b at x, z (m,) [m], leaning by alpha (m,) [rad]."""
        f = self.demands.facing
        yaw = 0.0 if f > 0 else np.pi
        x, z, alpha = np.broadcast_arrays(x, z, alpha)
        T = np.zeros((*np.shape(alpha), 4, 4))
        T[..., :3, :3] = rotation.from_attitude(yaw, f * np.asarray(alpha))
        T[..., 3, 3] = 1.0
        back = f * self.crawler.middle
        T[..., 0, 3] = x - back * np.cos(alpha)
        T[..., 2, 3] = z - back * np.sin(alpha)
        return T

    def arm(self, T_step_root: Array, held: Array, way: int) -> tuple[Array, BoolArray]:
        """Joints (m, n) [rad] that hold the bucket's edge at held (m, 2), x and z in the arm's
        plane, with the bucket's attitude over the ground, and whether the lengths allow it (m,).

        way: 1 with the arm in the direction of climbing, -1 behind. Eqs. (12)-(15) in closed form.
        """
        held = np.broadcast_to(held, (*T_step_root.shape[:-2], 2))
        p = np.stack([held[..., 0], np.zeros(held.shape[:-1]), held[..., 1]], axis=-1)
        # The arm's plane may lie beside the swing axis.
        p[..., 1] = way * self.machine.arm.tip_lateral
        p_root = np.einsum(
            "...ji,...j->...i", T_step_root[..., :3, :3], p - T_step_root[..., :3, 3]
        )
        alpha = np.arcsin(T_step_root[..., 2, 0]) * self.demands.facing
        attitude = self.demands.attitude - way * alpha
        found = inverse(self.machine, p_root, attitude)
        q = found.q.copy()
        if q.ndim > 1:
            q[:, 0] = np.unwrap(q[:, 0])
        return q, found.reachable

    def bodies(self, T_step_root: Array, q: Array) -> Array:
        """(m, B, 8, 3) corners of all bodies but the belts', step frame [m]."""
        machine = self.machine
        T = link_poses(machine, q, T_step_root)[..., machine.body_link_index, :, :]
        corners = machine.body_corners
        placed = np.einsum("...ij,...kj->...ki", T[..., :3, :3], corners)
        placed = placed + T[..., None, :3, 3]
        return np.asarray(placed[..., self.beside, :, :])

    @cached_property
    def beside(self) -> IntArray:
        """Indices of the bodies that are no belts."""
        belts = set(self.crawler.bodies)
        return np.array([k for k in range(len(self.machine.body_names)) if k not in belts])

    @cached_property
    def of_bucket(self) -> BoolArray:
        """By index of `beside`: whether the bucket's."""
        links = np.array(self.machine.body_links)[self.beside]
        return np.asarray(links == self.machine.end_link)


def climber(machine: Machine, demands: Demands) -> Climber:
    """Raises InputError for a machine that does not stand on two tracks, or of unknown masses."""
    return Climber(
        machine,
        demands,
        crawler_of(machine),
        mass_model(machine, demands.payload),
        (edge_radius(machine), edge_half_width(machine)),
    )
