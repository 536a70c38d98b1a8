"""What stands on a site, and what its working gauge keeps machines from, as named boxes."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from backend.errors import InputError
from backend.gauge.choose import why_idle
from backend.gauge.features import Feature
from backend.gauge.volumes import LimitVolume
from backend.machine.bodies import Progress, fitted
from backend.machine.meshes import mesh_triangles
from backend.site.gauge import site_options, site_volumes
from backend.site.gauge_sources import source_features
from backend.site.site import Site
from backend.site.tables import ObstacleMesh
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.rotation import rz
from backend.spatial.transform import make
from backend.spatial.types import Array


@dataclass(frozen=True)
class SiteBodies:
    """Boxes that do not move, in the site frame, and their names ("wall", "hall/0", "hall/1").

    After the obstacles come the boxes of the working gauge ("gauge:T1/0"), of all volumes but the
    idle ones. volumes: of the working gauge; idle: by name of a volume, why it holds for nobody.
    """

    boxes: Boxes = NO_BOXES
    names: tuple[str, ...] = ()
    volumes: tuple[LimitVolume, ...] = ()
    idle: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.names) != len(self.boxes):
            raise ValueError(f"{len(self.boxes)} boxes have {len(self.names)} names")

    @cached_property
    def radii(self) -> Array:
        """(n,) of the spheres around the boxes [m]."""
        return np.asarray(np.linalg.norm(self.boxes.half_extents, axis=1))

    @cached_property
    def full_names(self) -> tuple[str, ...]:
        """ "site:wall", "site:hall/0", "gauge:T1/0"."""
        return tuple(name if _of_gauge(name) else f"site:{name}" for name in self.names)

    def without(self, names: Collection[str]) -> SiteBodies:
        """Without the boxes of these limit volumes, such as of the track that a machine stands on;
        itself when it has none of them.
        """
        dropped = {
            box for volume in self.volumes if volume.name in names for box in volume.box_names
        }
        kept = np.array([name not in dropped for name in self.names], dtype=bool)
        if kept.all():
            return self
        names_kept = tuple(name for name in self.names if name not in dropped)
        return SiteBodies(self.boxes.take(kept), names_kept, self.volumes, self.idle)

    @cached_property
    def standing(self) -> SiteBodies:
        """Without the working gauge: what can be seen and touched."""
        kept = np.array([not _of_gauge(name) for name in self.names], dtype=bool)
        names = tuple(name for name in self.names if not _of_gauge(name))
        return SiteBodies(self.boxes.take(kept), names)


NO_SITE_BODIES = SiteBodies()


def site_bodies(
    site: Site, progress: Progress | None = None, features: Iterable[Feature] = ()
) -> SiteBodies:
    """Obstacles as they are, meshes in the boxes that are fitted to them (once, then remembered),
    and the limit volumes of the site's tables, its files and other `features` in the site frame.

    Raises InputError for a mesh or file that cannot be read, or a feature that makes no volume.
    """
    boxes = [site.obstacle_boxes()]
    names = [obstacle.name for obstacle in site.obstacles]
    for mesh in site.meshes:
        parts = _boxes_of(mesh, site, progress)
        boxes.append(parts)
        names += [f"{mesh.name}/{k}" for k in range(len(parts))]
    volumes = site_volumes(site, (*source_features(site), *features))
    options = site_options(site)
    idle = {v.name: why for v in volumes if (why := why_idle(v, options))}
    for volume in volumes:
        if volume.name not in idle:
            boxes.append(volume.boxes)
            names += volume.box_names
    return SiteBodies(concatenated(boxes), tuple(names), volumes, idle)


def _of_gauge(name: str) -> bool:
    return name.startswith("gauge:")


def _boxes_of(mesh: ObstacleMesh, site: Site, progress: Progress | None) -> Boxes:
    path = site.folder / mesh.file
    where = f"{site.path}: obstacle_mesh {mesh.name}"
    if not path.is_file():
        raise InputError(f"{where}: file {path} does not exist; allowed is a mesh file.")
    triangles = mesh_triangles(path, where) * mesh.scale
    boxes = fitted(triangles, mesh.max_boxes, mesh.max_excess, mesh.name, progress)
    at = site.frame.from_projected(np.array([mesh.position]))[0]
    return boxes.moved(make(rz(math.radians(mesh.yaw_deg)), at))
