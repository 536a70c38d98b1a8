"""The columns of a table of poses: names with units, long or wide.

Long: one row is one machine at one time, with a column `machine`. Wide: one row is all machines at
one time, columns begin with the machine's name and a dot ("left.boom_rad").
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from backend.errors import InputError
from backend.machine.model import ROLES
from backend.site.site import Site

_DEG = math.pi / 180.0
TIMES: dict[str, float] = {"time_s": 1e9, "time_ms": 1e6, "time_us": 1e3, "time_ns": 1.0}
"""Columns of time since 1970, or since any other beginning: name -> ns."""

_ANGLES = {"yaw": "yaw", "pitch": "pitch", "roll": "roll"} | {role: role for role in ROLES}
COLUMNS: dict[str, tuple[str, float]] = {
    **{f"{name}_rad": (name, 1.0) for name in _ANGLES},
    **{f"{name}_deg": (name, _DEG) for name in _ANGLES},
    **{f"{name}_m": (name, 1.0) for name in ("easting", "northing", "height", "altitude")},
    "latitude_deg": ("latitude", 1.0),
    "longitude_deg": ("longitude", 1.0),
    "sigma_position_m": ("sigma_position", 1.0),
    "sigma_yaw_rad": ("sigma_yaw", 1.0),
    "sigma_yaw_deg": ("sigma_yaw", _DEG),
}
"""Column -> what it is, and its unit in rad, m, or degrees of latitude and longitude.

easting, northing, height: of the base (URDF root) in the site's projected CRS; latitude, longitude,
altitude (ellipsoidal): of the same point; yaw: of the tracks, counter-clockwise from grid east;
pitch: positive raises the front; joints: the URDF's own values, by role.
"""
MACHINE = "machine"
VALIDITY = "validity"
"""Of long tables, may be left out: rows that are not VALID are not taken."""


@dataclass(frozen=True)
class Layout:
    """time: the column and its ns; machines: column -> (quantity, unit) by machine; the key "" of
    a long table stands for the machine that each row names. unused: columns that mean nothing."""

    time: tuple[str, float]
    machines: dict[str, dict[str, tuple[str, float]]]
    unused: tuple[str, ...]

    @property
    def long(self) -> bool:
        return "" in self.machines

    @property
    def numeric(self) -> list[str]:
        """Columns that hold numbers."""
        return [self.time[0], *(c for columns in self.machines.values() for c in columns)]


def read_layout(names: Sequence[str], site: Site, where: str) -> Layout:
    """Raises InputError: column, what is allowed."""
    for name in names:
        if list(names).count(name) > 1:
            raise InputError(f'{where}: column "{name}" is there twice; allowed is once.')
    times = [name for name in names if name in TIMES]
    if len(times) != 1:
        found = ", ".join(times) or "none"
        raise InputError(
            f"{where}: column of time: there is {found}; allowed is one of {', '.join(TIMES)}."
        )
    machines: dict[str, dict[str, tuple[str, float]]] = {}
    unused: list[str] = []
    long = MACHINE in names
    known = [machine.name for machine in site.machines]
    for name in names:
        if name in TIMES or name == MACHINE or (long and name == VALIDITY):
            continue
        machine, column = ("", name) if long else _split(name)
        if column in COLUMNS and (long or machine in known):
            machines.setdefault(machine, {})[name] = COLUMNS[column]
        else:
            unused.append(name)
    if not machines:
        raise InputError(
            f'{where}: has neither a column "{MACHINE}" nor columns such as "{known[0]}.boom_rad"; '
            f"allowed are machines {', '.join(known)} and columns {', '.join(COLUMNS)}."
        )
    for machine, columns in machines.items():
        _check(machine, columns, where)
    return Layout((times[0], TIMES[times[0]]), machines, tuple(unused))


def _split(name: str) -> tuple[str, str]:
    machine, dot, column = name.partition(".")
    return (machine, column) if dot else ("", name)


def _check(machine: str, columns: dict[str, tuple[str, float]], where: str) -> None:
    """Quantities are given once, and whole."""
    of = f' of "{machine}"' if machine else ""
    quantities = [quantity for quantity, _ in columns.values()]
    for quantity in quantities:
        if quantities.count(quantity) > 1:
            twice = ", ".join(c for c, (q, _) in columns.items() if q == quantity)
            raise InputError(f"{where}: columns {twice}{of} say the same; allowed is one of them.")
    have = set(quantities)
    _together(have, ("easting", "northing"), of, where)
    _together(have, ("latitude", "longitude"), of, where)
    if {"easting", "latitude"} <= have:
        raise InputError(
            f"{where}: position{of} is given by easting_m and by latitude_deg; allowed is one of "
            "them."
        )
    if have & set(ROLES) and "swing" not in have:
        raise InputError(
            f"{where}: columns{of} have joints but no swing_rad or swing_deg; it is required."
        )
    if have & {"easting", "latitude"} and "yaw" not in have:
        raise InputError(
            f"{where}: columns{of} have a position but no yaw_rad or yaw_deg; it is required."
        )


def _together(have: set[str], names: Iterable[str], of: str, where: str) -> None:
    lacking = [name for name in names if name not in have]
    if lacking and len(lacking) < len(tuple(names)):
        unit = "deg" if lacking[0] in ("latitude", "longitude") else "m"
        raise InputError(f"{where}: column {lacking[0]}_{unit}{of} is missing; it is required.")
