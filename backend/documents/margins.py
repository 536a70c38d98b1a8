"""Margins of a state document: how far each joint can move before first contact, or its limit."""

from __future__ import annotations

from typing import Any

from backend.cspace.ground import GROUND, ground_under
from backend.cspace.margins import Margin, margins
from backend.documents.scene import Scene
from backend.spatial.boxes import concatenated


def margins_document(scene: Scene, own: str, ground: bool) -> dict[str, Any]:
    """By joint role: how far each way [rad], and what is met first; bodies as built.

    `certified`: the same for bodies grown by `eta` [m], 3 sigma of the document.
    """
    machine, q, around = scene.machines[own], scene.poses[own].joints, scene.around(own)
    boxes, names = around.boxes, list(around.names)
    if ground:
        boxes, names = concatenated([boxes, ground_under(machine)]), [*names, GROUND]
    eta = scene.eta(own)
    built = margins(machine, q, boxes)
    grown = margins(machine, q, boxes, eta, scene.slack(own))

    def hit(margin: Margin) -> str | None:
        if margin.hit is None:
            return None
        return f"{own}:{machine.body_names[margin.hit]}" if margin.with_self else names[margin.hit]

    return {
        joint.role: {
            "negative": built[2 * k].free,
            "positive": built[2 * k + 1].free,
            "negative_hits": hit(built[2 * k]),
            "positive_hits": hit(built[2 * k + 1]),
            "certified": {
                "eta": eta,
                "negative": grown[2 * k].free,
                "positive": grown[2 * k + 1].free,
                "negative_hits": hit(grown[2 * k]),
                "positive_hits": hit(grown[2 * k + 1]),
            },
        }
        for k, joint in enumerate(machine.joints)
    }
