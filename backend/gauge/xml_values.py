"""Values in LandXML elements: names, numbers, points. What is not sound raises ValueError with the
reason, and the caller leaves the element out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from backend.gauge.units import Units
from backend.spatial.types import Array

LARGEST = 1e8  # of a coordinate or length [m]; the Earth's circumference is 4e7
MAX_POINTS = 2_000_000  # of one list


def local(element: Any) -> str:
    """The tag without its namespace; "" for comments and the like."""
    tag = element.tag
    return tag.rpartition("}")[2] if isinstance(tag, str) else ""


def child(element: Any, *names: str) -> Any:
    """The first child with one of these local names, or None."""
    return next((c for c in element if local(c) in names), None)


def children(element: Any, *names: str) -> list[Any]:
    return [c for c in element if local(c) in names]


def clean(text: str | None) -> str:
    """Without stray spaces at its ends and within."""
    return " ".join((text or "").split())


def called(element: Any, text: str = "") -> str:
    """How a message names an element: tag, name and line."""
    name = clean(element.get("name")) or text
    shown = f'{local(element)} "{name}"' if name else local(element)
    return f"{shown}, line {element.sourceline}"


def number(text: str | None) -> float:
    """A number as the file has it; NaN when it is absent or "NaN". Infinity is "INF"."""
    word = (text or "").strip()
    if not word:
        return math.nan
    if "_" in word:
        raise ValueError(f'"{word}" is not a number')
    try:
        return float(word)
    except ValueError:
        raise ValueError(f'"{word[:40]}" is not a number') from None


def attribute(element: Any, key: str, factor: float = 1.0) -> float:
    """A length [m] that is absent, NaN, or finite and of this Earth."""
    try:
        value = number(element.get(key)) * factor
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    if math.isnan(value):
        return value
    if abs(value) > LARGEST:
        raise ValueError(f'{key} is "{element.get(key)}"; allowed is up to {LARGEST:g} m')
    return value


def radius(element: Any, key: str, factor: float) -> float:
    """A radius [m]: NaN when absent, inf for "INF", 0 or anything as good as straight."""
    try:
        value = number(element.get(key)) * factor
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from None
    return math.inf if value == 0.0 or abs(value) > LARGEST else abs(value)


def floats(text: str | None) -> list[float]:
    """The numbers of a text, separated by white space."""
    words = (text or "").split()
    if len(words) > 3 * MAX_POINTS:
        raise ValueError(f"it lists more than {MAX_POINTS} points")
    return [number(word) for word in words]


def point(text: str | None, units: Units) -> Array:
    """(3,) east, north, height [m] of "north east [height]"; height NaN when absent."""
    values = floats(text)
    if len(values) not in (2, 3):
        raise ValueError(f"it has {len(values)} coordinates; allowed are north, east and height")
    height = values[2] * units.elevation if len(values) == 3 else math.nan
    return sound(np.array([values[1] * units.linear, values[0] * units.linear, height]))


def points(element: Any, units: Units) -> Array:
    """(n, 3) [m] of a <PntList2D> or <PntList3D>."""
    width = 3 if local(element).endswith("3D") else 2
    values = floats(element.text)
    if not values or len(values) % width:
        raise ValueError(f"it has {len(values)} numbers; allowed is a multiple of {width}")
    table = np.array(values).reshape(-1, width)
    result = np.full((len(table), 3), np.nan)
    result[:, 0], result[:, 1] = table[:, 1] * units.linear, table[:, 0] * units.linear
    if width == 3:
        result[:, 2] = table[:, 2] * units.elevation
    return sound(result)


def sound(xyz: Array) -> Array:
    """xyz (..., 3) when east and north are finite and nothing is too large; heights may be NaN."""
    if not np.isfinite(xyz[..., :2]).all():
        raise ValueError("a coordinate is not a finite number")
    if not (np.abs(np.nan_to_num(xyz, nan=0.0)) <= LARGEST).all():
        raise ValueError(f"a coordinate is beyond {LARGEST:g} m")
    return xyz


def properties(element: Any) -> dict[str, str]:
    """All <Property> of the element's own <Feature> extensions, as "code.label": value."""
    found: dict[str, str] = {}
    for feature in children(element, "Feature"):
        code = clean(feature.get("code"))
        for item in children(feature, "Property"):
            found[f"{code}.{clean(item.get('label'))}"] = clean(item.get("value"))
    return found


def coding(element: Any) -> dict[str, str]:
    """What the extensions IM_coding and IM_proprietaryCoding say, by label."""
    codes = {}
    for key, value in properties(element).items():
        code, _, label = key.partition(".")
        if code in ("IM_coding", "IM_proprietaryCoding"):
            codes[label] = value
    return codes
