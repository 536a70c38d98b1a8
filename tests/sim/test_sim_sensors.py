"""Sensors against the fusion's own reading of them, and the noise that is asked for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.fusion.samples import AttitudeSample, FixSample, HeadingSample, JointSample
from backend.machine.load import load_machine
from backend.shell.link.codec import decode
from backend.shell.link.topics import key
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.sensors import antenna_position, heading_of, sensors
from backend.site.site import load_site
from backend.spatial.angles import difference
from backend.spatial.rotation import from_quaternion, to_attitude

SITE = load_site("demo")
MACHINE = load_machine("mini")
STATE = SimState(
    np.array([0.7, 0.5, -1.0, 0.2]),
    np.array([0.1, 0.0, -0.2, 0.0]),
    np.array([4.0, 2.0, 0.5]),
    1.2,
    0.05,
    -0.03,
    np.zeros(2),
)
STAMP = 1.7e9


def read(site, machine=MACHINE, state=STATE, seed=0):
    rng = np.random.default_rng(seed)
    return {
        s.topic: decode(
            "left", key(s.topic, "x", **s.fields)[2:], s.measure(state, STAMP, rng), 0.0
        )
        for s in sensors(machine, site)
    }


def noiseless():
    still = SITE.sim.model_copy(
        update={"position_noise": 0.0, "heading_noise_deg": 0.0, "joint_noise_deg": 0.0}
    )
    return replace(SITE, sim=still)


def test_without_noise_the_truth_is_published():
    got = read(noiseless())
    joints, fix, heading, imu = (
        got[k] for k in ("joint_states", "gnss_fix", "gnss_heading", "imu")
    )
    assert isinstance(joints, JointSample)
    assert joints.names == tuple(j.name for j in MACHINE.joints)
    np.testing.assert_array_equal(joints.position, STATE.q)
    np.testing.assert_array_equal(joints.velocity, STATE.qd)
    assert isinstance(fix, FixSample)
    back = SITE.frame.from_geodetic(fix.latitude, fix.longitude, fix.altitude)
    np.testing.assert_allclose(back, antenna_position(MACHINE, STATE), atol=1e-6)
    assert isinstance(heading, HeadingSample)
    assert abs(float(difference(heading.heading, heading_of(MACHINE, STATE)))) < 1e-9
    assert isinstance(imu, AttitudeSample)
    assert imu.link == "base"
    _, pitch, roll = to_attitude(from_quaternion(imu.orientation))
    assert (float(pitch), float(roll)) == pytest.approx((0.05, -0.03), abs=0.006)


def test_heading_of_the_upper_body_on_level_ground_is_yaw_plus_swing():
    level = replace(STATE, pitch=0.0, roll=0.0)
    expected = level.yaw + level.q[0] + MACHINE.heading_offset
    assert abs(float(difference(heading_of(MACHINE, level), expected))) < 1e-12
    of_tracks = replace(MACHINE, heading_of="tracks", heading_offset=0.3)
    assert heading_of(of_tracks, level) == pytest.approx(level.yaw + 0.3)


def test_true_north_headings_lack_the_convergence():
    true = replace(noiseless(), frame=replace(SITE.frame, heading_reference="true"))
    heading = read(true)["gnss_heading"].heading
    assert abs(math.degrees(true.frame.convergence(STATE.position))) > 1.0
    back = true.frame.grid_yaw(heading, STATE.position)
    assert abs(float(difference(back, heading_of(MACHINE, STATE)))) < 1e-6


def test_noise_is_what_the_site_asks_for():
    runs = [read(SITE, seed=i) for i in range(300)]
    joints = np.array([r["joint_states"].position - STATE.q for r in runs])
    headings = np.array([r["gnss_heading"].heading - heading_of(MACHINE, STATE) for r in runs])
    points = np.array(
        [
            SITE.frame.from_geodetic(f.latitude, f.longitude, f.altitude)
            for f in (r["gnss_fix"] for r in runs)
        ]
    )
    assert np.degrees(joints.std()) == pytest.approx(0.05, rel=0.1)
    assert np.degrees(headings.std()) == pytest.approx(0.1, rel=0.2)
    errors = points - antenna_position(MACHINE, STATE)
    np.testing.assert_allclose(errors.std(axis=0), 0.02, rtol=0.2)
    np.testing.assert_allclose(errors.mean(axis=0), 0.0, atol=0.006)
    np.testing.assert_allclose(runs[0]["gnss_fix"].covariance, np.eye(3) * 0.02**2)


def test_rates_are_those_of_the_paper():
    periods = {s.topic: s.period for s in sensors(MACHINE, SITE)}
    assert periods["joint_states"] == 0.005
    assert periods["gnss_fix"] == 0.05
