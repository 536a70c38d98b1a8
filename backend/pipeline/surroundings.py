"""What one machine can touch now, in its own root frame, by name and layer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.collision.box_kernels import near_point
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.people import everybody
from backend.pipeline.people_records import People
from backend.pipeline.records import (
    AS_THE_SITE_SAYS,
    Body3D,
    GaugeInForce,
    MachineState,
    PairDistance,
)
from backend.pipeline.stood_on import but_ground
from backend.pipeline.working_gauge import site_of
from backend.site.named_bodies import SiteBodies
from backend.spatial import transform
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array, BoolArray, IntArray

PARTNER, SITE, PEOPLE = "partner", "site", "people"


@dataclass(frozen=True)
class Surroundings:
    """boxes: in the machine's root frame; names: "right:stick/0", "site:wall", "person:P7";
    partner, people: (n,) the box is of another machine, or somebody's, else of the site.
    """

    boxes: Boxes
    names: tuple[str, ...]
    partner: BoolArray
    people: BoolArray

    @property
    def layers(self) -> dict[str, Boxes]:
        """ "partner" and "site", and "people" when somebody is near."""
        found = {
            PARTNER: self.boxes.take(self.partner),
            SITE: self.boxes.take(~(self.partner | self.people)),
        }
        return {PEOPLE: self.boxes.take(self.people), **found} if self.people.any() else found

    def layer_of(self, index: int) -> str:
        """The layer of one box."""
        if self.people[index]:
            return PEOPLE
        return PARTNER if self.partner[index] else SITE


def why_unknown(
    own: str, machines: Mapping[str, MachineState], pairs: Iterable[PairDistance]
) -> str:
    """Why nothing is certain about what `own` can touch; empty when all of it is known."""
    state = machines[own]
    if state.body is None or state.pose.validity is not Validity.VALID:
        return state.pose.reasons[0] if state.pose.reasons else "is unknown"
    return next((pair.reason for pair in pairs if own in (pair.a, pair.b) and pair.reason), "")


def surroundings_of(
    own: str,
    machines: Mapping[str, MachineState],
    config: Config,
    gauge: GaugeInForce = AS_THE_SITE_SAYS,
    people: People | None = None,
) -> Surroundings:
    """All other machines that are placed, the site, and everybody who limits machines, about the
    placed machine `own`.
    """
    body = machines[own].body
    if body is None:
        raise ValueError(f"{own} is not placed yet")
    others = {
        name: (config.machines[name], state.body)
        for name, state in machines.items()
        if name != own and state.body is not None
    }
    somebody = (NO_BOXES, ()) if people is None else everybody(people)
    site = but_ground(site_of(own, gauge, config), machines[own])
    return surroundings(config.machines[own], body, others, site, somebody)


def growth(own: str, machines: Mapping[str, MachineState], config: Config) -> float:
    """[m] eta of `own` and of the least certain partner together; the configured part once."""
    others = [state.eta for name, state in machines.items() if name != own]
    return machines[own].eta + max([eta - config.eta for eta in others], default=0.0)


def surroundings(
    machine: Machine,
    body: Body3D,
    others: Mapping[str, tuple[Machine, Body3D]],
    site: SiteBodies,
    people: tuple[Boxes, tuple[str, ...]] = (NO_BOXES, ()),
) -> Surroundings:
    """Everything within `machine`'s reach in any posture.

    body: where `machine` is; others: all other machines by name; people: boxes and names.
    """
    boxes: list[Boxes] = []
    names: list[str] = []

    def keep(some: Boxes, called: Sequence[str]) -> int:
        if len(some):
            near = within(some, body.swing_center, machine.bounding_radius)
            boxes.append(some.take(near))
            names.extend([called[k] for k in near.tolist()])
        return len(names)

    of_site = keep(site.boxes, site.full_names)
    for name, (other, placed) in others.items():
        keep(placed.boxes, _names_of(name, ByIdentity(other)))
    machines = len(names)
    keep(*people)
    number = np.arange(len(names))
    return Surroundings(
        concatenated(boxes).moved(transform.inverse(body.link_poses[0])),
        tuple(names),
        (number >= of_site) & (number < machines),
        number >= machines,
    )


@lru_cache(maxsize=64)
def _names_of(name: str, machine: ByIdentity[Machine]) -> tuple[str, ...]:
    return tuple(f"{name}:{part}" for part in machine.value.body_names)


def within(boxes: Boxes, center: Array, radius: float) -> IntArray:
    """(k,) the boxes that come closer to `center` (3,) than `radius` [m]."""
    arrays = boxes.centers, boxes.rotations, boxes.half_extents
    return np.asarray(near_point(*arrays, np.array(center, dtype=float), radius))
