"""What an operator sees from the cab, and what the own machine hides. Pure; the site frame [m]."""

from __future__ import annotations

import numpy as np

from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, BoolArray
from cockpit.views.shapes import Float32

SIDE = float(np.radians(105.0))
"""How far to each side of straight ahead somebody sees who looks ahead [rad]."""
FAR = 12.0
"""Radius of the visibility circle of ISO 5006 [m]."""
NEAR = 1.0  # from the eye, where the fan begins [m]
HEIGHT = 1.5
"""Above the ground, at which somebody must be seen (ISO 5006, near the machine) [m]."""
AROUND = 0.1  # what is nearer to the eye is the cab, through whose windows is looked [m]
DIRECTIONS, RINGS = 120, 11


def directions(azimuth: float) -> Array:
    """(DIRECTIONS,) all around [rad], the first straight ahead."""
    return azimuth + np.arange(DIRECTIONS, dtype=np.float64) * (2.0 * np.pi / DIRECTIONS)


def edges() -> Array:
    """(RINGS + 1,) distances from the eye that bound the rings [m]."""
    return np.linspace(NEAR, FAR, RINGS + 1)


def hidden(eye: Array, azimuth: float, boxes: Boxes, ground: float) -> BoolArray:
    """(DIRECTIONS, RINGS) whether the middle of each cell, HEIGHT over the ground, is not seen.

    eye: (3,); azimuth: of straight ahead [rad]; boxes: bodies of the own machine, of which those
    around the eye hide nothing; ground: its height. Not seen is also what lies behind the eye.
    """
    angles, bounds = directions(azimuth), edges()
    middle = (bounds[:-1] + bounds[1:]) / 2.0
    ahead = np.abs((angles - azimuth + np.pi) % (2.0 * np.pi) - np.pi) <= SIDE + 1e-9
    ways = np.stack([np.cos(angles[ahead]), np.sin(angles[ahead])], axis=1)
    flat = ways[:, None, :] * middle[:, None]
    rise = np.full((*flat.shape[:2], 1), ground + HEIGHT - eye[2])
    rays = np.concatenate([flat, rise], axis=2).reshape(-1, 3)
    unseen = np.ones((DIRECTIONS, RINGS), dtype=bool)
    unseen[ahead] = blocked(eye, rays, boxes).reshape(-1, RINGS)
    return unseen


def blocked(eye: Array, rays: Array, boxes: Boxes) -> BoolArray:
    """(k,) whether a box lies between the eye and eye + ray. rays: (k, 3)."""
    if not len(boxes):
        return np.zeros(len(rays), dtype=bool)
    local = np.einsum("nij,ni->nj", boxes.rotations, eye - boxes.centers)
    outside = (np.abs(local) > boxes.half_extents + AROUND).any(axis=1)
    local, half = local[outside], boxes.half_extents[outside]
    along = rays @ boxes.rotations[outside]  # (n, k, 3) in the boxes' axes
    inverse = 1.0 / np.where(along == 0.0, 1e-12, along)
    middle, apart = -local[:, None] * inverse, half[:, None] * np.abs(inverse)
    enter = (middle - apart).max(axis=2)
    leave = (middle + apart).min(axis=2)
    return np.asarray(((enter <= leave) & (leave >= 0.0) & (enter <= 1.0)).any(axis=0))


def fan(eye: Array, azimuth: float, unseen: BoolArray) -> Float32:
    """Radial lines (k, 2, 3) at z = 0 over the cells that are not seen. unseen: as `hidden`."""
    angles, bounds = directions(azimuth), edges()
    padded = np.pad(unseen.astype(np.int8), ((0, 0), (1, 1)))
    change = np.diff(padded, axis=1)
    ray, start = np.nonzero(change == 1)
    _, end = np.nonzero(change == -1)
    return _radial(eye, angles[ray], bounds[start], bounds[end])


def frame(eye: Array, azimuth: float, unseen: BoolArray) -> Float32:
    """The edge of the field of view (k, 2, 3) at z = 0: both sides, and the circle where seen."""
    sides = azimuth + np.array([-SIDE, SIDE])
    rays = _radial(eye, sides, np.full(2, NEAR), np.full(2, FAR))
    half = np.pi / DIRECTIONS
    open_ = directions(azimuth)[~unseen[:, -1]]
    ends = np.stack([open_ - half, open_ + half], axis=1)
    arc = np.zeros((len(open_), 2, 3), dtype=np.float32)
    arc[..., 0] = eye[0] + FAR * np.cos(ends)
    arc[..., 1] = eye[1] + FAR * np.sin(ends)
    return np.concatenate([rays, arc])


def _radial(eye: Array, angles: Array, start: Array, end: Array) -> Float32:
    lines = np.zeros((len(angles), 2, 3), dtype=np.float32)
    for k, far in enumerate((start, end)):
        lines[:, k, 0] = eye[0] + far * np.cos(angles)
        lines[:, k, 1] = eye[1] + far * np.sin(angles)
    return lines
