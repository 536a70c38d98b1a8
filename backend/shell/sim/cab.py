"""Where the cab's camera of a simulated machine is, and what it sees of the machines there."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import PARTS, Machine
from backend.shell.sim.view import Lens, draw, looking
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.types import AnyArray, Array

PITCH = math.radians(-18.0)
BELOW_ROOF = 0.25  # of the cab's height, where the sidecar does not say where the eyes are
PAINTS: AnyArray = np.array([[210, 195, 148], [159, 185, 204], [191, 176, 207], [169, 196, 172]])
"""Of the machines in the site's order, as in the 3D scene: none can be taken for a level's."""
IRON: AnyArray = np.array([58, 60, 64])
STEEL: AnyArray = np.array([104, 108, 112])
CONCRETE: AnyArray = np.array([150, 148, 142])
CLOTH: AnyArray = np.array([228, 224, 206])
LORRY: AnyArray = np.array([120, 132, 140])


@dataclass(frozen=True)
class Seen:
    """A machine in one posture. q: (n,) [rad]; T_site_root: (4, 4); paint: index of PAINTS."""

    machine: Machine
    q: Array
    T_site_root: Array
    paint: int = 0


@dataclass(frozen=True)
class Surroundings:
    """What else is on the site, in the site frame. boxes: of what stands still."""

    boxes: Boxes = field(default_factory=lambda: NO_BOXES)
    people: Boxes = field(default_factory=lambda: NO_BOXES)
    vehicles: Boxes = field(default_factory=lambda: NO_BOXES)


def eye_in_upper(machine: Machine) -> tuple[int, Array]:
    """Link and position (3,) in it [m] of the eyes in the cab.

    As the sidecar says; else in the middle of the upper body's highest body, which is taken for
    the cab, a quarter of its height below its roof.
    """
    if machine.eye is not None:
        return machine.eye.link, machine.eye.position
    parts = machine.body_parts == "upper"
    corners = machine.bodies.corners()
    tops = np.where(parts, corners[..., 2].max(axis=1), -np.inf)
    cab = int(tops.argmax())
    height = float(np.ptp(corners[cab, :, 2]))
    position = machine.bodies.centers[cab].copy()
    position[2] = tops[cab] - BELOW_ROOF * height
    return machine.body_links[cab], position


def camera_pose(machine: Machine, q: Array, T_site_root: Array) -> Array:
    """T_site_camera (4, 4): from the cab along the arm's plane, PITCH upwards."""
    link, position = eye_in_upper(machine)
    T = link_poses(machine, q)[link]
    rest = link_poses(machine, np.zeros_like(q))[link]
    c, s = math.cos(machine.sun.azimuth_offset), math.sin(machine.sun.azimuth_offset)
    turned = T_site_root[:3, :3] @ T[:3, :3] @ rest[:3, :3].T
    eye = T_site_root @ T @ np.append(position, 1.0)
    return looking(eye[:3], turned @ np.array([c, s, 0.0]), turned[:, 2], PITCH)


def cab_view(
    own: Seen, others: Iterable[Seen], site: Surroundings, lens: Lens | None = None
) -> AnyArray:
    """(height, width, 3) uint8: what is seen from the cab of `own`; the cab itself is not, since
    the eyes are in it.
    """
    everyone = (own, *others)
    boxes = [body_boxes(m.machine, link_poses(m.machine, m.q, m.T_site_root)) for m in everyone]
    colors = [_colors(m.machine, m.paint) for m in everyone]
    rest = ((site.boxes, CONCRETE), (site.people, CLOTH), (site.vehicles, LORRY))
    colors += [np.tile(color, (len(of), 1)) for of, color in rest]
    T_site_camera = camera_pose(own.machine, own.q, own.T_site_root)
    together = concatenated([*boxes, *(of for of, _ in rest)])
    return draw(lens or Lens(), T_site_camera, together, np.concatenate(colors))


def _colors(machine: Machine, paint: int) -> AnyArray:
    """(n, 3) of the bodies: iron tracks, steel from the bucket on, the rest painted."""
    order = np.array([PARTS.index(part) for part in machine.body_parts])
    colors = np.tile(PAINTS[paint % len(PAINTS)], (len(order), 1))
    colors[order == PARTS.index("tracks")] = IRON
    colors[order >= PARTS.index("bucket")] = STEEL
    return colors
