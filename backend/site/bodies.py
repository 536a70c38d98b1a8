"""What stands on a site, and what its working gauge keeps machines from, as named boxes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from backend.errors import InputError
from backend.machine.bodies import Progress, fitted
from backend.machine.meshes import mesh_triangles
from backend.site.named_bodies import SiteBodies
from backend.site.site import Site
from backend.site.tables import ObstacleMesh
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.rotation import rz
from backend.spatial.transform import make

if TYPE_CHECKING:
    from backend.gauge.features import Feature
    from backend.gauge.volumes import LimitVolume


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
    volumes, idle = _gauge(site, tuple(features))
    for volume in volumes:
        if volume.name not in idle:
            boxes.append(volume.boxes)
            names += volume.box_names
    always = frozenset(site.gauge.on)
    return SiteBodies(concatenated(boxes), tuple(names), volumes, idle, always)


def _gauge(
    site: Site, features: tuple[Feature, ...]
) -> tuple[tuple[LimitVolume, ...], Mapping[str, str]]:
    """All limit volumes, and by name why one holds for nobody."""
    if not (features or site.gauge.source or any(site.gauge.names)):
        return (), {}
    # Only a site with a working gauge loads what makes one.
    from backend.gauge.choose import why_idle
    from backend.site.gauge import site_options, site_volumes
    from backend.site.gauge_sources import source_features

    volumes = site_volumes(site, (*source_features(site), *features))
    options = site_options(site)
    return volumes, {v.name: why for v in volumes if (why := why_idle(v, options))}


def _boxes_of(mesh: ObstacleMesh, site: Site, progress: Progress | None) -> Boxes:
    path = site.folder / mesh.file
    where = f"{site.path}: obstacle_mesh {mesh.name}"
    if not path.is_file():
        raise InputError(f"{where}: file {path} does not exist; allowed is a mesh file.")
    triangles = mesh_triangles(path, where) * mesh.scale
    boxes = fitted(triangles, mesh.max_boxes, mesh.max_excess, mesh.name, progress)
    at = site.frame.from_projected(np.array([mesh.position]))[0]
    return boxes.moved(make(rz(math.radians(mesh.yaw_deg)), at))
