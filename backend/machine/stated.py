"""Bodies that a sidecar states: taken instead of a fit once they are seen to contain the meshes."""

from __future__ import annotations

import numpy as np

from backend.errors import InputError
from backend.machine.sidecar import BoxTable
from backend.spatial import rotation
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

ROUNDING = 1e-6  # [m] what may be outside: rounding of sums, not of the file's digits
_DIGITS, _DIGITS_DEG = 4, 3  # written: 0.1 mm and 0.001 degrees, 0.05 mm at three metres


def boxes_of(tables: tuple[BoxTable, ...]) -> Boxes:
    """The boxes of a sidecar's table, in the link's frame."""
    roll, pitch, yaw = np.radians([t.rpy_deg for t in tables]).T
    R = rotation.rz(yaw) @ rotation.ry(pitch) @ rotation.rx(roll)
    centers, halves = ([getattr(t, name) for t in tables] for name in ("center", "half_extents"))
    return Boxes(np.array(centers), R, np.array(halves))


def tables_of(boxes: Boxes) -> tuple[BoxTable, ...]:
    """Boxes as a sidecar's table, in as few digits as it is written with.

    The half extents are rounded up, the rest to nearest: what touches a side may come to lie
    outside by 0.2 mm, so they are grown over it afterwards.
    """
    R = boxes.rotations
    rpy = np.degrees(
        [
            np.arctan2(R[:, 2, 1], R[:, 2, 2]),
            np.arcsin(np.clip(-R[:, 2, 0], -1.0, 1.0)),
            np.arctan2(R[:, 1, 0], R[:, 0, 0]),
        ]
    ).T
    up = np.ceil(boxes.half_extents * 10**_DIGITS - 1e-6) / 10**_DIGITS
    rows = zip(boxes.centers.round(_DIGITS), rpy.round(_DIGITS_DEG), up, strict=True)
    return tuple(
        BoxTable(center=tuple(c + 0.0), rpy_deg=tuple(a + 0.0), half_extents=tuple(h))
        for c, a, h in rows
    )


def as_toml(bodies: dict[str, tuple[BoxTable, ...]], notes: dict[str, str] | None = None) -> str:
    """The table `[bodies.boxes]` of a sidecar, one line a box. bodies, notes: by the links' names;
    notes become comments."""
    lines = ["[bodies.boxes]"]
    for link, tables in bodies.items():
        bare = link.replace("_", "").replace("-", "")
        key = link if bare.isascii() and bare.isalnum() else f'"{link}"'
        note = (notes or {}).get(link)
        lines.append(f"{key} = [" + (f"  # {note}" if note else ""))
        for t in tables:
            center, angles, half = (
                ", ".join(f"{v:.{n}f}" for v in values)
                for values, n in (
                    (t.center, _DIGITS),
                    (t.rpy_deg, _DIGITS_DEG),
                    (t.half_extents, _DIGITS),
                )
            )
            lines.append(
                f"  {{ center = [{center}], rpy_deg = [{angles}], half_extents = [{half}] }},"
            )
        lines.append("]")
    return "\n".join(lines) + "\n"


def left_out(boxes: Boxes, triangles: Array) -> tuple[float, Array]:
    """How far triangles (n, 3, 3) reach out of the union of boxes [m], and where most (3,).

    Every triangle is cut at every box, so what lies between corners is seen as well. The distance
    is to the box from which the point sticks out least, across its nearest side. 0 where all is
    inside.
    """
    from backend.machine.fitting_clip import outside_box, subdivided  # compiled code

    rest = triangles
    for R, c, h in zip(boxes.rotations, boxes.centers, boxes.half_extents, strict=True):
        rest = outside_box(rest, R, R.T @ c - h - ROUNDING, R.T @ c + h + ROUNDING)
    if not len(rest):
        return 0.0, np.zeros(3)
    rest = subdivided(rest, 0.02)  # corners of cut pieces lie on boxes: look between them as well
    middles = (rest + np.roll(rest, -1, axis=1)) / 2.0
    points = np.concatenate([rest, middles, rest.mean(axis=1, keepdims=True)], axis=1)
    points = points.reshape(-1, 3)
    least = np.full(len(points), np.inf)
    for R, c, h in zip(boxes.rotations, boxes.centers, boxes.half_extents, strict=True):
        least = np.minimum(least, (np.abs((points - c) @ R) - h).max(axis=1))
    k = int(np.argmax(least))
    return (float(least[k]) if least[k] > 2 * ROUNDING else 0.0), points[k]


def checked(
    tables: tuple[BoxTable, ...], triangles: Array, link: str, side_file: str, model: str
) -> Boxes:
    """The stated boxes of a link, which contain its triangles (n, 3, 3) [m], swept ones as well.

    Raises InputError that says how much is outside, where, and what to do.
    """
    boxes = boxes_of(tables)
    if not len(triangles):
        raise InputError(
            f"{side_file}: bodies.boxes.{link}: the link has no meshes and no cylinders that boxes "
            f"could stand for; remove the entry."
        )
    out, where = left_out(boxes, triangles)
    if out > 0.0:
        x, y, z = where
        raise InputError(
            f"{side_file}: bodies.boxes.{link}: the link's meshes and cylinders reach {out:.4f} m "
            f"out of these {len(boxes)} boxes, at ({x:.3f}, {y:.3f}, {z:.3f}) in the link's frame; "
            f"put what `cockpit fit {model} --link {link}` prints in their place, or remove the "
            f"entry to have them fitted at every first start."
        )
    return boxes
