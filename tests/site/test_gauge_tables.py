"""The working gauge of a site file: tables, mistakes, volumes in the site frame, named boxes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from backend.errors import InputError
from backend.gauge.features import OverheadRule, Pole, Track, TrackRule
from backend.gauge.rules import Rules
from backend.gauge.volumes import LimitVolume
from backend.site.bodies import site_bodies
from backend.site.gauge import site_features, site_options, site_rules, site_volumes
from backend.site.named_bodies import SiteBodies
from backend.site.site import load_site

HEAD = """
name = "yard"
[frame]
epsg = 3879
origin = [25496000.0, 6672000.0, 10.0]
[[machine]]
name = "left"
model = "mini"
[[obstacle]]
name = "wall"
center = [25496010.0, 6672000.0, 11.0]
half_extents = [0.1, 2.0, 1.0]
"""

GAUGE = """
[gauge]
tolerance = 0.02
off = ["P2"]
[gauge.rules]
buried = 0.3
overhead = { beside = 4.0 }
track = { from_rail = 2.5, bottom = -1.0 }
[[gauge.source]]
file = "station.xml"
epsg = 3879
[[gauge.track]]
name = "T1"
points = [[25496000.0, 6672020.0, 10.0], [25496100.0, 6672020.0, 10.5]]
cant = [0.05]
gauge = 1.524
[[gauge.track]]
name = "T2"
state = "proposed"
points = [[25496000.0, 6672025.0, 10.0], [25496100.0, 6672025.0, 10.0]]
half_width = 1.845
pivot = "none"
[[gauge.overhead]]
name = "wire"
points = [[25496000.0, 6672020.0, 16.0], [25496060.0, 6672020.0, 16.0]]
sag = 0.5
above = 1.0
[[gauge.pole]]
name = "P1"
base = [25496000.0, 6672017.0, 10.0]
radius = 0.2
height = 8.0
[[gauge.pole]]
name = "P2"
base = [25496060.0, 6672017.0, 10.0]
radius = 0.2
height = 8.0
[[gauge.building]]
name = "hut"
polygon = [[25496020.0, 6672000.0], [25496024.0, 6672000.0], [25496024.0, 6672003.0]]
bottom = 10.0
top = 13.0
clearance = 0.5
[[gauge.road]]
name = "street"
polygon = [[25496020.0, 6671980.0], [25496060.0, 6671980.0], [25496060.0, 6671990.0]]
bottom = 10.0
top = 14.5
[[gauge.keep_out]]
name = "nest"
polygon = [[25496005.0, 6672005.0], [25496006.0, 6672005.0], [25496006.0, 6672006.0]]
bottom = 9.0
top = 11.0
[[gauge.keep_in]]
name = "area"
polygon = [[25495990.0, 6671990.0], [25496090.0, 6671990.0], [25496090.0, 6672015.0],
  [25495990.0, 6672015.0]]
bottom = 7.0
[[gauge.buried]]
name = "main"
points = [[25496000.0, 6672010.0, 8.5], [25496050.0, 6672010.0, 8.5]]
diameter = 0.4
[gauge.ceiling]
height = 16.0
"""


@pytest.fixture
def site_file(tmp_path: Path) -> Path:
    path = tmp_path / "yard.toml"
    path.write_text(HEAD + GAUGE, encoding="utf-8")
    empty = '<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2"></LandXML>'
    (tmp_path / "station.xml").write_text(empty, encoding="utf-8")
    return path


def by_name(volumes: tuple[LimitVolume, ...]) -> dict[str, LimitVolume]:
    return {volume.name: volume for volume in volumes}


def test_features_stand_in_the_site_frame(site_file: Path) -> None:
    features = {feature.name: feature for feature in site_features(load_site(site_file))}
    assert list(features) == [
        *("T1", "T2", "wire", "P1", "P2", "hut", "street", "nest", "area", "main", "ceiling"),
    ]
    track, pole = features["T1"], features["P1"]
    assert isinstance(track, Track)
    at = track.line.at(np.array([50.0]))
    np.testing.assert_allclose(at.xyz, [[50.0, 20.0, 0.25]], atol=1e-9)
    np.testing.assert_allclose(at.cant, 0.05)
    assert track.line.gauge == 1.524
    assert isinstance(pole, Pole)
    np.testing.assert_allclose(pole.base, [0.0, 17.0, 0.0])


def test_rules_are_the_files_where_it_gives_any(site_file: Path) -> None:
    site = load_site(site_file)
    rules = site_rules(site)
    assert (rules.tolerance, rules.buried, rules.pole) == (0.02, 0.3, Rules().pole)
    assert rules.overhead == OverheadRule(beside=4.0)
    assert rules.track == TrackRule(from_rail=2.5, bottom=-1.0)
    t1, t2, wire = site_features(site)[:3]
    assert t1.rule == rules.track  # type: ignore[union-attr]
    # A width of its own replaces the other way to say how wide.
    assert t2.rule == TrackRule(half_width=1.845, bottom=-1.0, pivot=None)  # type: ignore[union-attr]
    assert wire.rule == OverheadRule(beside=4.0, above=1.0)  # type: ignore[union-attr]
    assert site_options(site).switched == {"P2": False}


def test_volumes_by_hand(site_file: Path) -> None:
    volumes = by_name(site_volumes(load_site(site_file)))
    half = 0.762 + 0.072 + 2.5
    points = np.array([[50.0, 20.0 - half + 0.01, 3.0], [50.0, 20.0 - half - 0.03, 3.0]])
    np.testing.assert_array_equal(volumes["T1"].contains(points), [True, False])
    points = np.array([[30.0, 16.1, 5.0], [30.0, 20.0, 4.55], [30.0, 20.0, 4.45]])
    np.testing.assert_array_equal(volumes["wire"].contains(points), [True, True, False])
    points = np.array([[25.0, 10.0, -1.01], [25.0, 10.0, -0.99], [25.0, 10.49, -1.5]])
    np.testing.assert_array_equal(volumes["main"].contains(points), [True, False, True])
    points = np.array([[22.0, 0.1, 2.9], [22.0, -0.49, 1.0], [22.0, -0.52, 1.0], [23, 1, 3.1]])
    np.testing.assert_array_equal(volumes["hut"].contains(points), [True, True, False, False])
    points = np.array([[0.0, 0.0, -3.1], [0.0, 0.0, -2.9], [0.0, 15.1, 0.0], [0.0, 14.9, 20.0]])
    np.testing.assert_array_equal(volumes["area"].contains(points), [True, False, True, False])
    np.testing.assert_array_equal(
        volumes["ceiling"].contains(np.array([[300.0, 0.0, 6.1], [0.0, 0.0, 5.9]])), [True, False]
    )


def test_bodies_are_named_and_idle_volumes_left_out(site_file: Path) -> None:
    bodies = site_bodies(load_site(site_file))
    assert bodies.names[:2] == ("wall", "gauge:T1/0")
    assert bodies.full_names[:2] == ("site:wall", "gauge:T1/0")
    assert bodies.idle == {"T2": "is proposed: not open to traffic", "P2": "is switched off"}
    assert {volume.name for volume in bodies.volumes} >= {"T1", "T2", "P2"}
    named = {name.partition(":")[2].partition("/")[0] for name in bodies.names[1:]}
    assert named == {volume.name for volume in bodies.volumes} - {"T2", "P2"}
    k = bodies.names.index("gauge:P1/0")
    np.testing.assert_allclose(bodies.boxes.centers[k], [0.0, 17.0, 4.0])
    less = bodies.without(["T1", "nobody"])
    assert set(bodies.names) - set(less.names) == {"gauge:T1/0"}
    assert len(less.boxes) == len(less.names)
    assert bodies.without(["T2"]) is bodies
    assert bodies.standing.names == ("wall",)
    assert len(bodies.standing.boxes) == 1


def test_features_from_elsewhere_join_in(site_file: Path) -> None:
    site = load_site(site_file)
    tree = Pole("tree", np.array([1.0, 2.0, 0.0]), 0.3, 5.0)
    assert "gauge:tree/0" in site_bodies(site, features=[tree]).names
    with pytest.raises(
        InputError, match=r'yard\.toml: gauge: .*called "P1"; allowed is one a name'
    ):
        site_bodies(site, features=[Pole("P1", np.zeros(3), 0.3, 5.0)])


def test_a_site_without_a_gauge_has_no_volumes(site_file: Path) -> None:
    site_file.write_text(HEAD, encoding="utf-8")
    bodies = site_bodies(load_site(site_file))
    assert (bodies.names, bodies.volumes, dict(bodies.idle)) == (("wall",), (), {})
    assert SiteBodies().full_names == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "tolerance = 0.02",
            "tolerance = 0.0",
            "gauge.tolerance is 0.0; allowed is at least 0.001",
        ),
        ("tolerance = 0.02", "slack = 0.02", "gauge.slack is not a known field; allowed are tol"),
        ("buried = 0.3", "buried = -0.3", "gauge.rules.buried is -0.3; allowed is at least 0"),
        ("beside = 4.0", "side = 4.0", "gauge.rules.overhead.side is not a known field"),
        ("cant = [0.05]", "cant = [0.0, 0.1, 0.2]", "gauge.track[1]: cant has 3 entries; allowed"),
        ("cant = [0.05]", "half_width = 2.0\nfrom_rail = 2.5", "gives half_width and from_rail"),
        ('pivot = "none"', 'pivot = "left"', "gauge.track[2].pivot"),
        ('name = "P2"\nbase', 'name = "wire"\nbase', 'gauge: has the name "wire" twice'),
        ('name = "nest"', 'name = "a nest"', "gauge.keep_out[1].name"),
        ("top = 11.0", "top = 9.0", "gauge.keep_out[1]: top is 9.0; allowed is more than bottom"),
        ("bottom = 7.0", "bottom = 7.0\ntop = 6.0", "gauge.keep_in[1]: top is 6.0; allowed is"),
        ("diameter = 0.4", "", "gauge.buried[1].diameter is missing; it is required"),
        ("height = 16.0", 'height = "low"', "gauge.ceiling.height"),
        ('off = ["P2"]', 'off = ["P2"]\non = ["P2"]', 'gauge: has "P2" in on and in off'),
        ("[[25496000.0, 6672020.0, 16.0], [25496060.0, 6672020.0, 16.0]]", "[]", "at least 2"),
    ],
)
def test_mistakes_are_one_sentence(site_file: Path, old: str, new: str, words: str) -> None:
    assert old in GAUGE
    site_file.write_text(HEAD + GAUGE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_site(site_file)
    message = str(caught.value)
    assert words in message
    assert message.startswith(str(site_file))
    assert message.endswith(".")
    assert "\n" not in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[25496100.0, 6672020.0, 10.5]]", "[25496000.0, 6672020.0, 10.5]]", "T1: has too few po"),
        ("[25496024.0, 6672000.0], [", "[25496020.0, 6672000.0], [", "hut: the polygon crosses"),
    ],
)
def test_features_that_make_no_volume_are_named(
    site_file: Path, old: str, new: str, words: str
) -> None:
    assert old in GAUGE
    site_file.write_text(HEAD + GAUGE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        site_bodies(load_site(site_file))
    message = str(caught.value)
    assert message.startswith(f"{site_file}: gauge: {words}")
    assert message.endswith(".")
