"""Cylinders' strokes among the joint angles of a JointState."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fusion_world import Motion, World, feed, pose_at

from backend.fusion.inflation import joint_slack, spread
from backend.fusion.plausible import Entry
from backend.fusion.pose import FusedPose, Validity
from backend.fusion.rig import Rig
from backend.fusion.samples import JointSample, Sample
from backend.fusion.streams import Streams, ingest
from backend.machine.strokes import position as reading

NAMES = ("bucket_cylinder", "swing_joint", "arm_cylinder", "boom")
Q = {"swing": 0.3, "boom": 0.5, "stick": -1.2, "bucket": 0.3}


def in_plane(point: tuple[float, float], turned: float) -> np.ndarray:
    """(x, z) turned up by an angle, as the mini's joints do."""
    c, s = math.cos(turned), math.sin(turned)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])


def stick_length(q: float) -> float:
    """Of the mini's stick cylinder, from the pins in its sidecar."""
    return float(np.linalg.norm(np.array([1.72, 0.0]) + in_plane((-0.23, 0.09), q) - (0.78, 0.28)))


CLOSED = stick_length(-0.436332)  # the stick stretched out as far as it goes: the shortest


def sample(
    names: tuple[str, ...], position: list[float], velocity: list[float] | None = None
) -> JointSample:
    return JointSample("left", 0.0, 0.05, names, np.array(position), np.array(velocity or []))


def first(rig: Rig, given: JointSample) -> Entry:
    return ingest(rig, Streams(), given).joints.entries[0]


def read(rig: Rig, name: str, q: float) -> float:
    """What the sensor of a cylinder of the mini reads at a joint value."""
    stroke = next(s for s in rig.machine.strokes if name in s.names)
    return float(reading(stroke, q))


def test_strokes_and_angles_mix_in_any_order(rig: Rig) -> None:
    stick = stick_length(-1.2) - CLOSED
    bucket = read(rig, "bucket_cylinder", 0.3)
    entry = first(rig, sample(NAMES, [bucket, 0.3, stick, 0.5]))
    assert entry.value == pytest.approx((0.3, 0.5, -1.2, 0.3), abs=1e-6)
    assert entry.velocity == ()
    assert entry.missing == ()


def test_velocities_of_rods_become_rates(rig: Rig) -> None:
    h = 1e-6
    per_rad = (stick_length(-1.2 + h) - stick_length(-1.2 - h)) / (2.0 * h)
    names = ("swing", "boom", "stick_cylinder", "bucket")
    position = [0.3, 0.5, stick_length(-1.2) - CLOSED, 0.3]
    entry = first(rig, sample(names, position, [0.1, -0.2, 0.03, 0.4]))
    assert entry.velocity == pytest.approx((0.1, -0.2, 0.03 / per_rad, 0.4), abs=1e-6)
    too_fast = sample(names, position, [0.1, -0.2, 10.5 * per_rad, 0.4])
    assert ingest(rig, Streams(), too_fast).joints.rejected == 1


def test_an_error_of_the_stroke_is_the_larger_in_angle_the_smaller_the_lever(rig: Rig) -> None:
    names = ("swing", "boom", "stick", "bucket_cylinder")
    h, found = 1e-5, []
    for q in (-2.1, -0.5, 0.8):
        lever = (read(rig, names[3], q + h) - read(rig, names[3], q - h)) / (2.0 * h)
        entry = first(rig, sample(names, [0.3, 0.5, -1.2, read(rig, names[3], q)]))
        assert entry.sigmas[:3] == (0.0, 0.0, 0.0)
        assert entry.sigmas[3] == pytest.approx(0.0005 / abs(lever), rel=1e-3)
        found.append(entry.sigmas[3])
    assert max(found) > 0.004
    assert first(rig, sample(("swing",), [0.3])).sigmas == ()


def fed(
    rig: Rig, change: Callable[[JointSample], JointSample], imus: tuple[str, ...] = ()
) -> FusedPose:
    """The pose after 1.5 s of a resting machine, its joint samples changed."""
    world = World(rig, motion=Motion(joints=tuple(Q.values())), imus=imus)
    samples: list[Sample] = [
        change(s) if isinstance(s, JointSample) else s for s in world.samples(0.0, 1.5)
    ]
    return pose_at(rig, feed(rig, samples), 1.5 + world.latency)


def with_stick(name: str, value: float) -> Callable[[JointSample], JointSample]:
    def change(s: JointSample) -> JointSample:
        names = tuple(name if n == "stick_joint" else n for n in s.names)
        position = np.where(np.array(s.names) == "stick_joint", value, s.position)
        return replace(s, names=names, position=position)

    return change


def test_a_pose_from_strokes_is_valid_and_less_certain_by_the_lever(rig: Rig) -> None:
    pose = fed(rig, with_stick("stick_cylinder", stick_length(-1.2) - CLOSED))
    assert pose.validity is Validity.VALID
    assert pose.joints == pytest.approx(list(Q.values()), abs=1e-6)
    assert pose.sigma_joints == pytest.approx(0.003, abs=1e-4)
    # The longest lever of the mini's bucket cylinder is 0.115 m/rad: always above 3 mrad.
    bucket = read(rig, "bucket_cylinder", 0.3)

    def change(s: JointSample) -> JointSample:
        names = (*s.names[:3], "bucket_cylinder")
        return replace(s, names=names, position=np.array([*s.position[:3], bucket]))

    uncertain, certain = fed(rig, change), fed(rig, lambda s: s)
    lever = (read(rig, "bucket_cylinder", 0.3 + 1e-5) - bucket) / 1e-5
    expected = [0.003, 0.003, 0.003, 0.0005 / abs(lever)]
    assert uncertain.joint_sigmas == pytest.approx(expected, rel=1e-3)
    assert uncertain.sigma_joints == uncertain.joint_sigmas.max()
    assert certain.joint_sigmas.tolist() == [certain.sigma_joints] * 4
    assert uncertain.sigma_yaw == certain.sigma_yaw  # the swing's angle is measured
    # Only the bucket's own lever, 0.7 m, carries it to the tip.
    more = spread(rig.machine, uncertain) ** 2 - spread(rig.machine, certain) ** 2
    own = uncertain.sigma_joints**2 - certain.sigma_joints**2
    assert more == pytest.approx(9.0 * 0.7**2 * own)
    slack = joint_slack(uncertain) - joint_slack(certain)
    assert slack[:3].tolist() == [0.0, 0.0, 0.0]
    assert slack[3] > 3e-3


@pytest.mark.parametrize(("beyond", "valid"), [(0.004, True), (0.006, False)])
@pytest.mark.parametrize("end", ["short", "long"])
def test_a_stroke_beyond_its_range_is_no_angle_and_says_why(
    rig: Rig, beyond: float, valid: bool, end: str
) -> None:
    longest = stick_length(-2.617994) - CLOSED
    value = -beyond if end == "short" else longest + beyond
    pose = fed(rig, with_stick("stick_cylinder", value))
    assert (pose.validity is Validity.VALID) is valid
    if not valid:
        assert pose.validity is Validity.UNKNOWN
        reason = f"stick cylinder reads {value:.3f} m, allowed: 0.000 to {longest:.3f} m"
        assert pose.reasons == (reason,)


def test_an_imu_stands_in_for_a_stroke_that_cannot_be(rig: Rig) -> None:
    imus = ("base", "boom_link", "stick_link", "bucket_link")
    pose = fed(rig, with_stick("stick_cylinder", 9.9), imus)
    assert pose.validity is Validity.VALID
    assert pose.joints == pytest.approx(list(Q.values()), abs=1e-3)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_stroke_that_is_no_number_refuses_the_message(rig: Rig, bad: float) -> None:
    names = ("swing", "boom", "stick_cylinder", "bucket")
    for given in (
        sample(names, [0.3, 0.5, bad, 0.3]),
        sample(names, [0.3, 0.5, 0.1, 0.3], [0.0, 0.0, bad, 0.0]),
    ):
        streams = ingest(rig, Streams(), given)
        assert (streams.joints.received, streams.joints.rejected) == (1, 1)


def test_the_same_cylinder_twice_is_refused_and_an_angle_beside_it_wins(rig: Rig) -> None:
    twice = sample(("swing", "stick_cylinder", "arm_cylinder"), [0.3, 0.1, 0.1])
    assert ingest(rig, Streams(), twice).joints.rejected == 1
    for names, values in (
        (("swing", "stick", "stick_cylinder"), [0.3, -1.2, 9.9]),
        (("swing", "stick_cylinder", "stick"), [0.3, 9.9, -1.2]),
    ):
        assert first(rig, sample(names, values)).value[2] == -1.2


def test_a_name_of_no_cylinder_is_as_missing_and_says_what_is_allowed(
    rig: Rig, varied: Callable[..., Rig]
) -> None:
    pose = fed(rig, with_stick("jib_cylinder", 0.1))
    assert pose.validity is Validity.UNKNOWN
    (reason,) = pose.reasons
    assert reason.startswith('stick angle is not published; "jib_cylinder" is no cylinder')
    assert "allowed: boom_cylinder, stick_cylinder, arm_cylinder, bucket_cylinder" in reason
    bare = varied(strokes=())
    (reason,) = fed(bare, with_stick("stick_cylinder", 0.1)).reasons
    assert "angles only" in reason
    (reason,) = fed(rig, with_stick("jib", 0.1)).reasons
    assert reason == "stick angle is not published"
    (reason,) = fed(rig, with_stick("\n" * 99 + "_cylinder", 0.1)).reasons
    assert "?" * 40 in reason
    assert "\n" not in reason


def test_the_swing_is_always_an_angle(rig: Rig) -> None:
    names = ("swing_cylinder", "boom", "stick", "bucket")
    assert ingest(rig, Streams(), sample(names, [0.3, 0.5, -1.2, 0.3])).joints.rejected == 1
