"""The tests' own dynamics: momenta of all links by the kinematics' Jacobians, nothing merged."""

from __future__ import annotations

import numpy as np

from backend.machine import kinematics
from backend.machine.model import Machine


def link_masses(
    machine: Machine, payload: float
) -> list[tuple[int, float, np.ndarray, np.ndarray]]:
    """(link, mass, com, tensor) of everything that moves; the payload hangs at the end point."""
    found = [
        (i, link.inertia.mass, link.inertia.com, link.inertia.tensor)
        for i, link in enumerate(machine.links)
        if link.inertia is not None
    ]
    return [*found, (machine.end_link, payload, machine.end_point, np.zeros((3, 3)))]


def centre(machine: Machine, q: np.ndarray, payload: float, T=None) -> np.ndarray:
    """(..., 3) centre of mass in the site frame."""
    T_links = kinematics.link_poses(machine, q, T)
    whole, total = 0.0, 0.0
    for i, mass, com, _ in link_masses(machine, payload):
        whole = whole + mass * (T_links[..., i, :3, :3] @ com + T_links[..., i, :3, 3])
        total += mass
    return whole / total


def momenta(machine: Machine, q: np.ndarray, qd: np.ndarray, payload: float) -> tuple:
    """Linear and angular momentum (..., 3) each, about the root's origin."""
    T_links = kinematics.link_poses(machine, q)
    P = L = 0.0
    for i, mass, com, tensor in link_masses(machine, payload):
        J = kinematics.jacobian(machine, q, None, i, com, angular=True)
        moving = (J @ qd[..., None])[..., 0]
        v, w = moving[..., :3], moving[..., 3:]
        R = T_links[..., i, :3, :3]
        c = (R @ com) + T_links[..., i, :3, 3]
        spin = (R @ tensor @ np.swapaxes(R, -1, -2) @ w[..., None])[..., 0]
        P, L = P + mass * v, L + np.cross(c, mass * v) + spin
    return P, L
