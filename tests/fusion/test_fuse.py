from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from fusion_world import Motion, World, arrival, feed, pose_at
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.fusion.fuse import common_time, fuse
from backend.fusion.pose import Validity
from backend.fusion.rig import FusionConfig, Rig, make_rig
from backend.fusion.samples import Fix, HeadingSample, JointSample
from backend.fusion.streams import Streams, ingest
from backend.machine.model import Antenna

MOVING = Motion(yaw=3.1, yaw_rate=0.2, velocity=(0.4, -0.3, 0.0), rates=(0.5, 0.2, -0.3, 0.1))
within = st.floats(-math.pi, math.pi)
no_reset = [HealthCheck.function_scoped_fixture]


@given(
    yaw=within,
    swing=within,
    pitch=st.floats(-0.3, 0.3),
    roll=st.floats(-0.3, 0.3),
    of=st.sampled_from(["tracks", "upper"]),
    offset=within,
    link=st.sampled_from([0, 1]),
    skew=st.floats(-5.0, 5.0),
)
@settings(max_examples=15, deadline=None, suppress_health_check=no_reset)
def test_a_standing_machine_is_where_it_is(
    varied: Callable[..., Rig],
    yaw: float,
    swing: float,
    pitch: float,
    roll: float,
    of: str,
    offset: float,
    link: int,
    skew: float,
) -> None:
    antenna = Antenna(link, np.array([-0.4, 0.3, 1.6]))
    rig = varied(antenna=antenna, heading_of=of, heading_offset=offset)
    motion = Motion(yaw=yaw, pitch=pitch, roll=roll, joints=(swing, 0.5, -1.2, 0.3))
    world = World(rig, motion=motion, skew=skew, imus=("base",))
    pose = pose_at(rig, feed(rig, world.samples(0.0, 0.6)), 0.66)
    assert pose.validity is Validity.VALID, pose.reasons
    np.testing.assert_allclose(pose.position, motion.position, atol=1e-5)
    assert math.remainder(pose.yaw - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(pose.joints, motion.joints, atol=1e-9)
    assert not pose.base_velocity.any()


@pytest.mark.parametrize("with_velocity", [True, False])
def test_everything_is_brought_to_one_time(rig: Rig, with_velocity: bool) -> None:
    world = World(rig, motion=MOVING, with_velocity=with_velocity, skew=-2.0)
    streams = feed(rig, world.samples(0.0, 1.03))
    pose = pose_at(rig, streams, 1.09)
    assert pose.validity is Validity.VALID
    assert pose.time == pytest.approx(1.02, abs=2e-3)
    np.testing.assert_allclose(pose.joints, MOVING.q(pose.time), atol=2e-3)
    np.testing.assert_allclose(pose.joint_velocities, MOVING.rates, atol=1e-6)
    np.testing.assert_allclose(pose.position, MOVING.T(pose.time)[:3, 3], atol=5e-3)
    np.testing.assert_allclose(pose.base_velocity, MOVING.velocity, atol=5e-3)
    yaw = MOVING.yaw + MOVING.yaw_rate * pose.time
    assert math.remainder(pose.yaw - yaw, 2 * math.pi) == pytest.approx(0.0, abs=2e-3)


def test_a_swinging_antenna_does_not_move_the_base(rig: Rig) -> None:
    motion = Motion(rates=(0.9, 0.0, 0.0, 0.0))
    world = World(rig, motion=motion)
    streams = feed(rig, world.samples(0.0, 2.0))
    lever = np.linalg.norm(rig.machine.antenna.position[:2])
    assert 0.9 * lever > 0.3  # the antenna itself moves this fast [m/s]
    pose = pose_at(rig, streams, 2.05)
    np.testing.assert_allclose(pose.position, motion.position, atol=2e-3)
    assert np.linalg.norm(pose.base_velocity) < 0.02


def test_rates_across_the_wrap_are_exact(rig: Rig) -> None:
    """Swing crosses +-180 deg while no velocity is published."""
    motion = Motion(joints=(math.pi - 0.15, 0.5, -1.2, 0.3), rates=(0.3, 0.0, 0.0, 0.0))
    world = World(rig, motion=motion)
    streams = Streams()
    for sample in world.samples(0.0, 1.2):
        if isinstance(sample, JointSample):
            wrapped = sample.position.copy()
            wrapped[0] = math.remainder(wrapped[0], 2 * math.pi)
            sample = replace(sample, position=wrapped)
        streams = ingest(rig, streams, sample)
        if arrival(sample) > 0.3 and isinstance(sample, JointSample):
            pose = pose_at(rig, streams, arrival(sample))
            assert pose.joint_velocities[0] == pytest.approx(0.3, abs=1e-6)
            assert math.remainder(pose.joints[0] - motion.q(pose.time)[0], 2 * math.pi) < 2e-3


def test_true_north_headings_are_turned_to_the_grid(varied: Callable[..., Rig]) -> None:
    frame = SiteFrame(32652, (308600.0, 4129950.0, 0.0), heading_reference="true")
    rig = varied(frame=frame)
    convergence = frame.convergence(np.array([5.0, 2.0, 0.4]))
    assert math.degrees(convergence) == pytest.approx(-1.31, abs=0.005)
    world = World(rig, convergence=-convergence)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 0.5)), 0.55)
    assert pose.yaw == pytest.approx(1.0, abs=1e-6)
    np.testing.assert_allclose(pose.position, world.motion.position, atol=1e-5)


def test_unknown_until_every_stream_was_seen(rig: Rig) -> None:
    streams = Streams()
    assert pose_at(rig, streams, 0.0).reasons == (
        "has sent no joint angles yet",
        "has sent no position yet",
        "has sent no heading yet",
    )
    world = World(rig)
    streams = feed(rig, [world.joint(0.0), world.gnss(0.0)])
    pose = pose_at(rig, streams, 0.07)
    assert pose.validity is Validity.UNKNOWN
    assert pose.reasons == ("has sent no heading yet",)
    assert pose_at(rig, feed(rig, [world.heading(0.0)], streams), 0.07).validity is Validity.VALID


@pytest.mark.parametrize(
    ("kind", "key", "limit", "words"),
    [
        ("JointSample", "joints", 0.2, "joint angles are"),
        ("FixSample", "position", 0.3, "position is"),
        ("HeadingSample", "heading", 0.3, "heading is"),
    ],
)
def test_a_stopped_stream_is_stale_in_time(
    rig: Rig, kind: str, key: str, limit: float, words: str
) -> None:
    world = World(rig, latency=0.08)
    samples = world.samples(0.0, 3.0)
    last = 2.0
    streams = Streams()
    became = math.inf
    queue = [s for s in samples if type(s).__name__ != kind or s.stamp <= last]
    now = 1.5
    while now < 3.0:
        while queue and arrival(queue[0]) <= now:
            streams = ingest(rig, streams, queue.pop(0))
        pose = pose_at(rig, streams, now)
        if pose.validity is not Validity.VALID:
            assert now - last > 0.15, pose.reasons
            became = min(became, now)
            assert pose.validity is Validity.STALE
            assert pose.reasons[0].startswith(words)
            assert pose.streams[key].age > limit
        now += 0.01
    assert became - last <= limit + 0.02


def test_slow_receivers_are_given_three_periods(rig: Rig) -> None:
    world = World(rig)
    slow = [
        s
        for s in world.samples(0.0, 3.0)
        if type(s).__name__ not in ("FixSample", "HeadingSample") or round(s.stamp * 20) % 4 == 0
    ]
    streams = feed(rig, [s for s in slow if arrival(s) < 2.5 and getattr(s, "stamp", 0) <= 2.0])
    joints = [s for s in slow if isinstance(s, JointSample) and s.stamp > 2.0]
    at = {
        age: feed(rig, [s for s in joints if s.stamp < 2.0 + age - 0.06], streams)
        for age in (0.5, 0.7)
    }
    assert pose_at(rig, at[0.5], 2.5).validity is Validity.VALID
    assert pose_at(rig, at[0.7], 2.7).validity is Validity.STALE


@pytest.mark.parametrize("skew", [5.0, -5.0, 0.0])
def test_ages_are_right_under_clock_skew(rig: Rig, skew: float) -> None:
    world = World(rig, skew=skew)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 2.0)), 2.05)
    status = pose.streams["joints"]
    assert status.age_source == "offset"
    assert status.age == pytest.approx(2.05 - 1.99, abs=3e-3)
    assert status.age >= 2.05 - 1.99
    assert pose.clock_offset is not None
    assert pose.clock_offset[0] <= skew <= pose.clock_offset[1]


def test_without_round_trips_arrival_ages_are_flagged(rig: Rig) -> None:
    world = World(rig, skew=5.0, clock=False)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 2.0)), 2.1)
    assert pose.validity is Validity.VALID
    assert pose.clock_offset is None
    status = pose.streams["joints"]
    assert status.age_source == "arrival"
    assert status.age == pytest.approx(2.1 - (1.99 + world.latency), abs=1e-9)


@pytest.mark.parametrize("jump", [5.0, -5.0, 0.5, -0.5])
@pytest.mark.parametrize("clock", [True, False])
def test_a_clock_step_is_flagged_within_a_second_and_survived(
    rig: Rig, jump: float, clock: bool
) -> None:
    before = World(rig, skew=1.0, clock=clock)
    queue = before.samples(0.0, 3.01) + replace(before, skew=1.0 + jump).samples(3.02, 6.0)
    streams = Streams()
    history = []
    now = 2.0
    while now < 6.0:
        while queue and arrival(queue[0]) <= now:
            streams = ingest(rig, streams, queue.pop(0))
        history.append((now, pose_at(rig, streams, now)))
        now += 0.02
    bad = [t for t, pose in history if pose.validity is not Validity.VALID]
    if clock or abs(jump) > 1.0:
        assert 3.0 < bad[0] <= 4.0
        flagged = [t for t, pose in history if "clock was stepped" in " ".join(pose.reasons)]
        assert flagged[0] <= 4.1
    assert history[-1][1].validity is Validity.VALID
    assert history[-1][1].streams["joints"].age < 0.1


def test_fix_types_grow_sigma_and_inhibit(rig: Rig) -> None:
    found = {}
    for fix in Fix:
        world = World(rig, fix=fix, covariance=0.0)
        pose = pose_at(rig, feed(rig, world.samples(0.0, 1.0)), 1.05)
        found[fix] = pose
        assert pose.fix is fix
    assert found[Fix.RTK_FIXED].sigma_position < found[Fix.RTK_FLOAT].sigma_position < 0.5
    assert found[Fix.RTK_FLOAT].validity is Validity.VALID
    assert found[Fix.SINGLE].validity is Validity.UNKNOWN
    assert found[Fix.SINGLE].reasons == ("position is known to 2.50 m, limit 0.50 m",)
    assert found[Fix.NONE].validity is Validity.UNKNOWN
    strict = make_rig("left", rig.machine, rig.frame, FusionConfig(sigma_limit=0.1))
    world = World(strict, fix=Fix.RTK_FLOAT, covariance=0.0)
    assert pose_at(strict, feed(strict, world.samples(0.0, 1.0)), 1.05).validity is Validity.UNKNOWN


def test_losing_the_fix_is_known_at_once_and_the_place_stays_for_drawing(rig: Rig) -> None:
    world = World(rig)
    streams = feed(rig, world.samples(0.0, 1.0))
    streams = ingest(rig, streams, replace(world.gnss(1.0), fix=Fix.NONE, latitude=math.nan))
    pose = pose_at(rig, streams, 1.06)
    assert (pose.validity, pose.fix, pose.reasons) == (
        Validity.UNKNOWN,
        Fix.NONE,
        ("has no GNSS fix",),
    )
    np.testing.assert_allclose(pose.position, world.motion.position, atol=1e-5)
    again = feed(rig, [world.gnss(1.05)], streams)
    assert pose_at(rig, again, 1.12).validity is Validity.VALID


def test_a_receiver_cannot_claim_more_than_its_fix_allows(rig: Rig) -> None:
    world = World(rig, fix=Fix.RTK_FLOAT, covariance=1e-8)
    pose = pose_at(rig, feed(rig, world.samples(0.0, 1.0)), 1.05)
    assert pose.sigma_position >= 0.10


def test_sigma_takes_the_worst_axis_and_the_lever(rig: Rig) -> None:
    world = World(rig)
    streams = Streams()
    for sample in world.samples(0.0, 1.0):
        if type(sample).__name__ == "FixSample":
            sample = replace(sample, covariance=np.diag([0.01, 0.04, 0.09]) ** 2)
        if isinstance(sample, HeadingSample):
            sample = replace(sample, variance=0.02**2)
        streams = ingest(rig, streams, sample)
    pose = fuse(rig, streams, 1.05, 0.95)
    lever = math.hypot(*rig.machine.antenna.position[:2])
    yaw = math.hypot(0.02, rig.config.sigma_joints)  # heading of the upper body, less the swing
    assert pose.sigma_yaw == pytest.approx(yaw, rel=1e-6)
    assert pose.sigma_position == pytest.approx(math.hypot(0.09, yaw * lever), rel=1e-3)


def test_sigma_grows_with_extrapolation(rig: Rig) -> None:
    streams = feed(rig, World(rig, motion=MOVING).samples(0.0, 1.0))
    sigmas = [
        (pose.sigma_position, pose.sigma_yaw, pose.sigma_joints)
        for pose in (fuse(rig, streams, 1.5, t) for t in (0.95, 1.05, 1.15, 1.3, 1.5))
    ]
    for earlier, later in pairwise(sigmas):
        assert all(a <= b for a, b in zip(earlier, later, strict=True))
    assert sigmas[-1][0] > sigmas[0][0] + 0.05


def test_extrapolation_stops_at_its_limit(rig: Rig) -> None:
    streams = feed(rig, World(rig, motion=MOVING).samples(0.0, 1.0))
    poses = [fuse(rig, streams, 3.0, t) for t in (1.2, 1.5, 3.0)]
    np.testing.assert_allclose(poses[0].joints, poses[2].joints)
    np.testing.assert_allclose(poses[0].joints, MOVING.q(0.99 + 0.1), atol=1e-6)


def test_common_time_never_runs_backward_nor_ahead(rig: Rig) -> None:
    fast, slow = World(rig, latency=0.03, skew=2.0), World(rig, latency=0.19, skew=-3.0)
    queues = [fast.samples(0.0, 3.0), slow.samples(0.0, 3.0)]
    queues[1] = [s for s in queues[1] if not 1.0 < arrival(s) < 1.8]
    streams = [Streams(), Streams()]
    previous, now = -math.inf, 0.5
    while now < 3.0:
        for k, queue in enumerate(queues):
            while queue and arrival(queue[0]) <= now:
                streams[k] = ingest(rig, streams[k], queue.pop(0))
        common = common_time([(rig, s) for s in streams], now, previous)
        assert previous <= common <= now
        if now > 2.2:
            slowest = streams[1].joints.entries[-1].stamp - 3.0
            assert common <= slowest + rig.config.max_extrapolation + 3e-3
        previous = common
        now += 0.02


def test_common_time_with_nobody_alive(rig: Rig) -> None:
    assert common_time([(rig, Streams())], 7.0) == 7.0
    assert common_time([(rig, Streams())], 7.0, 6.5) == 6.5


@pytest.mark.parametrize("clocks", [(True, True), (True, False), (False, True), (False, False)])
@pytest.mark.parametrize("pause", [0.3, 60.0])
def test_a_machine_that_is_started_again_recovers_by_itself(
    rig: Rig, pause: float, clocks: tuple[bool, bool]
) -> None:
    """Killed, then started again with a clock that counts from zero anew."""
    first = World(rig, clock=clocks[0])
    again = 2.0 + pause
    second = replace(first, skew=again, clock=clocks[1])
    streams = feed(rig, first.samples(0.0, 2.0))
    dead = pose_at(rig, streams, again)
    assert dead.validity is Validity.STALE
    np.testing.assert_allclose(dead.position, first.motion.position, atol=1e-5)
    # Old round trips vouch for the old clock for 10 s where no new ones come.
    end = again + (11.0 if clocks == (True, False) else 2.0)
    streams = feed(rig, second.samples(again, end), streams)
    pose = pose_at(rig, streams, end + 0.05)
    assert pose.validity is Validity.VALID, pose.reasons
    assert pose.streams["joints"].age < 0.1


def test_an_antenna_on_the_arm_is_refused(varied: Callable[..., Rig]) -> None:
    with pytest.raises(InputError, match='sits on "boom_link"'):
        varied(antenna=Antenna(2, np.zeros(3)))
