"""Which CRS a file is in."""

from __future__ import annotations

import numpy as np
import pytest

from backend.gauge.crs import resolve
from backend.spatial.types import Array

HELSINKI = {
    3879: np.array([[25496706.0, 6673718.0]]),
    3067: np.array([[385800.0, 6672000.0]]),
    2392: np.array([[2552000.0, 6674000.0]]),
}
NOWHERE: Array = np.zeros((0, 2))


@pytest.mark.parametrize(
    ("name", "epsg"),
    [
        ("ETRS89 / GK25FIN", 3879),
        ("ETRS-GK25", 3879),
        ("gk 25", 3879),
        ("GK21", 3875),
        ("GK31FIN", 3885),
        ("ETRS-TM35FIN", 3067),
        ("ETRS89 / TM35FIN(E,N)", 3067),
        ("KKJ / Finland zone 2", 2392),
        ("NAD83 / Texas Central", 32139),
        ("WGS 84 / UTM zone 52N", 32652),
        ("local", None),
        ("my own grid", None),
        ("", None),
    ],
)
def test_names(name: str, epsg: int | None) -> None:
    crs, conflicts = resolve("", name, "", None, NOWHERE)
    assert crs.epsg == epsg
    assert conflicts == []


def test_the_code_alone() -> None:
    assert resolve("3879", "", "N2000", None, HELSINKI[3879])[0].epsg == 3879
    assert resolve("EPSG:3879", "", "", None, HELSINKI[3879])[0].source == "code"


@pytest.mark.parametrize("true", [3879, 2392])
def test_where_code_and_name_disagree_the_coordinates_tell(true: int) -> None:
    crs, conflicts = resolve("2392", "GK25FIN", "", None, HELSINKI[true])
    assert crs.epsg == true
    assert len(conflicts) == 1
    assert "KKJ" in str(conflicts[0].stated)


def test_and_the_name_when_they_do_not() -> None:
    assert resolve("2392", "GK25FIN", "", None, NOWHERE)[0].epsg == 3879


def test_the_sites_word_decides_and_is_checked() -> None:
    crs, conflicts = resolve("3879", "", "", 3067, HELSINKI[3879])
    assert (crs.epsg, crs.source) == (3067, "site")
    assert [("decides" in c.what, "outside" in c.what) for c in conflicts] == [
        (True, False),
        (False, True),
    ]
    assert resolve("3067", "", "", 3067, HELSINKI[3067])[1] == []


def test_a_code_that_does_not_exist() -> None:
    crs, conflicts = resolve("999999", "GK25FIN", "", None, HELSINKI[3879])
    assert crs.epsg == 3879
    assert conflicts[0].stated == "999999"
