"""IFC, where its optional library is installed; without it, what is missing is named."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.errors import InputError
from backend.gauge.read import read


def mast(path: Path, scale: float | None) -> None:
    """A box of 2 m x 3 m x 4 m in millimetres, on a map in metres whose x axis points north."""
    ifcopenshell: Any = pytest.importorskip("ifcopenshell")
    file = ifcopenshell.file(schema="IFC4X3")
    make = file.create_entity

    def point(*values: float) -> Any:
        return make("IfcCartesianPoint", Coordinates=list(values))

    axes = make("IfcAxis2Placement3D", Location=point(0.0, 0.0, 0.0))
    context = make("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, axes)
    millimetre = make("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE")
    metre = make("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE")
    units = make("IfcUnitAssignment", Units=[millimetre])
    identity = iter(f"{i:022d}" for i in range(100))
    make(
        "IfcProject",
        GlobalId=next(identity),
        RepresentationContexts=[context],
        UnitsInContext=units,
    )
    crs = make("IfcProjectedCRS", Name="EPSG:3879", MapUnit=metre)
    make("IfcMapConversion", context, crs, 25496000.0, 6673000.0, 5.0, 0.0, 1.0, scale)
    profile = make("IfcRectangleProfileDef", "AREA", None, None, 2000.0, 3000.0)
    up = make("IfcDirection", DirectionRatios=[0.0, 0.0, 1.0])
    solid = make("IfcExtrudedAreaSolid", profile, axes, up, 4000.0)
    body = make("IfcShapeRepresentation", context, "Body", "SweptSolid", [solid])
    where = make("IfcAxis2Placement3D", Location=point(10000.0, 20000.0, 0.0))
    make(
        "IfcBuildingElementProxy",
        GlobalId=next(identity),
        Name="mast",
        ObjectPlacement=make("IfcLocalPlacement", RelativePlacement=where),
        Representation=make("IfcProductDefinitionShape", Representations=[body]),
    )
    file.write(str(path))


@pytest.mark.parametrize("scale", [None, 0.001])
def test_a_mast_on_the_map(tmp_path: Path, scale: float | None) -> None:
    path = tmp_path / "mast.ifc"
    mast(path, scale)
    model = read(path)
    assert (model.crs.epsg, model.format, model.notes) == (3879, "IFC", ())
    (surface,) = model.surfaces
    assert (surface.name, surface.kind) == ("mast", "IfcBuildingElementProxy")
    assert math.isclose(surface.area, 52.0)
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    # x = 10 points north, y = 20 points west.
    np.testing.assert_allclose(low - [25496000, 6673000, 5], [-21.5, 9, 0], atol=1e-6)
    np.testing.assert_allclose(high - [25496000, 6673000, 5], [-18.5, 11, 4], atol=1e-6)


def test_what_is_no_ifc_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("ifcopenshell")
    path = tmp_path / "a.ifc"
    path.write_text("ISO-10303-21;garbage")
    with pytest.raises(InputError, match="IFC cannot be read"):
        read(path)


def test_it_names_what_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    path = tmp_path / "a.ifc"
    path.write_text("ISO-10303-21;")
    with pytest.raises(InputError, match=r"excavator-cockpit\[ifc\]"):
        read(path)
