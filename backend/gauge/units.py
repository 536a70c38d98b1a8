"""Units of a LandXML file: factors to metres and radians."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

METRES = {
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "decimeter": 0.1,
    "meter": 1.0,
    "kilometer": 1e3,
    "inch": 0.0254,
    "foot": 0.3048,
    "feet": 0.3048,
    "mile": 1609.344,
    "miles": 1609.344,
    "USSurveyFoot": 1200.0 / 3937.0,
}
ANGLES = {
    "radians": 1.0,
    "grads": math.pi / 200.0,
    "decimal degrees": math.pi / 180.0,
    "decimal dd.mm.ss": math.pi / 180.0,
}


@dataclass(frozen=True)
class Units:
    """Metres of one unit of plan, height, diameter, width and height of pipes; radians of one unit
    of directions, whose degrees may be written dd.mmss (sexagesimal)."""

    linear: float = 1.0
    elevation: float = 1.0
    diameter: float = 1.0
    width: float = 1.0
    height: float = 1.0
    direction: float = 1.0
    sexagesimal: bool = False
    imperial: bool = False

    def bearing(self, value: float) -> float:
        """A direction in the file's unit [rad], still in the file's sense; NaN for none."""
        if not abs(value) <= 1e6:
            return math.nan
        if not self.sexagesimal:
            return value * self.direction
        sign, value = math.copysign(1.0, value), abs(value)
        degrees = math.floor(value + 1e-9)
        minutes = math.floor((value - degrees) * 100 + 1e-7)
        seconds = ((value - degrees) * 100 - minutes) * 100
        return sign * math.radians(degrees + minutes / 60 + seconds / 3600)


def units_of(attributes: Mapping[str, str], imperial: bool) -> tuple[Units, list[str]]:
    """The units that a <Metric> or <Imperial> element states, and what of it is not known.

    Lengths that it does not state are in its linear unit, angles in radians as the schema has it.
    """
    complaints = []

    def factor(key: str, otherwise: float) -> float:
        word = attributes.get(key)
        if word is None:
            return otherwise
        if word not in METRES:
            allowed = ", ".join(METRES)
            complaints.append(f'{key} "{word}" is not known, taken as the linear unit ({allowed})')
            return otherwise
        return METRES[word]

    linear = factor("linearUnit", METRES["foot"] if imperial else 1.0)
    word = attributes.get("directionUnit", attributes.get("angularUnit", "radians"))
    if word not in ANGLES:
        complaints.append(f'directionUnit "{word}" is not known, taken as radians')
        word = "radians"
    units = Units(
        linear,
        factor("elevationUnit", linear),
        factor("diameterUnit", linear),
        factor("widthUnit", linear),
        factor("heightUnit", linear),
        ANGLES[word],
        word == "decimal dd.mm.ss",
        imperial,
    )
    return units, complaints
