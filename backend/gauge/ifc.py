"""IFC models through ifcopenshell, an optional extra of the project: pip install
'excavator-cockpit[ifc]'."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.gauge.log import Log
from backend.gauge.records import Crs, Model, Surface
from backend.spatial.types import Array

MAX_TRIANGLES = 20_000_000
PREFIXES = {None: 1.0, "MILLI": 1e-3, "CENTI": 1e-2, "DECI": 0.1, "KILO": 1e3}
SCALE_TOLERANCE = 0.01  # a map's metres are nearly metres


def parse(path: Path, epsg: int | None = None) -> Model:
    """Every product with a body, as one surface in the map's coordinates [m].

    Raises InputError when ifcopenshell is not installed or cannot read the file.
    """
    try:
        import ifcopenshell
        import ifcopenshell.geom
        import ifcopenshell.util.unit
    except ImportError:
        raise InputError(
            f"{path}: IFC needs ifcopenshell, which is not installed; "
            "pip install 'excavator-cockpit[ifc]' adds it."
        ) from None
    log = Log()
    try:
        model = ifcopenshell.open(str(path))
        settings = ifcopenshell.geom.settings()
        settings.set("use-world-coords", True)
        turn, shift = _map(model, float(ifcopenshell.util.unit.calculate_unit_scale(model)), log)
        surfaces = _surfaces(ifcopenshell.geom.iterator(settings, model), turn, shift, log)
        crs = _crs(model, epsg)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    # ifcopenshell raises whatever its C++ core raises.
    except Exception as error:
        words = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise InputError(f"{path}: IFC cannot be read: {words}.") from None
    if not surfaces:
        raise InputError(f"{path}: holds no product with a body.")
    return Model("", "IFC", crs, surfaces=surfaces, skipped=log.skipped, notes=log.notes)


def _map(model: Any, project: float, log: Log) -> tuple[Array, Array]:
    """(3, 3) and (3,) from the model's coordinates [m] to the map's; project: its unit [m]."""
    found = [] if model.schema == "IFC2X3" else model.by_type("IfcMapConversion")
    if not found:
        log.note("the IFC has no map conversion: coordinates are the model's own")
        return np.eye(3), np.zeros(3)
    conversion = found[0]
    unit = _metres(conversion.TargetCRS, project)
    scale = 1.0 if conversion.Scale is None else float(conversion.Scale) * unit / project
    if abs(scale - 1.0) > SCALE_TOLERANCE:
        log.note(f"the map conversion's scale of {scale:g} is not applied")
        scale = 1.0
    c, s = conversion.XAxisAbscissa, conversion.XAxisOrdinate
    angle = 0.0 if c is None or s is None else np.arctan2(s, c)
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    whole = np.eye(3)
    whole[:2, :2] = turn
    whole[2, 2] = scale
    shift = [conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight]
    return whole, unit * np.array(shift, dtype=float)


def _metres(crs: Any, project: float) -> float:
    """The map's unit [m]; the project's when it does not say."""
    unit = getattr(crs, "MapUnit", None)
    if unit is None:
        return project
    if unit.is_a("IfcSIUnit"):
        return PREFIXES[unit.Prefix]
    factor = unit.ConversionFactor
    return float(factor.ValueComponent.wrappedValue) * PREFIXES[factor.UnitComponent.Prefix]


def _surfaces(iterator: Any, turn: Array, shift: Array, log: Log) -> tuple[Surface, ...]:
    found: list[Surface] = []
    count = 0
    more = iterator.initialize()
    while more:
        shape = iterator.get()
        points = np.array(shape.geometry.verts, dtype=float).reshape(-1, 3) @ turn.T + shift
        faces = np.array(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)
        name = str(shape.name or shape.guid)
        count += len(faces)
        if count > MAX_TRIANGLES:
            raise InputError(f"it has more than {MAX_TRIANGLES} triangles; allowed are fewer.")
        if not len(faces) or not np.isfinite(points).all():
            log.skip(f'{shape.type} "{name}"', "it has no triangles with finite corners")
        else:
            found.append(Surface(name, points, faces, kind=str(shape.type)))
        more = iterator.next()
    return tuple(found)


def _crs(model: Any, epsg: int | None) -> Crs:
    """IfcProjectedCRS names the CRS, most often as "EPSG:3879"."""
    stated = [] if model.schema == "IFC2X3" else model.by_type("IfcProjectedCRS")
    name = str(stated[0].Name or "") if stated else ""
    if epsg is not None:
        return Crs(epsg, name, "site")
    number = name.upper().removeprefix("EPSG:").strip()
    return Crs(int(number), name, "name") if number.isdigit() else Crs(None, name)
