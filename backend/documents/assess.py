"""One set of machine states, judged once: what `cockpit assess` prints, for checks from outside."""

from __future__ import annotations

from itertools import combinations, permutations
from typing import Any

import numpy as np

from backend.collision.closest import ClosePairs, all_pairs, closest_pairs
from backend.cspace.sun_images import sun_image
from backend.cspace.sun_pose import sun_pose
from backend.documents.driving import driving_document
from backend.documents.margins import margins_document
from backend.documents.scene import make_scene
from backend.documents.stability import assessed_stability
from backend.documents.state import (
    StateDocument,
)
from backend.documents.sun import sun_state_document
from backend.fusion.crs import SiteFrame
from backend.fusion.pose import FusedPose
from backend.machine.model import Machine
from backend.pipeline.images import SunParameters, pair_key
from backend.pipeline.place import base_transform
from backend.pipeline.records import Body3D
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array


def assess(
    state: StateDocument,
    machines: dict[str, Machine],
    frame: SiteFrame | None,
    sun: SunParameters,
    every_pair: bool = False,
    where: str = "state",
    ground: bool = False,
    site: SiteBodies = NO_SITE_BODIES,
) -> dict[str, Any]:
    """Bodies, end-points, closest distances, Sun's sets, zones and margins of one state document.

    machines: the description of every machine of the document; ground: whether it counts as an
    obstacle to margins; site: what stands on the site besides the document's obstacles. Coordinates
    of the result are in the frame of the document's positions [m]; distances are of bodies as
    built. Raises InputError.
    """
    scene = make_scene(state, machines, frame, where, site)
    origin, poses, placed = scene.origin, scene.poses, scene.placed
    return {
        "time": state.time,
        "frame": state.frame,
        "machines": {name: _machine(machines[name], placed[name], origin) for name in placed},
        "closest": _closest(machines, placed, origin, every_pair),
        "obstacles": _obstacles(state, machines, placed, origin),
        "sun": {
            pair_key(own, partner): _sun(machines, poses, own, partner, sun, origin)
            for own, partner in permutations(poses, 2)
        },
        "margins": {name: margins_document(scene, name, ground) for name in placed},
        "stability": {
            name: assessed_stability(
                machines[name], state.machines[name], poses[name], placed[name], f"{where}: {name}"
            )
            for name in placed
        },
        "driving_zone": driving_document(
            machines,
            {name: pose.joints for name, pose in poses.items()},
            {name: base_transform(pose) for name, pose in poses.items()},
            placed,
            origin,
        ),
    }


def _machine(machine: Machine, body: Body3D, origin: Array) -> dict[str, Any]:
    boxes = body.boxes
    return {
        "model": machine.name,
        "bodies": [
            {
                "name": machine.body_names[k],
                "link": machine.part_of_body(k),
                "center": (boxes.centers[k] + origin).tolist(),
                "rotation": boxes.rotations[k].tolist(),
                "half_extents": boxes.half_extents[k].tolist(),
            }
            for k in range(len(boxes))
        ],
        "end_point": (body.end_point + origin).tolist(),
        "swing_center": (body.swing_center + origin).tolist(),
        "azimuth": body.azimuth,
        "reach": body.reach,
        "max_reach": machine.max_reach,
        "self_pairs": [
            [machine.body_names[i], machine.body_names[j]] for i, j in machine.self_pairs
        ],
        "assumptions": list(machine.assumptions),
    }


def _closest(
    machines: dict[str, Machine], placed: dict[str, Body3D], origin: Array, every_pair: bool
) -> list[dict[str, Any]]:
    rows = []
    for a, b in combinations(placed, 2):
        boxes_a, boxes_b = placed[a].boxes, placed[b].boxes
        found = all_pairs(boxes_a, boxes_b) if every_pair else closest_pairs(boxes_a, boxes_b)
        names_a = [f"{a}:{name}" for name in machines[a].body_names]
        names_b = [f"{b}:{name}" for name in machines[b].body_names]
        rows += _rows(found, names_a, names_b, origin, len(found.distance) if every_pair else 1)
    return rows


def _obstacles(
    state: StateDocument, machines: dict[str, Machine], placed: dict[str, Body3D], origin: Array
) -> list[dict[str, Any]]:
    """The closest body of every machine to every obstacle of the document."""
    rows = []
    for obstacle in state.obstacles:
        box = Boxes(
            np.array([obstacle.center]) - origin,
            np.array([obstacle.rotation]),
            np.array([obstacle.half_extents]),
        )
        for name, body in placed.items():
            names = [f"{name}:{part}" for part in machines[name].body_names]
            found = closest_pairs(body.boxes, box)
            rows += _rows(found, names, [f"obstacle:{obstacle.name}"], origin, 1)
    return rows


def _rows(
    found: ClosePairs, names_a: list[str], names_b: list[str], origin: Array, count: int
) -> list[dict[str, Any]]:
    return [
        {
            "a": names_a[found.index[k, 0]],
            "b": names_b[found.index[k, 1]],
            "distance": float(found.distance[k]),
            "points": (found.points[k] + origin).tolist(),
        }
        for k in range(count)
    ]


def _sun(
    machines: dict[str, Machine],
    poses: dict[str, FusedPose],
    own: str,
    partner: str,
    parameters: SunParameters,
    origin: Array,
) -> dict[str, Any]:
    """Sun's sets with partner as the obstacle A and own as B."""
    b, a = sun_pose(machines[own], poses[own]), sun_pose(machines[partner], poses[partner])
    image = sun_image(a, b, machines[own].max_reach, parameters.eta, parameters.m, parameters.n)
    return {
        "eta": image.eta,
        "m": image.m,
        "n": image.n,
        "warning_zone": (image.zone + origin[:2]).tolist(),
        "theta": image.theta.tolist(),
        "d": image.d.tolist(),
        "beta": image.joints.beta.tolist(),
        "boom": image.joints.boom.tolist(),
        "stick": image.joints.stick.tolist(),
        "bucket": image.joints.bucket.tolist(),
        "current": sun_state_document(image.current),
    }
