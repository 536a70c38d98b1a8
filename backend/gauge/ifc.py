"""IFC models through ifcopenshell, an optional extra of the project: pip install
'excavator-cockpit[ifc]'."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from backend.errors import InputError
from backend.gauge.log import Log
from backend.gauge.records import Crs, Model, Surface

MAX_TRIANGLES = 20_000_000


def parse(path: Path, epsg: int | None = None) -> Model:
    """Every product with a body, as one surface in the file's world coordinates [m].

    Raises InputError when ifcopenshell is not installed or cannot read the file.
    """
    try:
        import ifcopenshell
        import ifcopenshell.geom
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
        surfaces = tuple(_surfaces(ifcopenshell.geom.iterator(settings, model), log))
        crs = _crs(model, epsg)
    except InputError:
        raise
    # ifcopenshell raises whatever its C++ core raises.
    except Exception as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: IFC cannot be read: {words}.") from None
    if not surfaces:
        raise InputError(f"{path}: holds no product with a body.")
    log.note("map conversions of IFC are applied only as far as ifcopenshell's world coordinates")
    return Model("", "IFC", crs, surfaces=surfaces, skipped=log.skipped, notes=log.notes)


def _surfaces(iterator: Any, log: Log) -> list[Surface]:
    found: list[Surface] = []
    count = 0
    more = iterator.initialize()
    while more:
        shape = iterator.get()
        points = np.array(shape.geometry.verts, dtype=float).reshape(-1, 3)
        faces = np.array(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)
        name = str(shape.name or shape.guid)
        count += len(faces)
        if count > MAX_TRIANGLES:
            raise InputError(f"the IFC has more than {MAX_TRIANGLES} triangles; allowed are fewer.")
        if not len(faces) or not np.isfinite(points).all():
            log.skip(f'{shape.type} "{name}"', "it has no triangles with finite corners")
        else:
            found.append(Surface(name, points, faces, kind=str(shape.type)))
        more = iterator.next()
    return found


def _crs(model: Any, epsg: int | None) -> Crs:
    """IfcProjectedCRS names the CRS, most often as "EPSG:3879"."""
    stated = model.by_type("IfcProjectedCRS")
    name = str(stated[0].Name or "") if stated else ""
    if epsg is not None:
        return Crs(epsg, name, "site")
    number = name.upper().removeprefix("EPSG:")
    return Crs(int(number), name, "name") if number.isdigit() else Crs(None, name)
