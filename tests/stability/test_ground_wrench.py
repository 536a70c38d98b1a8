"""The ground's wrench against momenta differentiated in time, and the masses behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from momentum import centre, link_masses, momenta

from backend.errors import InputError
from backend.stability.dynamics import centre_of_mass, ground_wrench
from backend.stability.masses import GRAVITY, mass_model, why_unknown
from backend.stability.wrench_kernel import wrenches


@pytest.mark.parametrize("payload", [0.0, 400.0])
def test_the_wrench_is_the_rate_of_change_of_momenta(machine, draw, payload):
    q, qd, qdd = draw(machine, np.random.default_rng(3), 40)
    model = mass_model(machine, payload)
    h = 1e-4

    def after(t):
        return momenta(machine, q + qd * t + 0.5 * qdd * t**2, qd + qdd * t, payload)

    rates = [(b - a) / (2.0 * h) for a, b in zip(after(-h), after(h), strict=True)]
    weight = np.array([0.0, 0.0, -GRAVITY]) * sum(m for _, m, _, _ in link_masses(machine, payload))
    f, tau = ground_wrench(model, q, qd, qdd)
    np.testing.assert_allclose(f, rates[0] - weight, atol=1e-6 * abs(weight[2]))
    turning = rates[1] - np.cross(centre(machine, q, payload), weight)
    np.testing.assert_allclose(tau, turning, atol=1e-6 * abs(weight[2]))
    assert np.abs(rates[1]).max() > 1e-2 * abs(weight[2])  # it did move


def test_the_centre_of_mass_is_that_of_all_links(machine, draw):
    q, _, _ = draw(machine, np.random.default_rng(4), 30)
    got = centre_of_mass(mass_model(machine, 250.0), q)
    np.testing.assert_allclose(got, centre(machine, q, 250.0), atol=1e-12)


def test_on_a_slope_the_same_weight_pulls_another_way(machine, draw, slope):
    q, _, _ = draw(machine, np.random.default_rng(5), 10)
    T = slope(0.7, 0.2, -0.1)
    model = mass_model(machine)
    f, _ = ground_wrench(model, q, 0 * q, 0 * q, T)
    upwards = f @ T[:3, :3].T
    wanted = np.broadcast_to([0.0, 0.0, model.total * GRAVITY], upwards.shape)
    np.testing.assert_allclose(upwards, wanted, atol=1e-9 * model.total)


def test_an_accelerated_base_is_a_machine_in_a_tilted_field(machine, draw):
    """Everything is carried along: f grows by M a, the moment by that of M a at the centre."""
    q, qd, qdd = draw(machine, np.random.default_rng(6), 10)
    model, a = mass_model(machine), np.array([0.8, -0.3, 0.1])
    f0, tau0 = ground_wrench(model, q, qd, qdd)
    f1, tau1 = ground_wrench(model, q, qd, qdd, base_acceleration=a)
    np.testing.assert_allclose(f1 - f0, np.broadcast_to(model.total * a, f0.shape), rtol=1e-9)
    np.testing.assert_allclose(
        tau1 - tau0, np.cross(centre_of_mass(model, q), model.total * a), atol=1e-6
    )


def test_leading_axes_broadcast(ex13, draw, slope):
    q, qd, qdd = draw(ex13, np.random.default_rng(7), 6)
    model = mass_model(ex13)
    T = np.stack([slope(0.1, 0.1, 0.0), slope(0.4, -0.2, 0.1)])
    got = ground_wrench(model, q[:, None], qd[:, None], qdd[:, None], T)
    for i in range(6):
        for j in range(2):
            one = ground_wrench(model, q[i], qd[i], qdd[i], T[j])
            np.testing.assert_allclose(got.f[i, j], one.f, rtol=1e-12)
            np.testing.assert_allclose(got.tau[i, j], one.tau, rtol=1e-12, atol=1e-6)


def test_nothing_is_concluded_from_masses_nobody_trusts(ex13):
    assert why_unknown(ex13) == ""
    doubted = replace(ex13, masses_trusted=False)
    assert "not trusted" in why_unknown(doubted)
    with pytest.raises(InputError, match="not trusted"):
        mass_model(doubted)


def test_a_body_without_a_mass_is_named(ex13):
    links = list(ex13.links)
    k = next(i for i, link in enumerate(links) if link.part == "stick")
    links[k] = replace(links[k], inertia=None)
    assert f"link '{links[k].name}'" in why_unknown(replace(ex13, links=tuple(links)))


@pytest.mark.parametrize("payload", [-1.0, np.nan, np.inf])
def test_a_payload_is_a_mass(ex13, payload):
    with pytest.raises(InputError, match="payload"):
        mass_model(ex13, payload)


def test_a_payload_hangs_where_it_is_said_to(ex13, draw):
    q, _, _ = draw(ex13, np.random.default_rng(8), 5)
    here = ex13.links[ex13.end_link].inertia.com
    empty, at_com, at_tip = (mass_model(ex13, *args) for args in ((0.0,), (500.0, here), (500.0,)))
    moved = [m.total * centre_of_mass(m, q) for m in (empty, at_com, at_tip)]
    way = np.linalg.norm(moved[2] - moved[1], axis=1)
    np.testing.assert_allclose(way, 500.0 * np.linalg.norm(ex13.end_point - here), rtol=1e-9)


def test_it_is_compiled_once_whatever_arrays_are_given(ex13):
    model = mass_model(ex13)
    plain = np.zeros((3, 4))
    fixed = plain.copy()
    fixed.setflags(write=False)
    for q in (plain, fixed, np.asfortranarray(plain), np.zeros((6, 4))[::2], plain[:1], fixed[0]):
        for rates in (plain, fixed):
            ground_wrench(model, q, rates, np.broadcast_to(fixed[0], (3, 4)))
    assert len(wrenches.signatures) == 1
