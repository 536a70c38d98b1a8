"""What the scene is made of, and where its snapshots come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

from shapely.geometry.base import BaseGeometry

from backend.machine.model import Machine
from backend.pipeline.records import Snapshot
from backend.site.bodies import site_bodies
from backend.site.gauge_choice import GaugeChoice
from backend.site.gauge_in_force import in_force
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.site.site import Site
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array
from cockpit.views.shapes import LinkLooks, link_looks

GHOST_FACES = 8000  # of a machine whose ghost is drawn as the machine looks


@dataclass(frozen=True)
class SceneMachine:
    """label: as operators call it ("LEFT"); model: its description."""

    label: str
    model: Machine

    @cached_property
    def looks(self) -> tuple[LinkLooks, ...]:
        """How each link looks; worked out once, for the machine and all of its ghosts."""
        return tuple(link_looks(self.model, k) for k in range(len(self.model.links)))

    @cached_property
    def ghost_looks(self) -> tuple[LinkLooks, ...]:
        """`looks`, or the bodies where those are so detailed that a ghost would come late."""
        if sum(len(faces) for link in self.looks for _, faces, _ in link.meshes) <= GHOST_FACES:
            return self.looks
        bare = replace(self.model, links=tuple(replace(k, visuals=()) for k in self.model.links))
        return tuple(link_looks(bare, k) for k in range(len(bare.links)))


@dataclass(frozen=True)
class SceneSite:
    """A site as it is drawn.

    origin: easting, northing, height of the site frame's origin in the projected CRS [m];
    machines: in the order of the site; obstacles: in the site frame; bodies: all that the site file
    has, from which and what operators choose the drawn gauge is made;
    slow_below, stop_below: limits of the distance [m].
    """

    title: str
    origin: tuple[float, float, float]
    machines: Mapping[str, SceneMachine]
    obstacles: Boxes
    slow_below: float
    stop_below: float
    bodies: SiteBodies = NO_SITE_BODIES

    def __post_init__(self) -> None:
        if not self.machines:
            raise ValueError("a scene needs at least one machine")
        if not 0.0 <= self.stop_below <= self.slow_below:
            raise ValueError("limits must satisfy 0 <= stop_below <= slow_below")


def scene_site(site: Site, models: Mapping[str, Machine]) -> SceneSite:
    """What the scene needs of a loaded site; models: one per machine's name."""
    bodies = site_bodies(site)
    easting, northing, height = (float(value) for value in site.frame.origin)
    return SceneSite(
        title=site.title,
        origin=(easting, northing, height),
        machines={m.name: SceneMachine(m.label, models[m.name]) for m in site.machines},
        obstacles=bodies.standing.boxes,
        slow_below=site.safety.slow_below,
        stop_below=site.safety.stop_below,
        bodies=bodies,
    )


def drawn_gauge(site: SceneSite, choice: GaugeChoice) -> Boxes:
    """The working gauge in force, but for what lies all around: ceilings and the outside of keep-in
    areas.
    """
    bodies = in_force(site.bodies, choice)
    shown = [v for v in bodies.volumes if v.kind not in ("ceiling", "keep_in")]
    return concatenated(v.boxes for v in shown if v.name not in bodies.idle)


class ZoneImage(Protocol):
    """The part of an image of an ordered pair that the ground shows.

    zone: (k, 2) site frame [m], where the own base point must not go; state_time [s].
    """

    @property
    def zone(self) -> Array: ...

    @property
    def state_time(self) -> float: ...


class ExactZoneImage(Protocol):
    """The part of an exact zone of an ordered pair that the ground shows.

    zones: "as_is", "any_swing", "any_posture" -> polygons with holes in the site frame [m], where
    the own base point must not go; None, or missing, when unknown. state_time [s].
    """

    @property
    def zones(self) -> Mapping[str, BaseGeometry | None]: ...

    @property
    def state_time(self) -> float: ...


class SnapshotSource(Protocol):
    """The newest snapshot and images; a hub."""

    def latest(self) -> Snapshot | None: ...

    def wait(self, after_cycle: int, timeout: float) -> Snapshot | None: ...

    def image(self, kind: str, key: str) -> Any | None:
        """The newest image of a kind, None before there is one.

        "sun": a ZoneImage and "zone": an ExactZoneImage, both per "own<-partner", the latter per
        "own<-layer:people" and "own<-layer:site" too; "exact": a
        backend.pipeline.exact.OwnImage, per own machine.
        """
