"""What a camera sees of boxes on flat ground, drawn without a graphics card.

A pinhole camera: x to the right, y down, z ahead. Each pixel keeps the largest inverse depth seen
so far, because 1/z of a plane is linear in the image. Faces are drawn if they look at the camera
and are cut off in front of it. The picture is made of indices into one palette, so that colours are
mixed once per face and not once per pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray, Array

NEAR = 0.15  # what is closer is not drawn [m]
FADING = 35.0  # contrast falls to 1/e over this distance [m]
SUN: Array = np.array([0.35, -0.45, 0.82])  # towards the light, site frame
GROUND: AnyArray = np.array([[104, 100, 92], [92, 89, 82]])  # squares of 1 m
SKY: AnyArray = np.array([104, 122, 140])
HAZE: AnyArray = np.array([146, 153, 158])
FARTHEST = 1000.0  # [m]
STEPS = 96  # of fading
_FACES = (
    np.array(  # of a box's corners in the order of CORNER_SIGNS, counter-clockwise from outside
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
)


@dataclass(frozen=True)
class Lens:
    """width, height [pixels]; fov: horizontal angle of view [rad]."""

    width: int = 480
    height: int = 270
    fov: float = math.radians(80.0)

    @property
    def focal(self) -> float:
        """[pixels]"""
        return self.width / 2.0 / math.tan(self.fov / 2.0)

    @cached_property
    def rays(self) -> tuple[AnyArray, AnyArray]:
        """x (1, width) and y (height, 1) of each pixel's centre at depth 1, float32."""
        x = (np.arange(self.width) + 0.5 - self.width / 2.0) / self.focal
        y = (np.arange(self.height) + 0.5 - self.height / 2.0) / self.focal
        return x.astype(np.float32)[None, :], y.astype(np.float32)[:, None]


def looking(position: Array, yaw_axis: Array, up: Array, pitch: float) -> Array:
    """T_site_camera (4, 4). position: (3,); yaw_axis: (3,) where it looks when level, up: (3,)
    perpendicular to it, both unit vectors; pitch: upwards [rad].
    """
    ahead = math.cos(pitch) * yaw_axis + math.sin(pitch) * up
    right = np.cross(yaw_axis, up)
    T = np.eye(4)
    T[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    T[:3, 3] = position
    return T


def draw(lens: Lens, T_site_camera: Array, boxes: Boxes, colors: AnyArray) -> AnyArray:
    """(height, width, 3) uint8. boxes: n, site frame, whose ground is z = 0; colors: (n, 3) RGB."""
    image, inverse = _ground(lens, T_site_camera)
    polygons, planes, shades = _faces(T_site_camera, boxes, colors)
    for k, edges in enumerate(_edges(lens, polygons)):
        if edges is not None:
            _fill(lens, image, inverse, edges, planes[k], len(_PALETTE) + k)
    palette = np.concatenate([_PALETTE, np.clip(shades, 0, 255).astype(np.uint8)])
    return np.asarray(palette.take(image, axis=0))


def _ground(lens: Lens, T: Array) -> tuple[AnyArray, AnyArray]:
    """Palette indices (int16) and inverse depths (float32) of ground and sky, (height, width)."""
    x, y = lens.rays
    R, eye = T[:3, :3].astype(np.float32), T[:3, 3]
    down = -(R[2, 0] * x + (R[2, 1] * y + R[2, 2]))
    inverse = np.maximum(down, 0.0) / np.float32(max(eye[2], 0.05))
    depth = 1.0 / np.maximum(inverse, np.float32(1.0 / FARTHEST))
    # Whole squares are taken off in double precision: sites can be far from their origin. An even
    # number of them is added, so that cutting off the decimals rounds down.
    start = (eye[:2] % 2.0 + 2.0 * math.ceil(2.0 * FARTHEST)).astype(np.float32)
    east = depth * (R[0, 0] * x + (R[0, 1] * y + R[0, 2])) + start[0]
    north = depth * (R[1, 0] * x + (R[1, 1] * y + R[1, 2])) + start[1]
    odd = (east.astype(np.int16) ^ north.astype(np.int16)) & 1
    depth *= np.float32(STEPS / (3.0 * FADING))
    image = 2 * np.minimum(depth, STEPS - 1, out=depth).astype(np.int16) + odd
    rows = (down <= 0.0).any(axis=1)
    above = down[rows]
    sky = 2 * STEPS + np.clip(-3.0 * STEPS * above, 0, STEPS - 1).astype(np.int16)
    image[rows] = np.where(above <= 0.0, sky, image[rows])
    return image, inverse


def _faces(T: Array, boxes: Boxes, colors: AnyArray) -> tuple[Array, Array, AnyArray]:
    """Of the n faces that can be seen: polygons (n, 5, 3) in the camera frame, cut at NEAR; planes
    (n, 3), 1/z = plane . (x, y, 1) at depth 1; colours (n, 3) with light and haze.
    """
    R, eye = T[:3, :3], T[:3, 3]
    quads = ((boxes.corners() - eye) @ R)[:, _FACES].reshape(-1, 4, 3)
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 2] - quads[:, 0])
    offsets = (normals * quads[:, 0]).sum(axis=1)
    seen = (offsets < -1e-9) & (quads[..., 2].max(axis=1) > NEAR)
    colors = np.repeat(np.asarray(colors, dtype=float), 6, axis=0)[seen]
    quads, normals, offsets = quads[seen], normals[seen], offsets[seen, None]
    towards = SUN / np.linalg.norm(SUN)
    light = np.maximum(normals @ (R.T @ towards), 0.0) / np.linalg.norm(normals, axis=1)
    fade = np.exp(-np.linalg.norm(quads.mean(axis=1), axis=1) / FADING)[:, None]
    shades = HAZE + ((0.45 + 0.6 * light)[:, None] * colors - HAZE) * fade
    polygons = quads[:, [0, 1, 2, 3, 3]]  # the last corner twice: no edge
    for k in np.flatnonzero(quads[..., 2].min(axis=1) < NEAR):
        polygons[k] = _cut(quads[k])
    return polygons, normals / offsets, shades


def _cut(quad: Array) -> Array:
    """(5, 3): the part of a quadrangle (4, 3) with z of NEAR or more, which has three to five
    corners (Sutherland and Hodgman 1974); the last one is repeated.
    """
    kept = []
    for a, b in zip(quad, quad[[1, 2, 3, 0]], strict=True):
        if a[2] >= NEAR:
            kept.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            kept.append(a + (b - a) * (NEAR - a[2]) / (b[2] - a[2]))
    return np.array(kept + kept[-1:] * (5 - len(kept)))


def _edges(lens: Lens, polygons: Array) -> list[tuple[int, int, Array, Array] | None]:
    """Per polygon (n, 5, 3) its first row and the one after its last, and of each row the columns
    (rows,) where it begins and ends; None outside of the image.
    """
    u, v = (
        polygons[..., k] * lens.focal / polygons[..., 2] + size / 2.0
        for k, size in ((0, lens.width), (1, lens.height))
    )
    tops = np.maximum(np.ceil(v.min(axis=1) - 0.5), 0).astype(int).tolist()
    bottoms = np.minimum(np.ceil(v.max(axis=1) - 0.5), lens.height).astype(int).tolist()
    beside = ((u.max(axis=1) < 0.5) | (u.min(axis=1) > lens.width - 0.5)).tolist()
    after = [1, 2, 3, 4, 0]
    du, dv = u[:, after] - u, v[:, after] - v
    # Counter-clockwise in space is so in the image: the edges that go up are on the right.
    down, up = dv > 1e-9, dv < -1e-9
    slope = du / np.where(down | up, dv, 1.0)
    start = u - v * slope
    found: list[tuple[int, int, Array, Array] | None] = []
    for k, (top, bottom) in enumerate(zip(tops, bottoms, strict=True)):
        if top >= bottom or beside[k]:
            found.append(None)
            continue
        edges = start[k] + np.arange(top + 0.5, bottom)[:, None] * slope[k]
        low = edges[:, down[k]].max(axis=1)
        found.append((top, bottom, low, edges[:, up[k]].min(axis=1)))
    return found


def _fill(
    lens: Lens,
    image: AnyArray,
    inverse: AnyArray,
    edges: tuple[int, int, Array, Array],
    plane: Array,
    index: int,
) -> None:
    """Writes `index` where the polygon is the nearest so far. edges: as of `_edges`; plane: as of
    `_faces`."""
    top, bottom, low, high = edges
    left = max(math.ceil(low.min() - 0.5), 0)
    right = min(math.ceil(high.max() - 0.5), lens.width)
    if left >= right:
        return
    x, y = lens.rays
    a, b, c = plane.astype(np.float32)
    depth = a * x[:, left:right] + (b * y[top:bottom] + c)
    place = inverse[top:bottom, left:right]
    xs = np.arange(left + 0.5, right)
    nearest = (xs >= low[:, None]) & (xs < high[:, None]) & (depth > place)
    np.copyto(place, depth, where=nearest)
    np.copyto(image[top:bottom, left:right], index, where=nearest)


def _palette() -> AnyArray:
    """(3 STEPS, 3) uint8: ground of both kinds from near to far, then sky from low to high."""
    depth = (np.arange(STEPS) + 0.5) * 3.0 * FADING / STEPS
    fade = np.exp(-depth / FADING)[:, None, None]
    ground = HAZE + (GROUND - HAZE) * fade
    sky = HAZE + (SKY - HAZE) * np.linspace(0.0, 1.0, STEPS)[:, None]
    return np.concatenate([ground.reshape(-1, 3), sky]).astype(np.uint8)


_PALETTE = _palette()
