"""Geometries as triangles in the link frame, and coloured visuals.

A mesh file's coordinates are taken as they stand after its own nodes, scaled by its unit, and not
turned for COLLADA's up_axis: RViz shows URDF meshes so, and descriptions are made to look right
there.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh

from backend.errors import InputError
from backend.machine.expand import find_mesh
from backend.machine.model import Visual
from backend.machine.urdf import Color, Geometry
from backend.spatial import transform
from backend.spatial.types import AnyArray, Array

GREY: Color = (150, 150, 145)
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


def mesh_triangles(path: Path) -> Array:
    """All triangles (n, 3, 3) [m] of a mesh file, in the file's frame."""
    return np.concatenate([vertices[faces] for vertices, faces, _ in _load(path, str(path))])


def _surfaces(
    geometry: Geometry, folder: Path, file: str
) -> list[tuple[Array, AnyArray, Color | None]]:
    if geometry.kind == "mesh":
        loaded = _load(find_mesh(geometry.filename, folder, file), file)
        scale = np.array(geometry.size)
        flip = -1 if np.prod(scale) < 0 else 1  # a mirrored mesh keeps its faces outward
        return [(vertices * scale, faces[:, ::flip], color) for vertices, faces, color in loaded]
    if geometry.kind == "box":
        solid = trimesh.creation.box(extents=geometry.size)
    elif geometry.kind == "cylinder":
        radius, height = geometry.size
        solid = trimesh.creation.cylinder(radius=radius, height=height, sections=24)
    else:
        solid = trimesh.creation.icosphere(subdivisions=2, radius=geometry.size[0])
    return [(np.array(solid.vertices, dtype=float), np.array(solid.faces), None)]


@lru_cache(maxsize=64)
def _load(path: Path, file: str) -> list[tuple[Array, AnyArray, Color | None]]:
    try:
        scene = trimesh.load_scene(str(path))
        meshes = [m for m in scene.dump(concatenate=False) if isinstance(m, trimesh.Trimesh)]
    # The readers behind trimesh raise whatever their formats' parsers raise.
    except Exception as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{file}: mesh {path} cannot be read: {words}.") from None
    surfaces: list[tuple[Array, AnyArray, Color | None]] = []
    scale = _unit(path)
    for mesh in meshes:
        vertices = np.array(mesh.vertices, dtype=float) * scale
        faces = np.array(mesh.faces, dtype=np.int64)
        if len(faces) and np.isfinite(vertices).all():
            surfaces.extend((vertices, part, color) for part, color in _by_color(mesh, faces))
    if not surfaces:
        raise InputError(f"{file}: mesh {path} holds no triangles.")
    return surfaces


def _unit(path: Path) -> float:
    if path.suffix.lower() != ".dae":
        return 1.0
    found = _UNIT.search(path.read_bytes()[:20_000])
    return float(found.group(1)) if found else 1.0


def _by_color(mesh: trimesh.Trimesh, faces: AnyArray) -> list[tuple[AnyArray, Color | None]]:
    """The faces split by colour; textures are sampled, at most a few colours are kept."""
    try:
        visual = mesh.visual.to_color() if mesh.visual.kind == "texture" else mesh.visual
        colors = np.asarray(visual.face_colors)[:, :3]
    # A texture that is missing or unreadable costs the colour, not the machine.
    except Exception:
        return [(faces, None)]
    if len(colors) != len(faces) or not mesh.visual.defined:
        return [(faces, None)]
    coarse = colors.astype(int) // 48
    keys, inverse, counts = np.unique(coarse, axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.reshape(-1)
    if len(keys) > 12:
        keep = np.argsort(-counts)[:12]
        nearest = np.argmin(np.abs(keys[:, None] - keys[keep][None]).sum(axis=-1), axis=1)
        inverse = keep[nearest][inverse]
    parts: list[tuple[AnyArray, Color | None]] = []
    for key in np.unique(inverse):
        chosen = inverse == key
        r, g, b = (int(c) for c in np.median(colors[chosen], axis=0))
        parts.append((faces[chosen], (r, g, b)))
    return parts
