"""Sensors against the fusion's own reading of them, and the noise that is asked for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from backend.errors import InputError
from backend.fusion.rig import make_rig
from backend.fusion.samples import AttitudeSample, FixSample, HeadingSample, JointSample
from backend.fusion.streams import Streams, ingest
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


def test_strokes_stand_in_for_the_angles_of_joints_with_cylinders():
    site, errors = noiseless(), []
    for machine, q in ((MACHINE, STATE.q), (load_machine("ex13"), [2.9, 1.082104, -0.6, 0.6])):
        state = replace(STATE, q=np.array(q))
        (measure,) = (
            s.measure for s in sensors(machine, site, "strokes") if s.topic == "joint_states"
        )
        got = decode("left", "joint_states", measure(state, STAMP, np.random.default_rng(0)), 0.0)
        assert got.names == ("swing_joint", "boom_cylinder", "stick_cylinder", "bucket_cylinder")
        assert (np.abs(got.position[1:]) < 3.0).all()
        rig = make_rig("left", machine, site.frame)
        (entry,) = ingest(rig, Streams(), got).joints.entries
        errors += [np.subtract(entry.value, state.q), np.subtract(entry.velocity, state.qd)]
    np.testing.assert_allclose(errors, 0.0, atol=1e-9)


def test_noise_of_strokes_is_that_of_the_angles():
    (measure,) = (s.measure for s in sensors(MACHINE, SITE, "strokes") if s.topic == "joint_states")
    rng, rig, found = np.random.default_rng(1), make_rig("left", MACHINE, SITE.frame), []
    stopped = replace(STATE, q=np.array([0.7, 1.396263, -0.436332, 0.872665]))  # all at their ends
    for state in (STATE, stopped):
        for _ in range(150):
            got = decode("left", "joint_states", measure(state, STAMP, rng), 0.0)
            (entry,) = ingest(rig, Streams(), got).joints.entries
            found.append(np.subtract(entry.value, state.q))
    np.testing.assert_allclose(np.degrees(np.std(found, axis=0)), 0.05, rtol=0.15)


def test_strokes_without_a_cylinder_are_refused():
    with pytest.raises(InputError, match='describes no cylinder; allowed is "angles"'):
        sensors(replace(MACHINE, strokes=()), SITE, "strokes")


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
