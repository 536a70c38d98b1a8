"""`load_site`: a TOML file, or a shipped site's name, to one frozen record."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.site.gauge_tables import Gauge
from backend.site.messages import sentence
from backend.site.moving import Person, Vehicle
from backend.site.tables import (
    Hardware,
    Link,
    Obstacle,
    ObstacleMesh,
    People,
    Rates,
    Recording,
    Safety,
    SiteMachine,
    SiteTable,
    Stability,
    Sun,
)
from backend.spatial.boxes import Boxes

SITES = Path(__file__).resolve().parents[2] / "scenes" / "sites"


@dataclass(frozen=True)
class Site:
    """A site as every room reads it. path: the file; relative paths in it are against `folder`;
    can_map: the map of its CAN logs; people, vehicles: simulated ones."""

    path: Path
    name: str
    title: str
    frame: SiteFrame
    safety: Safety
    sun: Sun
    rates: Rates
    machines: tuple[SiteMachine, ...]
    sim: Hardware
    obstacles: tuple[Obstacle, ...]
    meshes: tuple[ObstacleMesh, ...]
    link: Link
    recording: Recording
    can_map: Path | None = None
    gauge: Gauge = field(default_factory=Gauge)
    watch: People | None = None
    people: tuple[Person, ...] = ()
    vehicles: tuple[Vehicle, ...] = ()
    stability: Stability = field(default_factory=Stability)

    @property
    def folder(self) -> Path:
        return self.path.parent

    def machine(self, name: str) -> SiteMachine:
        """The machine called `name`; raises InputError listing the site's machines."""
        for machine in self.machines:
            if machine.name == name:
                return machine
        known = ", ".join(machine.name for machine in self.machines)
        raise InputError(f'{self.path.name}: no machine is called "{name}"; allowed are {known}.')

    def obstacle_boxes(self) -> Boxes:
        """The obstacles in the order of `obstacles`, in the site frame."""
        n = len(self.obstacles)
        centers = np.array([obstacle.center for obstacle in self.obstacles]).reshape(n, 3)
        rotations = np.array([obstacle.R_site_box for obstacle in self.obstacles])
        halves = np.array([obstacle.half_extents for obstacle in self.obstacles])
        return Boxes(
            self.frame.from_projected(centers), rotations.reshape(n, 3, 3), halves.reshape(n, 3)
        )


def shipped_sites() -> tuple[str, ...]:
    """Names of the sites in scenes/sites, sorted."""
    return tuple(sorted(path.stem for path in SITES.glob("*.toml")))


def load_site(name_or_path: str | Path) -> Site:
    """The site of a shipped name ("demo") or of a TOML file's path.

    Raises InputError with one sentence (file, field, value, what is allowed). Machine descriptions
    are not loaded here: `SiteMachine.model` and `.sidecar` go to `backend.machine.load`.
    """
    path = _find(name_or_path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text; allowed is a TOML file.") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}.") from error
    return parse_site(data, path)


def parse_site(data: dict[str, Any], path: Path) -> Site:
    """The site of a parsed TOML document; `path` stands in messages and anchors relative paths."""
    try:
        table = SiteTable.model_validate(_tuples(data))
    except ValidationError as error:
        raise InputError(f"{path}: {sentence(error, SiteTable)}") from error
    frame = table.frame
    try:
        site_frame = SiteFrame(
            frame.epsg, frame.origin, frame.geoid_offset, frame.heading_reference
        )
    except InputError as error:
        raise InputError(f"{path}: frame.{error}") from error
    can_map = table.can.map
    return Site(
        path=path.resolve(),
        name=table.name,
        title=table.title or table.name,
        frame=site_frame,
        safety=table.safety,
        sun=table.sun,
        rates=table.rates,
        machines=table.machine,
        sim=table.sim,
        obstacles=table.obstacle,
        meshes=table.obstacle_mesh,
        link=table.link,
        recording=table.recording,
        can_map=path.resolve().parent / can_map if can_map else None,
        gauge=table.gauge,
        watch=table.people,
        people=table.person,
        vehicles=table.vehicle,
        stability=table.stability,
    )


def _find(name_or_path: str | Path) -> Path:
    text = str(name_or_path)
    path = Path(text).expanduser()
    is_name = isinstance(name_or_path, str) and path.suffix != ".toml" and len(path.parts) == 1
    if is_name:
        if text in shipped_sites():
            return SITES / f"{text}.toml"
        shipped = ", ".join(shipped_sites()) or "none"
        raise InputError(
            f'There is no site called "{text}"; allowed are {shipped}, or the path of a .toml file.'
        )
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; allowed is the path of a site file.")
    return path


def _tuples(value: Any) -> Any:
    """TOML's arrays as tuples, as the frozen tables hold them."""
    if isinstance(value, dict):
        return {key: _tuples(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return tuple(_tuples(entry) for entry in value)
    return value
