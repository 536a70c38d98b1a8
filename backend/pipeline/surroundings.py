"""What one machine can touch now, in its own root frame, by name and layer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import Body3D, MachineState, PairDistance
from backend.site.bodies import SiteBodies
from backend.spatial import transform
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import BoolArray

PARTNER, SITE = "partner", "site"


@dataclass(frozen=True)
class Surroundings:
    """boxes: in the machine's root frame; names: "right:stick/0", "site:wall"; partner: (n,) the
    box is of another machine, else of the site.
    """

    boxes: Boxes
    names: tuple[str, ...]
    partner: BoolArray

    @property
    def layers(self) -> dict[str, Boxes]:
        """ "partner" and "site"."""
        return {PARTNER: self.boxes.take(self.partner), SITE: self.boxes.take(~self.partner)}


def why_unknown(
    own: str, machines: Mapping[str, MachineState], pairs: Iterable[PairDistance]
) -> str:
    """Why nothing is certain about what `own` can touch; empty when all of it is known."""
    state = machines[own]
    if state.body is None or state.pose.validity is not Validity.VALID:
        return state.pose.reasons[0] if state.pose.reasons else "is unknown"
    return next((pair.reason for pair in pairs if own in (pair.a, pair.b) and pair.reason), "")


def surroundings_of(own: str, machines: Mapping[str, MachineState], config: Config) -> Surroundings:
    """All other machines that are placed, and the site, about the placed machine `own`."""
    body = machines[own].body
    if body is None:
        raise ValueError(f"{own} is not placed yet")
    others = {
        name: (config.machines[name], state.body)
        for name, state in machines.items()
        if name != own and state.body is not None
    }
    return surroundings(config.machines[own], body, others, config.site)


def growth(own: str, machines: Mapping[str, MachineState], config: Config) -> float:
    """[m] eta of `own` and of the least certain partner together; the configured part once."""
    others = [state.eta for name, state in machines.items() if name != own]
    return machines[own].eta + max([eta - config.eta for eta in others], default=0.0)


def surroundings(
    machine: Machine, body: Body3D, others: Mapping[str, tuple[Machine, Body3D]], site: SiteBodies
) -> Surroundings:
    """Everything within `machine`'s reach in any posture.

    body: where `machine` is; others: all other machines by name.
    """
    boxes = [site.boxes]
    names = [f"site:{name}" for name in site.names]
    partner = [False] * len(site.boxes)
    for name, (other, placed) in others.items():
        boxes.append(placed.boxes)
        names += [f"{name}:{part}" for part in other.body_names]
        partner += [True] * len(placed.boxes)
    everything = concatenated(boxes)
    near = within(everything, body, machine.bounding_radius)
    return Surroundings(
        everything.take(near).moved(transform.inverse(body.link_poses[0])),
        tuple(name for name, kept in zip(names, near, strict=True) if kept),
        np.array(partner, dtype=bool)[near],
    )


def within(boxes: Boxes, body: Body3D, radius: float) -> BoolArray:
    """(n,) whether a box comes closer to the swing centre than `radius` [m]."""
    to_center = body.swing_center - boxes.centers
    local = np.abs(np.einsum("nji,nj->ni", boxes.rotations, to_center))
    outside = np.maximum(local - boxes.half_extents, 0.0)
    return np.asarray(np.linalg.norm(outside, axis=1) <= radius)
