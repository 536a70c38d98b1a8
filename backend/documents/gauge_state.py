"""The working gauge as it is now, for /api/gauge."""

from __future__ import annotations

from typing import Any

from backend.documents.gauge_choice import document_of
from backend.documents.limit_volumes import polygon_document
from backend.gauge.volumes import LimitVolume
from backend.pipeline.records import GaugeInForce
from backend.site.gauge_in_force import in_force
from backend.site.named_bodies import SiteBodies


def gauge_state(site: SiteBodies, gauge: GaugeInForce, editable: bool) -> dict[str, Any]:
    """A GaugeStateDocument. site: as its file has it."""
    bodies, choice = in_force(site, gauge.choice), gauge.choice
    return {
        "choice": choice.digest,
        "editable": editable,
        "volumes": [_volume_state(volume, bodies, gauge) for volume in bodies.volumes],
        "drawn": [document_of(area).model_dump(mode="json") for area in choice.drawn],
    }


def _volume_state(volume: LimitVolume, bodies: SiteBodies, gauge: GaugeInForce) -> dict[str, Any]:
    why = bodies.idle.get(volume.name, "")
    return {
        "name": volume.name,
        "kind": volume.kind,
        "state": volume.state,
        "rule": volume.rule,
        "drawn": volume.name in gauge.choice.names,
        "in_force": not why,
        "why": why,
        "switched": dict(gauge.choice.switched).get(volume.name),
        "left_out_by": [name for name, on in gauge.own_tracks.items() if volume.name in on],
        "plan": [polygon_document(polygon) for polygon in volume.plan],
    }
