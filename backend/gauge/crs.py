"""Which coordinate reference system a file is in: its code, its name, or the site's word."""

from __future__ import annotations

import re
from functools import lru_cache

from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError

from backend.gauge.records import Conflict, Crs
from backend.spatial.types import Array

WHERE = "CoordinateSystem"


def resolve(
    code: str, name: str, heights: str, site: int | None, points: Array
) -> tuple[Crs, list[Conflict]]:
    """The CRS and what disagrees about it.

    code: the file's EPSG code as text, name: its name; site: the site's EPSG code, which decides;
    points: (n, 2) east, north of the file [m]. Where the file's code and name name different
    systems, the one in whose area the points lie is taken, and the name when that does not tell.
    """
    conflicts = []
    stated, named = _code(code), _epsg_of(name)
    chosen, source = (stated, "code") if stated is not None else (named, "name")
    if code and stated is None:
        conflicts.append(Conflict(WHERE, "EPSG code", code, _called(named)))
    elif stated is not None and named is not None and stated != named:
        if _inside(named, points) or not _inside(stated, points):
            chosen, source = named, "name"
        what = f'EPSG code, which the name "{name}" contradicts'
        conflicts.append(Conflict(WHERE, what, _called(stated), _called(chosen)))
    if site is not None:
        if chosen is not None and chosen != site:
            what = "the file's CRS; the site decides"
            conflicts.append(Conflict(WHERE, what, _called(chosen), _called(site)))
        chosen, source = site, "site"
    if chosen is not None and len(points) and not _inside(chosen, points):
        e, n = points[0]
        what = "coordinates outside the area of the CRS"
        conflicts.append(Conflict(WHERE, what, f"east {e:.0f}, north {n:.0f}", _called(chosen)))
    return Crs(chosen, name, source if chosen is not None else "", heights), conflicts


def _code(text: str) -> int | None:
    match = re.fullmatch(r"(?:EPSG:)?(\d{4,6})", text.strip(), re.IGNORECASE)
    if match is None or _crs(int(match[1])) is None:
        return None
    return int(match[1])


def _epsg_of(name: str) -> int | None:
    """The EPSG code of a name: of Finland's systems however they are spelt, of others by the
    register's own name."""
    word = re.sub(r"[\s_\-/().]+", "", name).upper()
    gauss = re.search(r"GK(19|2\d|3[01])(FIN)?", word)
    if gauss is not None:
        return 3873 + int(gauss[1]) - 19
    tm = re.search(r"TM35(FIN)?", word)
    if tm is not None:
        return 3067
    kkj = re.search(r"KKJ\D*([1-4])$", word)
    if kkj is not None:
        return 2390 + int(kkj[1])
    return _registered(name.strip())


@lru_cache(maxsize=32)
def _registered(name: str) -> int | None:
    if len(name) < 6 or not any(c.isalpha() for c in name) or name.lstrip().startswith("{"):
        return None
    try:
        crs = CRS.from_user_input(name)
    except ProjError:
        return None
    if crs.name.casefold() != name.casefold():
        return None
    code = crs.to_epsg(min_confidence=90)
    return None if code is None else int(code)


@lru_cache(maxsize=32)
def _crs(epsg: int) -> CRS | None:
    try:
        return CRS.from_epsg(epsg)
    except ProjError:
        return None


def _called(epsg: int | None) -> str:
    if epsg is None:
        return "none"
    crs = _crs(epsg)
    return f"EPSG:{epsg}" + ("" if crs is None else f" ({crs.name})")


def _inside(epsg: int, points: Array) -> bool:
    """Whether the first and last point lie in the CRS's area of use, half a degree around it."""
    crs = _crs(epsg)
    if crs is None or not len(points):
        return False
    if crs.area_of_use is None:
        return True
    west, south, east, north = crs.area_of_use.bounds
    try:
        back = Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True)
        ends = points[[0, -1]]
        longitude, latitude = back.transform(ends[:, 0], ends[:, 1])
    except ProjError:
        return False
    inside = (longitude > west - 0.5) & (longitude < east + 0.5)
    inside &= (latitude > south - 0.5) & (latitude < north + 0.5)
    return bool(inside.all())
