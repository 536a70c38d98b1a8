"""Geometries as triangles in the link frame, and coloured visuals.

A mesh file's coordinates are taken as they stand after its own nodes, scaled by its unit, and not
turned for COLLADA's up_axis: RViz shows URDF meshes so, and descriptions are made to look right
there.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from backend.errors import InputError
from backend.machine.expand import find_mesh
from backend.machine.model import Visual
from backend.machine.primitives import box, cylinder
from backend.machine.urdf import Color, Geometry
from backend.spatial import transform
from backend.spatial.types import AnyArray, Array

Surface: TypeAlias = tuple[Array, AnyArray, Color | None]
GREY: Color = (150, 150, 145)
_COLORS = 6  # a mesh is drawn in at most so many colours
_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']+)[\"']")


def visuals_of(geometry: Geometry, folder: Path, file: str) -> tuple[Visual, ...]:
    """The geometry as coloured meshes in the link frame; one per submesh and colour."""
    T = geometry.T_link_geometry
    visuals = []
    for vertices, faces, own in _surfaces(geometry, folder, file):
        color = geometry.color or own or GREY
        visuals.append(Visual(transform.apply(T, vertices), faces, color))
    return tuple(visuals)


def triangles_of(geometry: Geometry, folder: Path, file: str) -> Array:
    """The geometry's triangles (n, 3, 3) [m] in the link frame."""
    parts = [v.vertices[v.faces] for v in visuals_of(geometry, folder, file)]
    return np.concatenate(parts) if parts else np.zeros((0, 3, 3))


def mesh_triangles(path: Path, file: str = "") -> Array:
    """All triangles (n, 3, 3) [m] of a mesh file, in the file's frame.

    file: what names the mesh, for messages. Raises InputError.
    """
    surfaces = _load(path, file or str(path))
    return np.concatenate([vertices[faces] for vertices, faces, _ in surfaces])


def _surfaces(geometry: Geometry, folder: Path, file: str) -> list[Surface]:
    if geometry.kind == "mesh":
        loaded = _load(find_mesh(geometry.filename, folder, file), file)
        scale = np.array(geometry.size)
        flip = -1 if np.prod(scale) < 0 else 1  # a mirrored mesh keeps its faces outward
        return [(vertices * scale, faces[:, ::flip], color) for vertices, faces, color in loaded]
    if geometry.kind == "box":
        vertices, faces = box(*geometry.size)
    elif geometry.kind == "cylinder":
        vertices, faces = cylinder(*geometry.size)
    else:
        import trimesh

        solid = trimesh.creation.icosphere(subdivisions=2, radius=geometry.size[0])
        vertices, faces = np.array(solid.vertices, dtype=float), np.array(solid.faces)
    return [(vertices, faces, None)]


def _load(path: Path, file: str) -> list[Surface]:
    state = path.stat()
    return list(_load_version(path, state.st_mtime_ns, state.st_size, file))


@lru_cache(maxsize=64)
def _load_version(path: Path, _modified: int, _size: int, file: str) -> tuple[Surface, ...]:
    import trimesh  # takes a second, and most machines are made of primitives

    try:
        scene = trimesh.load_scene(str(path))
        meshes = [m for m in scene.dump(concatenate=False) if isinstance(m, trimesh.Trimesh)]
    # The readers behind trimesh raise whatever their formats' parsers raise.
    except Exception as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{file}: mesh {path} cannot be read: {words}.") from None
    surfaces: list[Surface] = []
    scale = _unit(path)
    for mesh in meshes:
        vertices = np.array(mesh.vertices, dtype=float) * scale
        faces = np.array(mesh.faces, dtype=np.int64)
        if len(faces) and np.isfinite(vertices).all():
            surfaces.extend(_by_color(vertices, faces, _face_colors(mesh)))
    if not surfaces:
        raise InputError(f"{file}: mesh {path} holds no triangles.")
    return tuple(surfaces)


def _unit(path: Path) -> float:
    if path.suffix.lower() != ".dae":
        return 1.0
    found = _UNIT.search(path.read_bytes()[:20_000])
    return float(found.group(1)) if found else 1.0


def _face_colors(mesh: Any) -> AnyArray | None:
    """(faces, 3) 0..255, or None when the mesh has none; a texture is read at faces' middles."""
    visual = mesh.visual
    if not visual.defined:
        return None
    if visual.kind != "texture":
        return np.asarray(visual.face_colors)[:, :3].astype(int)
    material = visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if image is None or visual.uv is None:
        return np.tile(np.asarray(material.main_color)[:3].astype(int), (len(mesh.faces), 1))
    pixels = np.asarray(image.convert("RGB"))
    uv = np.asarray(visual.uv)[np.asarray(mesh.faces)].mean(axis=1) % 1.0
    height, width = pixels.shape[:2]
    columns = np.minimum((uv[:, 0] * width).astype(int), width - 1)
    rows = np.minimum(((1.0 - uv[:, 1]) * height).astype(int), height - 1)
    return np.asarray(pixels[rows, columns], dtype=int)


def _by_color(vertices: Array, faces: AnyArray, colors: AnyArray | None) -> list[Surface]:
    """The mesh split into a few colours; each piece keeps only its own vertices."""
    if colors is None:
        return [(vertices, faces, None)]
    keys, group, counts = np.unique(colors // 48, axis=0, return_inverse=True, return_counts=True)
    group = group.reshape(-1)
    keep = np.argsort(-counts)[:_COLORS]
    nearest = np.argmin(np.abs(keys[:, None] - keys[keep][None]).sum(axis=-1), axis=1)
    group = nearest[group]
    surfaces: list[Surface] = []
    for k in np.unique(group):
        chosen = group == k
        r, g, b = (int(c) for c in np.median(colors[chosen], axis=0))
        used, renumbered = np.unique(faces[chosen], return_inverse=True)
        surfaces.append((vertices[used], renumbered.reshape(-1, 3), (r, g, b)))
    return surfaces
