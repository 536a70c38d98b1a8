"""The working gauge as JSON, for plans and 3D scenes."""

from __future__ import annotations

from typing import Any

from shapely.geometry import Polygon

from backend.gauge.volumes import LimitVolume
from backend.site.named_bodies import SiteBodies


def volumes_document(site: SiteBodies) -> list[dict[str, Any]]:
    """One entry a limit volume; site frame in metres."""
    return [_volume(volume, site.idle.get(volume.name, "")) for volume in site.volumes]


def _volume(volume: LimitVolume, idle: str) -> dict[str, Any]:
    """idle: why the volume holds for nobody, empty where it holds; plan: polygons; hulls: the
    pieces where these are no boxes, else the boxes are."""
    boxes = volume.boxes
    return {
        "name": volume.name,
        "kind": volume.kind,
        "state": volume.state,
        "rule": volume.rule,
        "idle": idle,
        "plan": [polygon_document(polygon) for polygon in volume.plan],
        "boxes": [
            {
                "center": boxes.centers[k].tolist(),
                "rotation": boxes.rotations[k].tolist(),
                "half_extents": boxes.half_extents[k].tolist(),
            }
            for k in range(len(boxes))
        ],
        "hulls": [
            {"vertices": hull.vertices.tolist(), "faces": [list(face) for face in hull.faces]}
            for hull in volume.hulls
        ],
    }


def polygon_document(polygon: Polygon) -> dict[str, Any]:
    """Outline and holes."""
    return {
        "exterior": [[x, y] for x, y in polygon.exterior.coords],
        "holes": [[[x, y] for x, y in ring.coords] for ring in polygon.interiors],
    }
