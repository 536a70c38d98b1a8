"""Which volumes concern a machine, and why."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from track_curves import Curve, circle, straight

from backend.gauge.choose import NOT_IN_USE, Options, choose, in_force, stands_on, why_idle
from backend.gauge.features import Feature, Overhead, Pole, Track
from backend.gauge.rules import volumes_of
from backend.gauge.volumes import LimitVolume

FEATURES: list[Feature] = [
    Track(Curve("T1", 200.0, straight())),
    Track(Curve("T2", 200.0, lambda s: (s, 4.5 + 0.0 * s, 0.0 * s, 0.0 * s))),
    Track(Curve("T3", 200.0, lambda s: (s, 9.0 + 0.0 * s, 0.0 * s, 0.0 * s), state="Proposed")),
    Overhead("wire", np.array([[0.0, 0.0, 6.0], [200.0, 0.0, 6.0]])),
    Pole("near", np.array([100.0, 6.0, 0.0]), 0.2, 8.0),
    Pole("far", np.array([30.0, 6.0, 0.0]), 0.2, 8.0),
]
VOLUMES = volumes_of(FEATURES)
AT = np.array([100.0, 0.1, 0.0])


def reasons(options: Options, heading: float | None = 0.0) -> dict[str, str]:
    return {c.name: c.reason for c in choose(VOLUMES, AT, 9.0, heading, options)}


def chosen(options: Options, heading: float | None = 0.0) -> set[str]:
    return {c.name for c in choose(VOLUMES, AT, 9.0, heading, options) if c.chosen}


def test_a_machine_on_rails_heeds_all_but_its_own_track() -> None:
    """As in the thesis, Section 2.1.2: on its track it heeds the wire, not the track."""
    options = Options(on_rails=True)
    assert chosen(options) == {"T2", "wire", "near"}
    assert reasons(options) == {
        "T1": "is the track that the machine stands on",
        "T2": "is within reach",
        "T3": "is Proposed: not open to traffic",
        "wire": "is within reach",
        "near": "is within reach",
        "far": "is out of reach: 66.4 m away, reach is 9.0 m",
    }


def test_a_machine_that_is_not_on_rails_heeds_every_track() -> None:
    assert "T1" in chosen(Options(on_rails=False))
    assert "T1" in chosen(Options(on_rails=True), heading=None)


@pytest.mark.parametrize(
    ("position", "heading", "stands"),
    [
        ((100.0, 0.0, 0.0), 0.0, True),
        ((100.0, 0.4, 0.3), math.pi - 0.1, True),  # either way round
        ((100.0, 0.6, 0.0), 0.0, False),  # beside it
        ((100.0, 0.0, 0.0), math.pi / 2.0, False),  # crosses it
        ((100.0, 0.0, 3.0), 0.0, False),  # on a bridge above it
        ((-2.0, 0.0, 0.0), 0.0, False),  # before its end
    ],
)
def test_standing_on_a_track(
    position: tuple[float, float, float], heading: float, stands: bool
) -> None:
    assert stands_on(VOLUMES[0], np.array(position), heading) is stands
    assert not stands_on(VOLUMES[3], np.array(position), heading)


@given(st.floats(0.0, 150.0), st.floats(-0.35, 0.35), st.floats(-0.2, 0.2), st.booleans())
def test_on_a_curve_wherever_it_stands(s: float, aside: float, off: float, back: bool) -> None:
    line = Curve("curve", 150.0, circle(200.0))
    at = line.at(np.array([s]))
    left = np.array([-np.sin(at.heading[0]), np.cos(at.heading[0]), 0.0])
    heading = float(at.heading[0]) + off + math.pi * back
    assert stands_on(CURVE, at.xyz[0] + aside * left, heading)
    assert not stands_on(CURVE, at.xyz[0] + (aside + math.copysign(1.0, aside)) * left, heading)


(CURVE,) = volumes_of([Track(Curve("curve", 150.0, circle(200.0)))])


def test_states_and_switches() -> None:
    assert why_idle(VOLUMES[1]) == ""
    assert why_idle(VOLUMES[1], Options(in_use={"T2": False})) == (
        "is taken out of use: not open to traffic"
    )
    assert why_idle(VOLUMES[2], Options(in_use={"T3": True})) == ""
    off = Options(on_rails=True, switched={"near": False, "T3": True, "T1": True})
    assert chosen(off) == {"T1", "T2", "T3", "wire"}
    assert reasons(off)["near"] == "is switched off"
    assert reasons(off)["T3"] == "is within reach, switched on"
    assert {v.name for v in in_force(VOLUMES)} == {"T1", "T2", "wire", "near", "far"}
    for state in NOT_IN_USE:
        assert why_idle(LimitVolume("pole", "pole", state.upper())) == f"is {state.upper()}"
    for state in ("existing", "in use", "", "whatever"):
        assert why_idle(LimitVolume("pole", "pole", state)) == ""


def test_distances_are_to_the_boxes() -> None:
    found = {c.name: c.distance for c in choose(VOLUMES, AT, 9.0, 0.0)}
    assert found["T1"] == 0.0
    assert found["T2"] == pytest.approx(4.4 - 1.845, abs=1e-6)
    assert found["wire"] == pytest.approx(5.0)
    assert found["near"] == pytest.approx(5.9 - 0.21, abs=0.01)
    # That is at least: from the sphere around the pole.
    assert 65.0 < found["far"] < 70.3


def test_nothing_to_choose_from() -> None:
    assert choose((), AT, 9.0) == ()
    assert choose((LimitVolume("empty", "pole"),), AT, 9.0)[0].chosen is False


def test_a_position_that_is_no_number_is_never_out_of_reach_silently() -> None:
    nowhere = np.full(3, np.nan)
    assert not any(c.chosen for c in choose(VOLUMES, nowhere, 9.0))
