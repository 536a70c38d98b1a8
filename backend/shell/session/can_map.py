"""The map beside a DBC: which signal is which joint, position or heading of which machine."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from backend.errors import InputError
from backend.machine.model import ROLES
from backend.machine.stroke_pins import SUFFIX
from backend.site.base import MachineName, Positive, Table
from backend.site.messages import sentence
from backend.site.site import Site

CAN = Path(__file__).resolve().parents[3] / "scenes" / "can"

CYLINDERS = tuple(f"{role}{SUFFIX}" for role in ROLES if role != "swing")

_RADIANS = {"deg": math.pi / 180.0, "rad": 1.0}
_METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_SCALES = {"angle": _RADIANS, "length": _METRES, "degrees": {"deg": 1.0}}
_KINDS = {
    "pitch": "angle",
    "roll": "angle",
    "heading": "angle",
    "latitude": "degrees",
    "longitude": "degrees",
    "altitude": "length",
}


class Signal(Table):
    """A signal of the DBC ("Message.Signal"), or a constant; value * factor + offset is in `unit`.

    max_rate: what changes faster is an outlier, until a second value confirms it [unit/s].
    """

    signal: Annotated[str, Field(pattern=r"^[^.\s]+\.[^.\s]+$")] | None = None
    constant: float | None = None
    unit: Literal["deg", "rad", "m", "cm", "mm"]
    factor: float = 1.0
    offset: float = 0.0
    max_rate: Positive | None = None

    @model_validator(mode="after")
    def _one(self) -> Signal:
        if (self.signal is None) == (self.constant is None):
            raise ValueError("gives both signal and constant, or neither; allowed is one of them")
        return self


class Machine(Table):
    """One machine of the site. joints: by role, or the stroke of a joint's cylinder under
    "boom_cylinder", "stick_cylinder", "bucket_cylinder" (`backend.machine.strokes`). angles: of
    boom, stick and bucket: "joint", the machine's own, or "sun", each from the link before it,
    positive raises (Sun 2020, Fig. 2). heading: of the heading sensor, counter-clockwise from east;
    latitude, longitude, altitude: of the antenna.
    """

    name: MachineName
    angles: Literal["joint", "sun"] = "joint"
    joints: dict[str, Signal] = Field(default_factory=dict)
    pitch: Signal | None = None
    roll: Signal | None = None
    heading: Signal | None = None
    latitude: Signal | None = None
    longitude: Signal | None = None
    altitude: Signal | None = None
    sigma_position: Positive = 0.02
    sigma_heading_deg: Positive = 0.2

    @field_validator("joints")
    @classmethod
    def _roles(cls, joints: dict[str, Signal]) -> dict[str, Signal]:
        for role in joints:
            if role not in (*ROLES, *CYLINDERS):
                allowed = ", ".join((*ROLES, *CYLINDERS))
                raise ValueError(f'names the joint "{role}"; allowed are {allowed}')
        return joints

    @model_validator(mode="after")
    def _whole(self) -> Machine:
        if self.joints and "swing" not in self.joints:
            raise ValueError(
                "joints has no swing; allowed is a signal, or a constant where none is sensed"
            )
        if (self.latitude is None) != (self.longitude is None):
            raise ValueError("gives one of latitude and longitude; allowed are both, or none")
        if self.angles == "sun" and not {"boom", "stick", "bucket"} <= set(self.joints):
            raise ValueError('angles = "sun" needs boom, stick and bucket under joints')
        for name, signal in self.signals.items():
            kind = _kind(name)
            if signal.unit not in _SCALES[kind]:
                allowed = ", ".join(_SCALES[kind])
                raise ValueError(f"{name}.unit is {signal.unit}; allowed are {allowed}")
        return self

    @property
    def signals(self) -> dict[str, Signal]:
        """Every signal by its name here; joints by role."""
        named = {name: getattr(self, name) for name in _KINDS}
        return self.joints | {name: signal for name, signal in named.items() if signal is not None}


class MapTable(Table):
    """A whole map. dbc: path of the DBC, seen from the map's folder."""

    dbc: str = ""
    note: str = ""
    machine: Annotated[tuple[Machine, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _distinct(self) -> MapTable:
        names = [machine.name for machine in self.machine]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'machine has the name "{name}" twice; allowed is a unique name')
        return self


@dataclass(frozen=True)
class CanMap:
    """A map that fits the site. dbc: the file it names, None where it names none."""

    path: Path
    dbc: Path | None
    note: str
    machines: tuple[Machine, ...]


def to_si(name: str, signal: Signal, value: float) -> float:
    """A decoded value in radians, metres, or degrees of latitude and longitude."""
    scale = _SCALES[_kind(name)][signal.unit]
    return (value * signal.factor + signal.offset) * scale


def _kind(name: str) -> str:
    return "length" if name in CYLINDERS else _KINDS.get(name, "angle")


def shipped_maps() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in CAN.glob("*.toml")))


def load_can_map(name_or_path: Path, site: Site) -> CanMap:
    """The map of a shipped name or a path. Raises InputError: file, field, what is allowed."""
    path = name_or_path.expanduser()
    if str(path) in shipped_maps():
        path = CAN / f"{path}.toml"
    if not path.is_file():
        shipped = ", ".join(shipped_maps())
        raise InputError(
            f"{path}: there is no such map; allowed are {shipped}, or the path of a .toml file."
        )
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        table = MapTable.model_validate(_tuples(data))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text; allowed is a TOML file.") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}.") from error
    except ValidationError as error:
        raise InputError(f"{path}: {sentence(error, MapTable)}") from error
    known = [machine.name for machine in site.machines]
    for machine in table.machine:
        if machine.name not in known:
            raise InputError(
                f'{path}: machine "{machine.name}" is not of the site "{site.name}"; allowed are '
                f"{', '.join(known)}."
            )
    dbc = path.parent / table.dbc if table.dbc else None
    return CanMap(path, dbc, table.note, table.machine)


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return tuple(_tuples(entry) for entry in value)
    return value
