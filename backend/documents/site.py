"""A site and its machines as JSON, sent to a page once."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.site.site import Site
from backend.site.tables import SiteMachine

if TYPE_CHECKING:
    from backend.site.named_bodies import SiteBodies


def site_document(site: Site, config: Config) -> dict[str, Any]:
    """What does not change during a run. Site frame in metres, radians."""
    standing = config.site.standing
    boxes = standing.boxes
    return {
        "name": site.name,
        "title": site.title,
        "mode": config.mode,
        "frame": {"epsg": site.frame.epsg, "origin": list(site.frame.origin)},
        "own": list(config.own),
        "safety": {
            "slow_below": config.limits.slow_below,
            "stop_below": config.limits.stop_below,
            "eta": config.eta,
        },
        "sun": {"m": site.sun.m, "n": site.sun.n, "eta": site.sun.eta},
        "machines": {
            name: {
                **machine_description(machine, config.labels[name]),
                "cameras": [] if config.mode == "PLAYBACK" else cameras(site.machine(name)),
            }
            for name, machine in config.machines.items()
        },
        "obstacles": [
            {
                "name": name,
                "center": boxes.centers[k].tolist(),
                "rotation": boxes.rotations[k].tolist(),
                "half_extents": boxes.half_extents[k].tolist(),
            }
            for k, name in enumerate(standing.names)
        ],
        "gauge": _gauge(config.site),
    }


def _gauge(site: SiteBodies) -> list[dict[str, Any]]:
    if not site.volumes:
        return []
    from backend.documents.limit_volumes import volumes_document  # shapely, for who has a gauge

    return volumes_document(site)


def cameras(machine: SiteMachine) -> list[dict[str, Any]]:
    """What a page may know of a machine's cameras: addresses only where it goes there itself."""
    return [
        {
            "kind": camera.kind,
            "label": camera.label,
            "url": camera.url if camera.kind == "whep" else None,
        }
        for camera in machine.camera
    ]


def machine_description(machine: Machine, label: str) -> dict[str, Any]:
    """One machine's description; limits of continuous joints are null."""
    return {
        "label": label,
        "model": machine.name,
        "title": machine.title,
        "joints": [
            {
                "role": joint.role,
                "name": joint.name,
                "lower": joint.lower if math.isfinite(joint.lower) else None,
                "upper": joint.upper if math.isfinite(joint.upper) else None,
                "continuous": joint.continuous,
                "max_velocity": joint.max_velocity,
                "max_acceleration": joint.max_acceleration,
            }
            for joint in machine.joints
        ],
        "max_reach": machine.max_reach,
        "lengths": list(machine.sun.lengths),
        "sun": {"signs": list(machine.sun.signs), "offsets": list(machine.sun.offsets)},
        "tracks": {
            "length": machine.tracks.length,
            "gauge": machine.tracks.gauge,
            "shoe": machine.tracks.shoe,
        },
        "bodies": len(machine.bodies),
        "masses_trusted": machine.masses_trusted,
        "assumptions": list(machine.assumptions),
    }
