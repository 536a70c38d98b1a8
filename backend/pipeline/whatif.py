"""What if a machine stood in another posture? python-fcl's verdict, independent of the images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.collision.verdict import verdict
from backend.cspace.exact_points import touching
from backend.machine.kinematics import body_boxes, link_poses
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import surroundings_of, why_unknown
from backend.spatial.types import Array

SELF = "self"


@dataclass(frozen=True)
class Touch:
    """own: body of the machine, "bucket/0"; other: "right:boom/1", "site:wall", "left:tracks/0"."""

    own: str
    other: str
    layer: str


@dataclass(frozen=True)
class WhatIf:
    """verdict: FREE, COLLIDING, or UNKNOWN with the reason; bodies as built. distance: to the
    closest obstacle or own body that counts, 0 on contact, NaN when unknown [m].
    """

    machine: str
    state_time: float
    verdict: str
    reason: str
    distance: float
    closest: Touch | None
    hits: tuple[Touch, ...]


def touches(snapshot: Snapshot, config: Config, own: str, q: Array) -> bool | None:
    """A quick look at the same: whether anything touches; None when that is not known."""
    if why_unknown(own, snapshot.machines, snapshot.pairs):
        return None
    around = surroundings_of(own, snapshot.machines, config, snapshot.gauge, snapshot.people)
    against, itself = touching(config.machines[own], np.asarray(q, float)[None], around.boxes)
    return bool(against[0] or itself[0])


def what_if(snapshot: Snapshot, config: Config, own: str, q: Array) -> WhatIf:
    """The machine `own` at joint values q (n,) [rad] on its present base."""
    reason = why_unknown(own, snapshot.machines, snapshot.pairs)
    if reason:
        return WhatIf(own, snapshot.state_time, "UNKNOWN", reason, float("nan"), None, ())
    machine = config.machines[own]
    around = surroundings_of(own, snapshot.machines, config, snapshot.gauge, snapshot.people)
    bodies = body_boxes(machine, link_poses(machine, np.asarray(q, dtype=float)))
    against = verdict(bodies, around.boxes)
    itself = verdict(bodies, bodies, np.array(machine.self_pairs, np.int64).reshape(-1, 2))

    def other(i: int, j: int) -> Touch:
        return Touch(machine.body_names[i], around.names[j], around.layer_of(j))

    def own_body(i: int, j: int) -> Touch:
        return Touch(machine.body_names[j], f"{own}:{machine.body_names[i]}", SELF)

    hits = [other(i, j) for i, j in against.touching] + [own_body(i, j) for i, j in itself.touching]
    nearest = None
    if against.closest is not None and against.distance <= itself.distance:
        nearest = other(*against.closest)
    elif itself.closest is not None:
        nearest = own_body(*itself.closest)
    return WhatIf(
        machine=own,
        state_time=snapshot.state_time,
        verdict="COLLIDING" if hits else "FREE",
        reason="",
        distance=min(against.distance, itself.distance),
        closest=nearest,
        hits=tuple(hits),
    )
