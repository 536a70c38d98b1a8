"""What operators draw and switch: which choices can be kept, and which bodies are in force."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.errors import InputError
from backend.gauge.centreline import LineThroughPoints
from backend.gauge.features import Feature, Pole, Track
from backend.gauge.rules import volumes_of
from backend.site.gauge_choice import (
    MOST_AREAS,
    MOST_CORNERS,
    NO_CHOICE,
    Drawn,
    GaugeChoice,
    as_document,
    checked,
    from_document,
)
from backend.site.gauge_in_force import in_force, left_out, own_tracks
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import Boxes, concatenated

SQUARE = ((2.0, 2.0), (6.0, 2.0), (6.0, 5.0), (2.0, 5.0))
PIT = Drawn("pit 3", "keep_out", SQUARE, -2.0, 3.0)
YARD = Drawn("yard", "keep_in", ((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)))


def _line(name: str, y: float, state: str = "existing") -> Track:
    points = np.array([[-40.0, y, 0.0], [0.0, y, 0.0], [40.0, y, 0.0]])
    return Track(LineThroughPoints(name, points, 0.0, 1.435, state))


def _site() -> SiteBodies:
    features: list[Feature] = [
        *(_line("T1", 0.0), _line("T2", 4.5), _line("T3", 9.0, "proposed")),
        Pole("pole", np.array([5.0, 7.0, 0.0]), 0.2, 8.0),
    ]
    volumes = volumes_of(features)
    wall = Boxes(np.array([[0.0, -8.0, 1.0]]), np.eye(3)[None], np.array([[3.0, 0.1, 1.0]]))
    held = [volume for volume in volumes if volume.name != "T3"]
    return SiteBodies(
        concatenated([wall, *(volume.boxes for volume in held)]),
        ("wall", *(name for volume in held for name in volume.box_names)),
        volumes,
        {"T3": "is proposed: not open to traffic"},
    )


SITE = _site()
ON_T1 = np.array([3.0, 0.1, 0.0])


def held(site: SiteBodies) -> set[str]:
    """Names of what keeps machines away, without the numbers of boxes."""
    return {name.removeprefix("gauge:").split("/")[0] for name in site.names}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"polygon": SQUARE[:2]}, "has 2 corners; allowed are 3 to 40"),
        ({"polygon": tuple((math.cos(k), math.sin(k)) for k in range(41))}, "has 41 corners"),
        ({"polygon": (SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3])}, "crosses itself"),
        ({"polygon": ((0.0, 0.0), (1.0, 1.0), (2.0, 2.0))}, "crosses itself or encloses nothing"),
        ({"polygon": ((0.0, 0.0), (0.1, 0.0), (0.1, 0.1))}, "encloses 0.01 m² or less"),
        ({"polygon": ((0.0, 0.0), (math.nan, 0.0), (1.0, 1.0))}, "is not a number within 100000 m"),
        ({"polygon": ((0.0, 0.0), (2.0e5, 0.0), (1.0, 1.0))}, "is not a number within 100000 m"),
        ({"top": math.inf}, "is not a number within"),
        ({"top": None}, "has no bottom or no top"),
        ({"top": -2.0}, r"top is -2 m; allowed is more than bottom \(-2 m\)"),
        ({"kind": "keep_off"}, "kind is 'keep_off'; allowed are keep_out, keep_in"),
        ({"name": ""}, "'' is no name of an area"),
        ({"name": "a/b"}, "'a/b' is no name"),
        ({"name": "pit "}, "'pit ' is no name"),
        ({"name": "T2"}, 'the name "T2" is taken'),
    ],
)
def test_what_cannot_be_kept_is_refused_in_one_sentence(
    changes: dict[str, object], said: str
) -> None:
    area = replace(PIT, **changes)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=said) as found:
        checked(GaugeChoice((area,)), {"T1", "T2"})
    text = str(found.value)
    assert text.startswith("gauge: ")
    assert text.endswith(".")
    assert "allowed" in text


def test_names_are_different_and_areas_are_counted() -> None:
    assert checked(GaugeChoice((PIT, YARD)), {"T1"}).names == ("pit 3", "yard")
    with pytest.raises(InputError, match='"pit 3" is taken'):
        checked(GaugeChoice((PIT, replace(YARD, name="pit 3"))))
    many = tuple(replace(PIT, name=f"pit{k}") for k in range(MOST_AREAS + 1))
    checked(GaugeChoice(many[1:]))
    with pytest.raises(InputError, match="51 areas are drawn; allowed are 50"):
        checked(GaugeChoice(many))
    round_one = tuple((math.cos(k / 6.4), math.sin(k / 6.4)) for k in range(MOST_CORNERS))
    rounds = tuple(replace(PIT, name=f"pit{k}", polygon=round_one) for k in range(11))
    checked(GaugeChoice(rounds[1:]))
    with pytest.raises(InputError, match="the areas have 440 corners in all; allowed are 400"):
        checked(GaugeChoice(rounds))


def test_changes_leave_the_record_before_alone() -> None:
    one = NO_CHOICE.with_area(PIT).with_switch("T2", False).with_switch("pit 3", False)
    moved = replace(PIT, top=5.0)
    assert one.with_area(moved).drawn == (moved,)
    assert one.switched == (("T2", False), ("pit 3", False))
    assert one.without_area("pit 3") == GaugeChoice((), (("T2", False),))
    assert one.with_switch("T2", None).with_switch("pit 3", None) == GaugeChoice((PIT,))
    choices = [NO_CHOICE, one, one.with_area(moved), one.with_area(YARD), one.without_area("pit 3")]
    assert len({choice.digest for choice in choices}) == len(set(choices)) == 5


@given(
    st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), min_size=3, max_size=8),
    st.dictionaries(st.text(max_size=5), st.booleans(), max_size=4),
)
def test_a_document_gives_the_same_choice_bit_by_bit(
    corners: list[tuple[float, float]], switches: dict[str, bool]
) -> None:
    area = replace(PIT, polygon=tuple(corners), bottom=corners[0][0])
    choice = GaugeChoice((area, YARD), tuple(sorted(switches.items())))
    again = from_document(json.loads(json.dumps(as_document(choice))))
    assert again == choice
    assert again.digest == choice.digest


def test_what_is_drawn_keeps_out_of_its_polygon_and_in_it() -> None:
    bodies = in_force(SITE, GaugeChoice((PIT, YARD)))
    volumes = {volume.name: volume for volume in bodies.volumes}
    assert list(volumes) == ["T1", "T2", "T3", "pole", "pit 3", "yard"]
    rng = np.random.default_rng(5)
    points = rng.uniform([-25.0, -25.0, -4.0], [25.0, 25.0, 5.0], (4000, 3))
    x, y, z = points.T
    inside = (x >= 2.0) & (x <= 6.0) & (y >= 2.0) & (y <= 5.0) & (z >= -2.0) & (z <= 3.0)
    assert inside.any()
    assert (volumes["pit 3"].contains(points) == inside).all()
    beyond = (np.abs(x) >= 20.0) | (np.abs(y) >= 20.0)
    assert (volumes["yard"].contains(points) == beyond).all()
    assert held(bodies) == {"wall", "T1", "T2", "pole", "pit 3", "yard"}
    assert len(bodies.names) == len(bodies.boxes)


def test_switches_count_before_states() -> None:
    choice = GaugeChoice((PIT,), (("T2", False), ("T3", True), ("gone", True), ("pit 3", False)))
    bodies = in_force(SITE, choice)
    assert held(bodies) == {"wall", "T1", "T3", "pole"}
    assert bodies.idle == {"T2": "is switched off", "pit 3": "is switched off"}
    assert bodies.always == {"T3"}
    assert held(SITE) == {"wall", "T1", "T2", "pole"}


def test_the_same_choice_gives_the_same_object() -> None:
    assert in_force(SITE, NO_CHOICE) is SITE
    one = in_force(SITE, GaugeChoice((PIT,)))
    equal = GaugeChoice((Drawn("pit 3", "keep_out", tuple(SQUARE), -2.0, 3.0),))
    assert in_force(SITE, equal) is one
    assert in_force(SITE, GaugeChoice((replace(PIT, top=4.0),))) is not one
    assert left_out(one, ()) is one
    assert left_out(one, ("T1",)) is left_out(one, ("T1",))
    assert held(left_out(one, ("T1",))) == held(one) - {"T1"}


def test_the_track_a_machine_stands_on_is_its_own_until_it_has_left() -> None:
    def on(y: float, turn: float, before: tuple[str, ...] = (), z: float = 0.0) -> tuple[str, ...]:
        return own_tracks(SITE, np.array([3.0, y, z]), math.radians(turn), before)

    assert on(0.1, 0.0) == on(-0.1, 180.0) == ("T1",)
    assert on(4.4, 0.0) == ("T2",)
    assert on(9.0, 0.0) == ()  # nobody holds it clear, so there is nothing to leave out
    assert on(2.2, 0.0) == on(0.0, 90.0) == on(0.0, 0.0, z=3.0) == ()
    for y, turn, z in ((0.6, 0.0, 0.0), (0.0, 17.0, 0.0), (0.0, 0.0, 1.2)):
        assert on(y, turn, (), z) == ()
        assert on(y, turn, ("T1",), z) == ("T1",)  # it does not flicker at the edge
    for y, turn, z in ((0.8, 0.0, 0.0), (0.0, 21.0, 0.0), (0.0, 0.0, 1.6)):
        assert on(y, turn, ("T1",), z) == ()


def test_noise_at_the_edge_changes_the_own_track_once() -> None:
    rng = np.random.default_rng(2)
    stood: tuple[str, ...] = ()
    changes = 0
    for k in range(400):
        y = 0.9 * (1.0 - k / 400) + rng.uniform(-0.1, 0.1)
        now = own_tracks(SITE, np.array([3.0, y, 0.0]), 0.0, stood)
        changes += now != stood
        stood = now
    assert stood == ("T1",)
    assert changes == 1


def test_a_track_that_somebody_switched_on_holds_for_who_stands_on_it() -> None:
    on = in_force(SITE, GaugeChoice((), (("T1", True),)))
    assert own_tracks(on, ON_T1, 0.0) == ()
    assert own_tracks(replace(SITE, always=frozenset({"T1"})), ON_T1, 0.0) == ()
    off = in_force(SITE, GaugeChoice((), (("T1", False),)))
    assert own_tracks(off, ON_T1, 0.0) == ()
    assert own_tracks(SiteBodies(), ON_T1, 0.0) == ()
