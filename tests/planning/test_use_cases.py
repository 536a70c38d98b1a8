"""Mäkinen 2021, Chapter 4: the pole and the ballast removal, judged by python-fcl and coal."""

from __future__ import annotations

import numpy as np
import pytest
from gauge_runs import FOLLOWING, RAIL, ballast, between, contacts, drive

from backend.machine import kinematics
from backend.planning import rail_site
from backend.planning.proximity import Sight, near_points, posed, shortest
from backend.planning.records import Settings
from backend.planning.simulate import STEP, Run, clearances, run
from backend.planning.vibration import vibration


@pytest.fixture(scope="module")
def pole() -> Run:
    q_start, wish = rail_site.pole_wish(RAIL)
    return run("scaling", RAIL, rail_site.pole_limits(), q_start, wish, Settings(), 9.0)


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    return {name: ballast(name, settings) for name, settings in FOLLOWING.items()}  # type: ignore[arg-type]


def pole_distance(q: np.ndarray) -> np.ndarray:
    """Shortest distance from the machine to the pole, without its own bodies to each other."""
    limits, sight = rail_site.pole_limits(), Sight.everywhere(RAIL, 10.0)
    return np.array(
        [shortest(near_points(RAIL, posed(RAIL, p), limits, sight, own=False)) for p in q]
    )


def at(done: Run, t: float) -> int:
    return int(np.searchsorted(done.times, t - 1e-9))


def test_the_pole_is_approached_as_in_figures_4_3_and_4_4(pole):
    speed = np.linalg.norm(np.diff(kinematics.end_point(RAIL, pole.q), axis=0), axis=1) / STEP
    pole_alone = pole_distance(pole.q)
    assert (pole_alone >= 0.2).all()
    assert pole_alone.min() < 0.31
    near = (pole_alone < 0.8) & (pole.times > 1.0) & (pole.times < 5.0)
    assert 2.0 <= pole.times[np.argmax(near)] < 4.0
    # From 0.8 m on it slows down all the way.
    approach = speed[at(pole, 1.1) : at(pole, 4.98)]
    assert (np.diff(approach) < 1e-3).all()
    assert approach[0] == pytest.approx(rail_site.POLE_SPEED, rel=0.05)
    assert approach[-1] < 0.2 * rail_site.POLE_SPEED
    scaled = pole.scale[at(pole, 1.5) : at(pole, 4.98)]
    want = np.clip((pole_alone[at(pole, 1.5) : at(pole, 4.98)] - 0.2) / 0.6, 0.0, 1.0)
    np.testing.assert_allclose(scaled, want, atol=0.025)  # of the next step


def test_who_keeps_pushing_stands_before_the_pole(monkeypatch):
    monkeypatch.setattr(rail_site, "POLE_BACK", 30.0)
    q_start, wish = rail_site.pole_wish(RAIL)
    done = run("scaling", RAIL, rail_site.pole_limits(), q_start, wish, Settings(), 14.0)
    distance = pole_distance(done.q)
    assert (distance >= 0.2).all()
    assert distance[-1] < 0.215
    assert np.abs(done.rates[-1]).max() < 0.01


def test_the_way_back_from_the_pole_is_at_full_speed(pole):
    back = slice(at(pole, 5.0), at(pole, 6.0))
    assert (pole.scale[back] == 1.0).all()
    tips = kinematics.end_point(RAIL, pole.q[back])
    speed = np.linalg.norm(np.diff(tips, axis=0), axis=1) / STEP
    np.testing.assert_allclose(speed, rail_site.POLE_SPEED, rtol=0.05)
    np.testing.assert_allclose(
        kinematics.end_point(RAIL, pole.q[-1]), kinematics.end_point(RAIL, pole.q[0]), atol=0.02
    )


def test_the_pole_is_never_touched(pole):
    assert contacts(between(pole.q), rail_site.pole_limits()) == (0, 0)


def test_the_designed_path_reaches_into_the_adjacent_track():
    path = rail_site.ballast_path()
    q = np.array([path.at(t)[0] for t in np.arange(0.0, path.duration, 0.2)])
    by_fcl, by_coal = contacts(q, rail_site.ballast_limits())
    assert by_fcl > 10
    assert by_coal == by_fcl
    rates = np.array([path.at(t)[1] for t in np.arange(0.0, path.duration, 0.05)])
    assert (np.abs(rates) <= RAIL.max_velocity).all()


@pytest.mark.parametrize("name", sorted(FOLLOWING))
def test_no_method_touches_anything_during_ballast_removal(runs, name):
    assert contacts(between(runs[name].q), rail_site.ballast_limits()) == (0, 0)


def test_scaling_and_constraints_keep_the_lower_threshold(runs):
    for name in ("scaling", "constrained"):
        assert clearances(RAIL, rail_site.ballast_limits(), runs[name].q).min() > 0.199, name


def test_constraints_reach_the_end_and_scaling_stays_on_the_way(runs):
    duration = rail_site.ballast_path().duration
    assert runs["constrained"].arrived == pytest.approx(duration, abs=0.5)
    assert np.isnan(runs["scaling"].arrived)
    assert runs["constrained"].error[:, 0].max() < 1.5
    assert runs["constrained"].error[-1, 0] < 0.03


def test_whenever_constraints_change_a_motion_they_say_what_for(runs):
    done = runs["constrained"]
    off = done.error[:, 0] > 0.05
    told = np.array([bool(why) for why in done.why])
    assert told.any()
    assert "adjacent track" in " ".join(w for why in done.why for w in why)
    # While the tool leaves its path it is said why; on its way back nothing holds it.
    leaving = off[1:] & (np.diff(done.error[:, 0]) > 1e-3)
    assert told[1:][leaving].mean() > 0.95


def test_constraints_vibrate_ten_times_less_than_a_potential_that_keeps_the_same_distance(runs):
    """Gains that keep p_l; the whole range is searched in a campaign."""
    calm = vibration(runs["constrained"].rates, STEP)
    shaken = ballast("potential", Settings(gain=0.03))
    assert clearances(RAIL, rail_site.ballast_limits(), shaken.q).min() > 0.19
    other = vibration(shaken.rates, STEP)
    assert other.energy > 10.0 * calm.energy
    assert other.sign_changes > 10 * calm.sign_changes
    assert other.reversals > 10 * calm.reversals


def test_vibration_of_known_signals():
    t = np.arange(0.0, 10.0, STEP)
    slow, fast = np.sin(2 * np.pi * 0.2 * t), 0.1 * np.sin(2 * np.pi * 12.5 * t)
    quiet = vibration(slow[:, None], STEP)
    assert quiet.energy < 1e-3
    assert quiet.sign_changes == 3
    # A sine's energy is half its squared amplitude times its time.
    assert vibration((slow + fast)[:, None], STEP).energy == pytest.approx(0.05, rel=0.02)
    assert vibration(np.stack([slow + fast] * 2, axis=1), STEP).reversals > 400


@pytest.mark.parametrize("method", ["constrained", "scaling"])
def test_careless_drives_touch_nothing(method):
    for seed in (2, 5):
        done, limits = drive(seed, method, 4.0)
        assert contacts(done.q, limits) == (0, 0)
        free, _ = drive(seed, None, 4.0)
        part = np.abs(done.rates).sum() / np.abs(free.rates).sum()
        assert part > 0.3
        steps = np.abs(np.diff(done.rates, axis=0))
        assert (steps <= RAIL.max_acceleration * STEP + 1e-9).all()
