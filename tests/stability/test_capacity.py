"""Lift capacity against the ZMP of a machine that carries it, and speeds against direct trials."""

from __future__ import annotations

import numpy as np
import pytest

from backend.machine.inverse import inverse
from backend.machine.kinematics import end_point
from backend.stability.allowance import CREEP, allowed_fractions, brings_home
from backend.stability.capacity import capacity_chart, farthest, lift_capacity
from backend.stability.masses import mass_model
from backend.stability.polygon import shrunk, support_polygon
from backend.stability.zmp import edge_moments, share, zmp

ATTITUDE = -0.6


def at_rest(machine, support, q, payload, T=None):
    return share(zmp(mass_model(machine, payload), q, 0 * q, 0 * q, T), support)


@pytest.mark.parametrize("least", [0.0, 0.25])
def test_at_its_capacity_a_machine_has_that_share_left(machine, draw, slope, least):
    q, _, _ = draw(machine, np.random.default_rng(1), 60)
    support, T = support_polygon(machine), slope(0.3, 0.08, -0.05)
    most = lift_capacity(machine, support, q, T, least)
    tried = 0
    for i in np.flatnonzero(np.isfinite(most) & (most > 0.0)):
        assert at_rest(machine, support, q[i], most[i], T) == pytest.approx(least, abs=1e-9)
        assert at_rest(machine, support, q[i], 1.01 * most[i] + 1.0, T) < least
        tried += 1
    for i in np.flatnonzero(most == 0.0):
        assert at_rest(machine, support, q[i], 0.0, T) < least
    for i in np.flatnonzero(np.isinf(most)):
        assert at_rest(machine, support, q[i], 1e9, T) > least
    assert tried > 20


def test_a_chart_is_the_capacity_where_the_tip_hangs(ex13):
    support = support_polygon(ex13)
    azimuths, reaches = np.linspace(-np.pi, np.pi, 9), np.linspace(3.0, 9.0, 13)
    chart = capacity_chart(ex13, support, azimuths, reaches, 0.5, ATTITUDE)
    assert np.isnan(chart.payload[:, -1]).all()  # out of reach
    can = ~np.isnan(chart.payload)
    assert can.sum() > 50
    # Statics by hand: the tip's load against the machine's own weight, about the front edge.
    front = chart.payload[4]
    model, edge = mass_model(ex13), support.vertices[:, 0].max()
    for j in np.flatnonzero(can[4] & np.isfinite(front)):
        q = inverse(ex13, np.array([reaches[j], 0.0, 2.05]), ATTITUDE).q
        assert end_point(ex13, q)[:2] == pytest.approx([reaches[j], 0.0], abs=1e-9)
        own = model.total * (edge - zmp(model, q, 0 * q, 0 * q)[0])
        assert front[j] == pytest.approx(own / (reaches[j] - edge), rel=1e-9)


def test_more_hangs_near_than_far_and_over_the_front_than_the_side(ex13):
    support = support_polygon(ex13)
    chart = capacity_chart(
        ex13, support, np.array([0.0, 0.5 * np.pi]), np.linspace(3.5, 7.0, 15), 0.5, ATTITUDE
    )
    can = ~np.isnan(chart.payload).any(axis=0)
    front, side = chart.payload[:, can]
    assert (np.diff(front) < 0.0).all()
    assert (np.diff(side) < 0.0).all()
    assert (front > side).all()
    reach = farthest(chart, 2500.0)
    assert reach[0] > reach[1] > 3.5
    assert np.isnan(farthest(chart, 1e6)).all()


def test_downhill_less_hangs_than_uphill(ex13, slope):
    support, azimuths = support_polygon(ex13), np.array([0.0, np.pi])
    chart = capacity_chart(
        ex13, support, azimuths, np.array([5.0, 6.0]), 0.5, ATTITUDE, slope(0.0, -0.15, 0.0)
    )
    assert (chart.payload[0] < chart.payload[1]).all()


STRETCHED = np.radians([90.0, 20.0, -40.0, -20.0])
FOLDED = np.radians([0.0, 50.0, -140.0, -60.0])
DELAY, LAG = 0.2, 0.08


def least_moment(machine, model, support, q, rates, k, speed, T=None):
    """Direct: it starts and brakes, at once and after the delay; the others go on or brake."""
    v = np.array(rates)
    v[k] = speed
    a = np.minimum(machine.max_acceleration, np.abs(v) / LAG)
    waited = np.clip(q + DELAY * v, machine.lower, machine.upper)
    way = v * np.abs(v) / (2.0 * machine.max_acceleration)
    stood = np.clip(waited + way, machine.lower, machine.upper)
    least = np.inf
    for place, rate in ((q, v), (waited, v), (stood, 0 * v)):
        for own in (-1.0, 1.0):
            for others in (0.0, 1.0):
                qdd = -np.sign(v) * a * others
                qdd[k] = own * a[k]
                least = min(least, edge_moments(model, support, place, rate, qdd, T).min())
    return least


@pytest.mark.parametrize("payload", [0.0, 1500.0, 2500.0])
def test_an_allowed_speed_tips_nothing_and_a_higher_one_does(ex13, draw, payload):
    random = np.random.default_rng(11)
    model, support = mass_model(ex13, payload), shrunk(support_polygon(ex13), 0.2)
    q, rates, _ = draw(ex13, random, 12)
    scale = model.total * 9.81 * support.inradii.min()
    between = 0
    for one, now in zip(q, 0.4 * rates, strict=True):
        got = allowed_fractions(ex13, model, support, one, now, DELAY, LAG)
        home = brings_home(model, support, one)
        for k, side in np.ndindex(got.shape):
            if home[k, side] and got[k, side] == CREEP:
                continue
            full = (-1.0, 1.0)[side] * ex13.max_velocity[k]
            args = ex13, model, support, one, now, k
            if got[k, side] > 0.0:
                assert least_moment(*args, got[k, side] * full) > -0.02 * scale
            if 0.0 < got[k, side] < 1.0:
                between += 1
                tried = [least_moment(*args, x * full) for x in np.linspace(got[k, side], 1.0, 12)]
                assert min(tried) < 0.0
    assert between > 2 or payload == 0.0


def test_a_folded_machine_is_free_and_a_stretched_loaded_one_is_not(ex13):
    support, still = shrunk(support_polygon(ex13), 0.2), np.zeros(4)
    light, heavy = mass_model(ex13), mass_model(ex13, 3500.0)
    assert (allowed_fractions(ex13, light, support, FOLDED, still, DELAY, LAG) == 1.0).all()
    got = allowed_fractions(ex13, heavy, support, STRETCHED, still, DELAY, LAG)
    home = brings_home(heavy, support, STRETCHED)
    assert (got[~home] == 0.0).all()
    assert (got[home] >= CREEP).all()
    assert home[2, 0]  # stick in
    assert not home[2, 1]


def test_a_heavier_load_never_allows_more(ex13, draw):
    q, _, _ = draw(ex13, np.random.default_rng(12), 10)
    support, still = shrunk(support_polygon(ex13), 0.1), np.zeros(4)
    sums = []
    for payload in (0.0, 1000.0, 2000.0, 4000.0):
        model = mass_model(ex13, payload)
        found = [allowed_fractions(ex13, model, support, one, still, DELAY, LAG) for one in q]
        sums.append(float(np.sum(found)))
    assert sums == sorted(sums, reverse=True)
    assert sums[-1] < 0.8 * sums[0]
