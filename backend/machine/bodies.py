"""Convex bodies of a machine: oriented boxes per link, and which pairs are self-collision."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np

from backend.errors import InputError
from backend.machine.meshes import triangles_of
from backend.machine.model import PARTS
from backend.machine.sidecar import BodiesTable
from backend.machine.stated import checked
from backend.machine.urdf import Geometry, UrdfLink
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

Progress: TypeAlias = Callable[[str, float], None]
"""Called with what is being done and the share of it that is done, 0..1."""

_MARKER = 0.02  # [m] visuals up to this size mark a frame, they are no bodies


def link_boxes(
    link: UrdfLink,
    swept: Array,
    robot_file: Path,
    stated: BodiesTable,
    side_file: str,
    progress: Progress | None,
) -> Boxes:
    """The bodies of one link in its frame.

    Collision boxes are taken as they are, cylinders and spheres as their bounding boxes; meshes,
    and `swept` triangles (n, 3, 3) of hydraulic cylinders, are fitted, unless the sidecar states
    their boxes. A link without collision geometry uses its visuals. Raises InputError for stated
    boxes that do not contain all of it.
    """
    parts = [box_of(s) for s in _shapes(link) if s.kind != "mesh"]
    triangles = to_be_fitted(link, swept, robot_file)
    if link.name in stated.boxes:
        tables = stated.boxes[link.name]
        parts.append(checked(tables, triangles, link.name, side_file, str(robot_file)))
    elif len(triangles):
        free = free_boxes(link, stated)
        parts.append(fitted(triangles, free, stated.max_excess, link.name, progress))
    return join(parts)


def to_be_fitted(link: UrdfLink, swept: Array, robot_file: Path) -> Array:
    """The triangles (n, 3, 3) [m] of a link that boxes have to contain, in its frame."""
    meshes = [s for s in _shapes(link) if s.kind == "mesh"]
    folder, file = robot_file.parent, str(robot_file)
    return np.concatenate([*(triangles_of(m, folder, file) for m in meshes), swept])


def free_boxes(link: UrdfLink, stated: BodiesTable) -> int:
    """How many boxes the fit of a link may use: those its primitives leave, two at least."""
    return max(stated.max_boxes - sum(s.kind != "mesh" for s in _shapes(link)), 2)


def box_of(shape: Geometry) -> Boxes:
    """The oriented bounding box of a primitive, in the link frame."""
    if shape.kind == "box":
        half = np.array(shape.size) / 2.0
    elif shape.kind == "cylinder":
        radius, length = shape.size
        half = np.array([radius, radius, length / 2.0])
    else:
        half = np.full(3, shape.size[0])
    T = shape.T_link_geometry
    return Boxes(T[None, :3, 3], T[None, :3, :3], half[None])


def join(parts: list[Boxes]) -> Boxes:
    """The boxes of all parts, in order; they must share a frame (or be told apart by index)."""
    if not parts:
        return Boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))
    return Boxes(
        np.concatenate([p.centers for p in parts]),
        np.concatenate([p.rotations for p in parts]),
        np.concatenate([p.half_extents for p in parts]),
    )


def _shapes(link: UrdfLink) -> tuple[Geometry, ...]:
    return link.collisions or tuple(v for v in link.visuals if not _is_marker(v))


def _is_marker(shape: Geometry) -> bool:
    return shape.kind != "mesh" and max(shape.size) <= _MARKER


def fitted(
    triangles: Array, max_boxes: int, max_excess: float, name: str, progress: Progress | None
) -> Boxes:
    """`fit_boxes`, remembered on disk: fitting takes seconds, its input hardly ever changes."""
    path = _cache_folder() / f"boxes-{_key(triangles, max_boxes, max_excess)}.npz"
    known = _read(path)
    if known is not None:
        return known
    from backend.machine import fitting  # compiled code and scipy, which few starts need

    report = None if progress is None else (lambda share: progress(f"fitting boxes: {name}", share))
    boxes = fitting.fit_boxes(triangles, max_boxes, max_excess, report)
    _write(path, boxes)
    return boxes


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "excavator-cockpit"


def _key(triangles: Array, max_boxes: int, max_excess: float) -> str:
    digest = hashlib.sha256(np.ascontiguousarray(triangles).tobytes())
    digest.update(f"{max_boxes} {max_excess!r}".encode())
    for source in sorted(Path(__file__).parent.glob("fitting*.py")):
        digest.update(source.read_bytes())  # another algorithm gives other boxes
    return digest.hexdigest()[:32]


def _read(path: Path) -> Boxes | None:
    try:
        with np.load(path, allow_pickle=False) as data:
            boxes = Boxes(data["centers"], data["rotations"], data["half_extents"])
    # A damaged cache file may fail anywhere in zip and npy reading; the boxes are fitted anew.
    except Exception:
        return None
    turned = boxes.rotations @ np.swapaxes(boxes.rotations, 1, 2)
    return boxes if len(boxes) and np.allclose(turned, np.eye(3), atol=1e-9) else None


def _write(path: Path, boxes: Boxes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.part.npz")
        np.savez(
            part,
            centers=boxes.centers,
            rotations=boxes.rotations,
            half_extents=boxes.half_extents,
        )
        part.replace(path)
    except OSError:
        return  # without a cache the next start fits again


def overlaps(a: Boxes, b: Boxes) -> Array:
    """(len(a), len(b)) True where boxes touch: separating axes, both sets in one frame."""
    out = np.zeros((len(a), len(b)), dtype=bool)
    for i in range(len(a)):
        for j in range(len(b)):
            out[i, j] = _touch(a, i, b, j)
    return out


def _touch(a: Boxes, i: int, b: Boxes, j: int) -> bool:
    A, B = a.rotations[i], b.rotations[j]
    d = b.centers[j] - a.centers[i]
    edges = np.cross(A.T[:, None, :], B.T[None, :, :]).reshape(9, 3)
    axes = np.concatenate([A.T, B.T, edges])
    axes = axes[np.linalg.norm(axes, axis=1) > 1e-9]
    reach = np.abs(axes @ A) @ a.half_extents[i] + np.abs(axes @ B) @ b.half_extents[j]
    return bool((np.abs(axes @ d) <= reach).all())


def self_pairs(
    names: tuple[str, ...],
    parts: tuple[str, ...],
    exclude: tuple[tuple[str, str], ...],
    resting: list[Boxes],
    file: str,
) -> tuple[tuple[tuple[int, int], ...], tuple[tuple[int, int], ...]]:
    """(pairs that count as self-collision, pairs left out because they touch at rest).

    Pairs count when their parts are not the same and not neighbours along the chain, unless
    `exclude` names them (bodies or parts, either order) or they touch in a resting posture.
    resting: the machine's boxes in each such posture, in one frame. Raises InputError for names in
    `exclude` that are neither a body nor a part.
    """
    known = {*names, *parts}
    for pair in exclude:
        for name in pair:
            if name not in known:
                raise InputError(
                    f"{file}: field 'self_collision.exclude' names '{name}'; allowed are bodies "
                    f"{', '.join(names)} and parts {', '.join(dict.fromkeys(parts))}."
                )
    left_out = {frozenset(pair) for pair in exclude}
    counted: list[tuple[int, int]] = []
    touching: list[tuple[int, int]] = []
    for i in range(len(names)):
        for j in range(i + 1, len(names)):
            if abs(PARTS.index(parts[i]) - PARTS.index(parts[j])) < 2:
                continue
            labels = [(x, y) for x in (names[i], parts[i]) for y in (names[j], parts[j])]
            if any(frozenset(pair) in left_out for pair in labels):
                continue
            if any(_touch(boxes, i, boxes, j) for boxes in resting):
                touching.append((i, j))
            else:
                counted.append((i, j))
    return tuple(counted), tuple(touching)
