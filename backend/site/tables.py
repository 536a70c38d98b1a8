"""The tables of a site file, checked field by field. Degrees only here, where people edit."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import ConfigDict, Field, field_validator, model_validator

from backend.machine.model import ROLES
from backend.site.base import (
    Degrees,
    MachineName,
    Matrix,
    Name,
    NotNegative,
    Positive,
    Prefix,
    Table,
    Tilt,
    Vector,
)
from backend.site.cameras import MOST, Camera, as_list
from backend.site.gauge_tables import Gauge
from backend.site.moving import Person, Vehicle
from backend.site.others import Can, MachineTopics, refuse_shared_topics
from backend.spatial.rotation import rz
from backend.spatial.types import Array, frozen


class Frame(Table):
    """The site frame, see backend.fusion.crs.SiteFrame."""

    epsg: int
    origin: Vector
    geoid_offset: float = 0.0
    heading_reference: Literal["grid", "true"] = "grid"


class Safety(Table):
    """eta: configured inflation; slow_below, stop_below: p_u and p_l of Mäkinen 2021 [m]."""

    eta: NotNegative = 0.10
    slow_below: Positive = 0.8
    stop_below: NotNegative = 0.2

    @model_validator(mode="after")
    def _ordered(self) -> Safety:
        if self.stop_below >= self.slow_below:
            raise ValueError(
                f"stop_below is {self.stop_below}; allowed is less than slow_below "
                f"({self.slow_below})"
            )
        return self


class Stability(Table):
    """Tipping over: keep, slow: shares of the way from the middle to an edge of the tracks that
    must be left, and below which it is told; limits: whether motions are limited by it; required:
    whether a machine may not move of which it is not known.
    """

    keep: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.1
    slow: Annotated[float, Field(gt=0.0, le=1.0)] = 0.25
    limits: bool = True
    required: bool = False

    @model_validator(mode="after")
    def _ordered(self) -> Stability:
        if self.keep >= self.slow:
            raise ValueError(f"keep is {self.keep}; allowed is less than slow ({self.slow})")
        return self


class Sun(Table):
    """Resolution (m yaws, n lengths) and link half-width eta [m] of Sun's sets."""

    m: Annotated[int, Field(ge=1, le=500)] = 50
    n: Annotated[int, Field(ge=1, le=500)] = 50
    eta: NotNegative = 0.1


class Rates(Table):
    """Rates of the two loops [Hz]."""

    step_hz: Annotated[float, Field(ge=1.0, le=200.0)] = 50.0
    image_hz: Annotated[float, Field(ge=0.1, le=50.0)] = 10.0
    zone_hz: Annotated[float, Field(ge=0.1, le=50.0)] = 1.0


class Start(Table):
    """Where the simulation puts a machine: position in the projected CRS [m], angles [deg]."""

    position: Vector
    yaw_deg: Degrees = 0.0
    pitch_deg: Tilt = 0.0
    roll_deg: Tilt = 0.0
    joints_deg: dict[str, Degrees] = Field(default_factory=dict)

    @field_validator("joints_deg")
    @classmethod
    def _roles(cls, joints: dict[str, float]) -> dict[str, float]:
        for role in joints:
            if role not in ROLES:
                raise ValueError(f'names the joint "{role}"; allowed are {", ".join(ROLES)}')
        return joints

    @property
    def attitude(self) -> tuple[float, float, float]:
        """Yaw, pitch, roll [rad]."""
        return math.radians(self.yaw_deg), math.radians(self.pitch_deg), math.radians(self.roll_deg)

    @property
    def joints(self) -> dict[str, float]:
        """Joint values by role, the URDF's own [rad]; joints that are not named are left out."""
        return {role: math.radians(value) for role, value in self.joints_deg.items()}


class MachineSim(Table):
    """What a simulated machine does; `details` are the program's own fields.

    joints: what it publishes of the joints that cylinders move: "angles", or the cylinders'
    "strokes", as a machine with stroke sensors does. ground: "plane", on which its base is carried
    by its tracks and tips, or "contact", on which it stands, climbs the site's obstacles and falls.
    """

    model_config = ConfigDict(extra="allow")

    program: str = "hold"
    seed: Annotated[int, Field(ge=0)] = 0
    joints: Literal["angles", "strokes"] = "angles"
    ground: Literal["plane", "contact"] = "plane"

    @property
    def details(self) -> dict[str, Any]:
        """The program's own fields, checked by the simulator."""
        return dict(self.model_extra or {})


class SiteMachine(Table):
    """One machine of the site. Paths are relative to the site file's folder; payload: what it
    carries at most [kg], the sidecar's rated one by default.
    """

    name: MachineName
    model: Annotated[str, Field(min_length=1)]
    label: Annotated[str, Field(max_length=24)] = ""
    sidecar: Annotated[str, Field(min_length=1)] | None = None
    prefix: Prefix = ""
    payload: NotNegative | None = None
    start: Start | None = None
    topics: MachineTopics = MachineTopics()
    camera: Annotated[tuple[Camera, ...], Field(max_length=MOST)] = ()
    sim: MachineSim = MachineSim()

    @model_validator(mode="before")
    @classmethod
    def _named_after(cls, table: Any) -> Any:
        """Label and prefix default to the name; one camera needs no list."""
        table = as_list(table) if isinstance(table, dict) else table
        if isinstance(table, dict) and isinstance(table.get("name"), str):
            name = table["name"]
            return {"label": name.upper().replace("_", " "), "prefix": name, **table}
        return table


class Hardware(Table):
    """How simulated hardware publishes (Sun 2020, Section 5.1 and App. A). Periods, delays [s];
    lidar: whether the machines' LiDARs are simulated, which takes a twentieth of a processor each.
    """

    joint_period: Annotated[float, Field(ge=0.001, le=10.0)] = 0.005
    position_period: Annotated[float, Field(ge=0.001, le=10.0)] = 0.05
    heading_period: Annotated[float, Field(ge=0.001, le=10.0)] = 0.05
    position_noise: NotNegative = 0.02
    heading_noise_deg: NotNegative = 0.1
    joint_noise_deg: NotNegative = 0.05
    radio_period: NotNegative = 0.040
    latency: NotNegative = 0.100
    lidar: bool = False


class Obstacle(Table):
    """A box on the site. center in the projected CRS; yaw_deg or a rotation matrix, not both."""

    name: Name
    center: Vector
    half_extents: tuple[Positive, Positive, Positive]
    yaw_deg: Degrees | None = None
    rotation: Matrix | None = None

    @model_validator(mode="after")
    def _one_rotation(self) -> Obstacle:
        if self.rotation is not None and self.yaw_deg is not None:
            raise ValueError("gives both yaw_deg and rotation; allowed is one of them")
        R = self.R_site_box
        if not np.allclose(R @ R.T, np.eye(3), atol=1e-6) or np.linalg.det(R) < 0.0:
            raise ValueError("rotation is not a rotation; allowed is an orthonormal 3x3 matrix")
        return self

    @property
    def R_site_box(self) -> Array:
        """(3, 3), columns are the box axes."""
        if self.rotation is not None:
            return frozen(self.rotation, (3, 3), "rotation")
        return rz(math.radians(self.yaw_deg or 0.0))


class ObstacleMesh(Table):
    """A mesh file on the site, stood for by boxes that contain it. file: relative to the site file;
    position: of the file's origin, in the projected CRS; max_excess: of the boxes, where max_boxes
    are enough for it [m].
    """

    name: Name
    file: Annotated[str, Field(min_length=1)]
    position: Vector
    yaw_deg: Degrees = 0.0
    scale: Positive = 1.0
    max_boxes: Annotated[int, Field(ge=1, le=100)] = 24
    max_excess: Annotated[float, Field(gt=0.0, le=5.0)] = 0.15


class Link(Table):
    """Zenoh endpoints, for example "tcp/127.0.0.1:7447"."""

    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()


class People(Table):
    """People are watched for, by the LiDARs of the site's machines. slow_below, stop_below:
    distances of people to machines at which motion towards them begins to slow and stops [m];
    walking: speed at which anybody may begin to come nearer [m/s]; stale: without a scan for so
    long people are unknown, and nothing moves [s]; ttc, index: where an emergency and where a
    warning begins, as times to collision of a swing [s] and as warning indices.
    """

    slow_below: Positive = 2.0
    stop_below: NotNegative = 0.6
    walking: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    stale: Annotated[float, Field(ge=0.15, le=5.0)] = 0.5
    ttc: tuple[Annotated[float, Field(gt=0.0, le=6.0)], Annotated[float, Field(gt=0.0, le=6.0)]] = (
        1.0,
        3.0,
    )
    index: tuple[
        Annotated[float, Field(ge=0.0, le=4.0)], Annotated[float, Field(ge=0.0, le=4.0)]
    ] = (1.0, 2.0)

    @model_validator(mode="after")
    def _ordered(self) -> People:
        for name, (emergency, warning) in (("ttc", self.ttc), ("index", self.index)):
            if emergency >= warning:
                raise ValueError(
                    f"{name} is {[emergency, warning]}; allowed is an emergency's below a warning's"
                )
        if self.stop_below >= self.slow_below:
            raise ValueError(
                f"stop_below is {self.stop_below}; allowed is less than slow_below "
                f"({self.slow_below})"
            )
        return self


class Recording(Table):
    """What a running cockpit records. folder: of all recordings, relative to the site file; empty
    for $EXCAVATOR_COCKPIT_RECORDINGS or ~/.local/state/excavator-cockpit/recordings. The oldest
    parts beyond max_gib [GiB] and max_hours [h] are deleted, except those that are pinned. clouds:
    points of LiDARs, too, about 8 GiB an hour each.
    """

    enabled: bool = True
    folder: str = ""
    max_gib: Annotated[float, Field(ge=0.1, le=10_000.0)] = 4.0
    max_hours: Annotated[float, Field(ge=0.1, le=10_000.0)] = 24.0
    clouds: bool = False


class SiteTable(Table):
    """A whole site file."""

    name: Name
    title: str = ""
    frame: Frame
    safety: Safety = Safety()
    stability: Stability = Stability()
    sun: Sun = Sun()
    rates: Rates = Rates()
    machine: Annotated[tuple[SiteMachine, ...], Field(min_length=1)]
    sim: Hardware = Hardware()
    obstacle: tuple[Obstacle, ...] = ()
    obstacle_mesh: tuple[ObstacleMesh, ...] = ()
    person: Annotated[tuple[Person, ...], Field(max_length=64)] = ()
    vehicle: Annotated[tuple[Vehicle, ...], Field(max_length=64)] = ()
    link: Link = Link()
    recording: Recording = Recording()
    can: Can = Can()
    gauge: Gauge = Gauge()
    people: People | None = None

    @model_validator(mode="after")
    def _distinct(self) -> SiteTable:
        _refuse_duplicates("machine", "name", [machine.name for machine in self.machine])
        obstacles = [o.name for o in self.obstacle] + [m.name for m in self.obstacle_mesh]
        _refuse_duplicates("obstacle", "name", obstacles)
        _refuse_duplicates("person", "name", [person.name for person in self.person])
        _refuse_duplicates("vehicle", "name", [vehicle.name for vehicle in self.vehicle])
        refuse_shared_topics((machine.name, machine.topics) for machine in self.machine)
        prefixes = sorted(machine.prefix + "/" for machine in self.machine)
        for shorter, longer in pairwise(prefixes):
            if longer.startswith(shorter):
                raise ValueError(
                    f'machine has the prefixes "{shorter[:-1]}" and "{longer[:-1]}"; allowed are '
                    "prefixes of which none lies inside another"
                )
        for prefix in prefixes:
            if prefix.startswith("cockpit/"):
                raise ValueError(
                    'machine has the prefix "cockpit", which the cockpit itself publishes under; '
                    "allowed is any other"
                )
        return self


def _refuse_duplicates(table: str, field: str, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f'{table} has the {field} "{name}" twice; allowed is a unique {field}')
