"""What stands on a site, as named boxes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backend.errors import InputError
from backend.machine.bodies import Progress, fitted
from backend.machine.meshes import mesh_triangles
from backend.site.site import Site
from backend.site.tables import ObstacleMesh
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.rotation import rz
from backend.spatial.transform import make
from backend.spatial.types import Array


@dataclass(frozen=True)
class SiteBodies:
    """Boxes that do not move, in the site frame, and their names ("wall", "hall/0", "hall/1")."""

    boxes: Boxes = NO_BOXES
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if len(self.names) != len(self.boxes):
            raise ValueError(f"{len(self.boxes)} boxes have {len(self.names)} names")

    @cached_property
    def radii(self) -> Array:
        """(n,) of the spheres around the boxes [m]."""
        return np.asarray(np.linalg.norm(self.boxes.half_extents, axis=1))

    @cached_property
    def full_names(self) -> tuple[str, ...]:
        """ "site:wall", "site:hall/0"."""
        return tuple(f"site:{name}" for name in self.names)


NO_SITE_BODIES = SiteBodies()


def site_bodies(site: Site, progress: Progress | None = None) -> SiteBodies:
    """Obstacles as they are, meshes in the boxes that are fitted to them (once, then remembered).

    Raises InputError for a mesh that cannot be read.
    """
    boxes = [site.obstacle_boxes()]
    names = [obstacle.name for obstacle in site.obstacles]
    for mesh in site.meshes:
        parts = _boxes_of(mesh, site, progress)
        boxes.append(parts)
        names += [f"{mesh.name}/{k}" for k in range(len(parts))]
    return SiteBodies(concatenated(boxes), tuple(names))


def _boxes_of(mesh: ObstacleMesh, site: Site, progress: Progress | None) -> Boxes:
    path = site.folder / mesh.file
    where = f"{site.path}: obstacle_mesh {mesh.name}"
    if not path.is_file():
        raise InputError(f"{where}: file {path} does not exist; allowed is a mesh file.")
    triangles = mesh_triangles(path, where) * mesh.scale
    boxes = fitted(triangles, mesh.max_boxes, mesh.max_excess, mesh.name, progress)
    at = site.frame.from_projected(np.array([mesh.position]))[0]
    return boxes.moved(make(rz(math.radians(mesh.yaw_deg)), at))
