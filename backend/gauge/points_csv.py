"""Points and lines as CSV.

A header and one point a row, separated by commas or semicolons:

    name   what the point belongs to; rows of one name make one line, in the file's order, and a
           name with a single row a point
    east   [m] in the site's projected CRS
    north  [m]
    height [m], may be empty or missing
    kind   free, of the name's first row: "track" makes an alignment, anything else a feature
    gauge  between the rails of a track [m], of the name's first row; 1.435 when empty
    cant   of a track [m], positive when the left rail is the higher one; 0 when empty

name, east and north must be there; other columns are refused, so that none is misread.
"""

from __future__ import annotations

import csv
import io
import math

import numpy as np

from backend.errors import InputError
from backend.gauge import xml_values as xml
from backend.gauge.alignment import Alignment
from backend.gauge.cant import Cant
from backend.gauge.landxml_plan import polyline
from backend.gauge.log import Log
from backend.gauge.profile import Pvi, build
from backend.gauge.records import Crs, Feature, Model

NEEDED = ("name", "east", "north")
ALLOWED = (*NEEDED, "height", "kind", "gauge", "cant")
TRACK = "track"
GAUGE = 1.435

Row = dict[str, str]


def parse(data: bytes, file: str, epsg: int | None = None) -> Model:
    """The tracks and features of a CSV document. Raises InputError on a wrong header; rows without
    sound coordinates are left out and listed."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{file}: is not UTF-8 text; allowed is a CSV file.") from None
    first = text.partition("\n")[0]
    separator = ";" if first.count(";") > first.count(",") else ","
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    log = Log()
    try:
        header = [word.strip() for word in next(rows, [])]
        _check(header, file)
        groups = _grouped(rows, header, log)
    except csv.Error as error:
        raise InputError(f"{file}: is not a CSV file: {error}.") from None
    alignments, features = [], []
    for name, members in groups.items():
        xyz = np.array([point for _, point in members])
        row = members[0][0]
        kind = row.get("kind", "")
        if kind != TRACK:
            lone = len(xyz) == 1
            features.append(Feature(name, kind, () if lone else (xyz,), xyz if lone else xyz[:0]))
            continue
        try:
            alignments.append(_track(name, members, xyz))
        except ValueError as error:
            log.skip(f'track "{name}"', str(error))
    if not alignments and not features:
        raise InputError(f"{file}: has no row with sound coordinates; allowed is at least one.")
    source = "site" if epsg is not None else ""
    if epsg is None:
        log.note("a CSV file names no CRS")
    return Model(
        name="",
        format="CSV",
        crs=Crs(epsg, "", source),
        alignments=tuple(alignments),
        features=tuple(features),
        skipped=log.skipped,
        notes=log.notes,
    )


def _check(header: list[str], file: str) -> None:
    missing = [word for word in NEEDED if word not in header]
    unknown = [word for word in header if word not in ALLOWED]
    if missing or unknown or len(set(header)) < len(header):
        shown = ", ".join(word[:30] for word in header[:12])
        raise InputError(
            f'{file}: its header is "{shown}"; allowed are {", ".join(NEEDED)} and, if wanted, '
            f"{', '.join(ALLOWED[len(NEEDED) :])}, each once."
        )


def _grouped(rows: object, header: list[str], log: Log) -> dict[str, list[tuple[Row, list[float]]]]:
    groups: dict[str, list[tuple[Row, list[float]]]] = {}
    for line, cells in enumerate(rows, start=2):  # type: ignore[var-annotated,arg-type]
        if not any(cell.strip() for cell in cells):
            continue
        where = f"row {line}"
        if len(cells) != len(header):
            log.skip(where, f"it has {len(cells)} cells where the header has {len(header)}")
            continue
        row = dict(zip(header, (xml.clean(cell) for cell in cells), strict=True))
        try:
            point = [xml.number(row.get(key)) for key in ("east", "north", "height")]
            xml.sound(np.array(point))
        except ValueError as error:
            log.skip(where, str(error))
            continue
        groups.setdefault(row["name"], []).append((row, point))
    return groups


def _track(name: str, members: list[tuple[Row, list[float]]], xyz: object) -> Alignment:
    points = np.asarray(xyz, dtype=float)
    line, heights = polyline(points, name)
    notes, profiles = [], ()
    if len(heights):
        pvis = [Pvi(float(s), float(z)) for s, z in heights]
        profiles = (build("points", pvis, lambda *_: None, lambda *_: None),)  # type: ignore[assignment]
    else:
        notes.append("heights are unknown: not every point has one")
    gauge = xml.number(members[0][0].get("gauge"))
    if not 0.3 <= gauge <= 4.0 and not math.isnan(gauge):
        raise ValueError(f"its gauge is {gauge:g} m; allowed is 0.3 to 4")
    if math.isnan(gauge):
        notes.append(f"no gauge is stated: {GAUGE} m is assumed")
    values = np.nan_to_num([xml.number(row.get("cant")) for row, _ in members], posinf=np.inf)
    if not (np.abs(values) <= 0.5).all():
        raise ValueError("its cant is beyond 0.5 m")
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    cant = Cant("points", gauge, "center", s, values) if np.any(values != 0.0) else None
    return Alignment(
        name=name,
        elements=(line,),
        starts=np.zeros(1),
        profiles=profiles,
        cant=cant,
        gauge=GAUGE if math.isnan(gauge) else gauge,
        gauge_stated=not math.isnan(gauge),
        notes=tuple(notes),
    )
