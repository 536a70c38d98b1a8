"""Postures a resting machine would tip over in: one by one, and whole cells of joint space."""

from __future__ import annotations

import numpy as np
import pytest

from backend.cspace.exact import JointGrid
from backend.stability.masses import mass_model
from backend.stability.polygon import shrunk, support_polygon
from backend.stability.resting import CENTRE, MAYBE, WHOLE, cells, resting, tips
from backend.stability.zmp import edge_moments

KEEP = 0.1
LOADS = {"mini": 1200.0, "ex13": 5000.0, "rail6": 4000.0}


def moments(machine, payload, q, T):
    model = mass_model(machine, payload)
    still = np.zeros_like(q)
    support = shrunk(support_polygon(machine), KEEP)
    return edge_moments(model, support, q, still, still, T).min(axis=-1)


def test_postures_are_judged_by_the_same_moments(machine, draw, slope):
    q, _, _ = draw(machine, np.random.default_rng(1), 3000)
    payload = LOADS[machine.name]
    for T in (None, slope(0.4, 0.12, -0.08)):
        expected = moments(machine, payload, q, T) < 0.0
        assert 0.02 < expected.mean() < 0.98
        np.testing.assert_array_equal(tips(resting(machine, payload, KEEP, T), q), expected)


@pytest.mark.parametrize("held", [(), (0,), (0, 1)])
def test_a_certificate_holds_all_over_its_cell(machine, draw, slope, held):
    random = np.random.default_rng(2)
    q = draw(machine, random, 1)[0][0]
    payload, T = LOADS[machine.name], slope(-0.3, 0.05, 0.1)
    lower = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)[:4]
    upper = np.where(np.isfinite(machine.upper), machine.upper, np.pi)[:4]
    shape = [30 if held else 12] * 4
    for k in held:
        lower[k] = upper[k] = q[k]
        shape[k] = 1
    slack = np.full(4, 0.01)
    found = cells(resting(machine, payload, KEEP, T), lower, upper, tuple(shape), q, slack)
    grid = JointGrid(lower, upper, tuple(shape))
    at = np.stack([random.integers(0, n, 20000) for n in shape], axis=1)
    codes = found[tuple(at.T)]
    centres = np.repeat(q[None], len(at), axis=0)
    centres[:, :4] = lower + (at + 0.5) * grid.steps
    np.testing.assert_array_equal((codes & CENTRE) > 0, moments(machine, payload, centres, T) < 0.0)
    inside = centres.copy()
    inside[:, :4] += random.uniform(-0.5, 0.5, at.shape) * grid.steps
    left = moments(machine, payload, inside, T)
    assert not (left[(codes & WHOLE) > 0] >= 0.0).any()
    inside[:, :4] += random.uniform(-1.0, 1.0, at.shape) * slack
    assert not (moments(machine, payload, inside, T)[(codes & MAYBE) == 0] < 0.0).any()
    if held != (0, 1):
        assert ((codes & WHOLE) > 0).any()
    if held == (
        0,
    ):  # cells of 30 degrees of swing are too coarse for a bound to say that all stands
        assert (codes == 0).any()
    assert (codes & MAYBE)[(codes & CENTRE) > 0].all()


def test_a_cell_of_no_width_is_decided(ex13, draw):
    q = draw(ex13, np.random.default_rng(3), 1)[0][0]
    found = cells(resting(ex13, 0.0, KEEP), q[:4], q[:4], (1, 1, 1, 1), q, np.zeros(4))
    assert found.ravel()[0] in (0, CENTRE | MAYBE | WHOLE)
