"""Clouds to tracks in a process of its own: placed by their moment's poses, and never silent."""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from backend.fusion.pose import FusedPose, StreamStatus, Validity
from backend.fusion.samples import Fix
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.lidars import sensor_pose
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.people_records import Seen
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import Health, MachineState, Snapshot
from backend.safety.partner import Limits
from backend.safety.people import Watch
from backend.shell.link.cloud import Cloud as HeardCloud
from backend.shell.link.encode import encode_cloud
from backend.shell.link.receiver import Heard
from backend.shell.link.topics import topic
from backend.shell.people_loop import PeopleLoop, people_worker, placed_cloud
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.site.site import load_site
from backend.spatial.transform import apply

pytestmark = pytest.mark.processes

MINI = load_machine("mini")
OFFSET = -50.0  # local minus the machine's clock [s]
SWING = 0.6  # rate of the swing [rad/s]


def pose(t: float) -> FusedPose:
    streams = {n: StreamStatus(0.1, 50.0, "offset", 1, 0) for n in ("joints", "position")}
    q = np.array([SWING * t, 0.6, -1.4, -0.8])
    return FusedPose(
        "left", t, Validity.VALID, (), np.zeros(3), 0.0, 0.0, 0.0, q, np.array([SWING, 0, 0, 0]),
        np.zeros(3), 0.02, 0.002, 0.001, Fix.RTK_FIXED, streams, (OFFSET - 1e-3, OFFSET + 1e-3),
    )  # fmt: skip


def state(t: float) -> dict[str, MachineState]:
    one = pose(t)
    return {"left": MachineState(one, place(MINI, one.joints, base_transform(one)), 0.1)}


def snapshot(t: float) -> Snapshot:
    health = Health({}, {}, 0, {})
    return Snapshot(t, t, 0, "LIVE", state(t), (), (), (), health)


def points(t: float, *people: Person) -> np.ndarray:
    """A turn of the LiDAR at t, in its own frame."""
    links = link_poses(MINI, pose(t).joints, np.eye(4))
    (mount,) = MINI.lidars
    T = sensor_pose(MINI, mount, links)
    rng = np.random.default_rng(round(1e3 * t))
    seen = scan(Lidar(elevations=mount.elevations), T, body_boxes(MINI, links), people, rng)
    return ((seen.points - T[:3, 3]) @ T[:3, :3]).astype(np.float32)


CONFIG = Config(
    load_site("demo").frame,
    {"left": MINI},
    {"left": "LEFT"},
    ("left",),
    Limits(0.8, 0.2),
    0.1,
    "LIVE",
    people=Watch(),
)


def test_a_cloud_is_placed_by_the_poses_of_its_moment() -> None:
    poses = tuple((t, state(t)) for t in (9.98, 10.0, 10.02, 10.04))
    cloud = HeardCloud("left", "lidar", 10.013 - OFFSET, 10.2, np.zeros((4, 3), np.float32))
    found = placed_cloud(cloud, poses, dict(CONFIG.machines))
    assert isinstance(found, tuple)
    (placed,) = found
    assert placed.time == pytest.approx(10.013)
    links = link_poses(MINI, pose(10.013).joints, np.eye(4))
    np.testing.assert_allclose(
        placed.T_site_sensor, sensor_pose(MINI, MINI.lidars[0], links), atol=1e-9
    )
    np.testing.assert_allclose(placed.machines.centers, body_boxes(MINI, links).centers, atol=1e-9)


def test_points_of_a_turn_are_placed_by_their_own_times() -> None:
    """A post that is seen all through a turn of a machine that swings by 3.4 degrees meanwhile."""
    post = np.array([6.0, 1.0, 1.0])
    end, since = 10.1, np.linspace(-0.1, 0.0, 21)
    (mount,) = MINI.lidars
    seen = []
    for t in end + since:
        T = sensor_pose(MINI, mount, link_poses(MINI, pose(t).joints, np.eye(4)))
        seen.append((post - T[:3, 3]) @ T[:3, :3])
    points = np.array(seen, dtype=np.float32)
    poses = tuple((t, state(t)) for t in np.arange(9.96, 10.14, 0.02))
    off = {}
    for times in (since.astype(np.float32), None):
        cloud = HeardCloud("left", "lidar", end - OFFSET, 10.2, points, times)
        found = placed_cloud(cloud, poses, dict(CONFIG.machines))
        assert isinstance(found, tuple)
        assert sum(len(part.points) for part in found) == len(points)
        there = [apply(part.T_site_sensor, part.points) for part in found]
        off[times is None] = np.linalg.norm(np.concatenate(there) - post, axis=1).max()
    assert off[False] < 0.06
    assert off[True] > 0.25


def test_a_turn_waits_for_the_poses_of_its_last_points() -> None:
    poses = tuple((t, state(t)) for t in (9.9, 10.0))
    late = np.array([-0.1, 0.05], np.float32)
    cloud = HeardCloud("left", "lidar", 10.0 - OFFSET, 10.2, np.ones((2, 3), np.float32), late)
    assert placed_cloud(cloud, poses, dict(CONFIG.machines)) == "wait"
    found = placed_cloud(cloud, (*poses, (10.06, state(10.06))), dict(CONFIG.machines))
    assert isinstance(found, tuple)
    np.testing.assert_allclose([part.time for part in found], [9.9, 10.05], atol=1e-6)


def test_what_cannot_be_placed_says_why() -> None:
    poses = ((10.0, state(10.0)),)
    cloud = HeardCloud("left", "lidar", 10.5 - OFFSET, 10.6, np.zeros((4, 3), np.float32))
    assert placed_cloud(cloud, poses, dict(CONFIG.machines)) == "wait"
    assert "no LiDAR" in str(placed_cloud(replace(cloud, sensor="x"), poses, {"left": MINI}))
    assert placed_cloud(replace(cloud, stamp=math.nan), poses, {"left": MINI}) == "no time"
    assert placed_cloud(cloud, (), {"left": MINI}) == "no poses"
    assert placed_cloud(replace(cloud, machine="right"), poses, {"left": MINI}) == "no poses"


class Wire:
    """A machine that swings among people; its clouds wait to be fetched."""

    def __init__(self) -> None:
        self.people: Callable[[float], tuple[Person, ...]] = lambda t: ()
        self.waiting: list[Heard] = []

    def take(self) -> list[Heard]:
        found, self.waiting = self.waiting, []
        return found

    def turn(self, t: float) -> None:
        payload = encode_cloud(t - OFFSET, "lidar", points(t, *self.people(t)))
        self.waiting.append(
            Heard("left", "left/points", "points", topic("points"), payload, time.monotonic())
        )


@pytest.fixture
def running() -> Iterator[tuple[PeopleLoop, Wire]]:
    wire = Wire()
    loop = PeopleLoop(CONFIG, wire.take, people_worker())
    loop.start()
    yield loop, wire
    loop.stop()


def follow(loop: PeopleLoop, wire: Wire, enough: Callable[[Seen], bool], begin: float) -> Seen:
    """Turns of the LiDAR, as fast as they are worked out, until `enough`."""
    for k in range(200):
        t = begin + 0.1 * k
        for late in (0.0, 0.02):
            loop.keep(snapshot(t + late))
        wire.turn(t)
        deadline = time.monotonic() + 10.0
        while (seen := loop.take()) is None and time.monotonic() < deadline:
            time.sleep(0.005)
        if seen is not None and enough(seen):
            return seen
    raise AssertionError(loop.trouble or "never")


def test_people_are_followed_from_a_swinging_machine(running: tuple[PeopleLoop, Wire]) -> None:
    loop, wire = running
    walks = lambda t: np.array([5.0, -3.0 + 1.2 * (t - 10.0)])  # noqa: E731
    wire.people = lambda t: (Person(walks(t)), Person(np.array([-4.0, 2.0])))
    seen = follow(loop, wire, lambda s: (s.status == 1).sum() == 2 and s.time > 11.5, 10.0)
    there = walks(seen.time)
    moving = int(np.linalg.norm(seen.state[:, :2] - there, axis=1).argmin())
    assert np.linalg.norm(seen.state[moving, :2] - there) < 0.3
    np.testing.assert_allclose(seen.state[moving, 2:4], [0.0, 1.2], atol=0.35)
    still = seen.state[1 - moving]
    assert np.linalg.norm(still[:2] - [-4.0, 2.0]) < 0.3
    assert [s.name for s in seen.sensors] == ["lidar"]


def test_when_its_process_is_killed_everybody_is_found_again_under_new_numbers(
    running: tuple[PeopleLoop, Wire],
) -> None:
    loop, wire = running
    wire.people = lambda t: (Person(np.array([5.0, 0.0])),)
    sure = lambda s: bool((s.status == 1).any())  # noqa: E731
    first = follow(loop, wire, sure, 10.0)
    pid = loop._worker.pid
    assert pid is not None
    os.kill(pid, signal.SIGKILL)
    loop.keep(snapshot(15.0))
    wire.turn(15.0)
    deadline = time.monotonic() + 20.0
    while not loop.trouble and time.monotonic() < deadline:
        time.sleep(0.01)
    assert "looks for people" in loop.trouble
    assert loop.notices()[0].line.startswith("PEOPLE · ")
    again = follow(loop, wire, sure, 16.0)
    assert not loop.notices()
    assert again.id.min() > first.id.max()


def test_what_is_no_cloud_is_refused_and_counted(running: tuple[PeopleLoop, Wire]) -> None:
    _, wire = running
    refused: list[str] = []
    loop = PeopleLoop(CONFIG, wire.take, people_worker(), refused.append)
    loop._hear(Heard("left", "left/points", "points", topic("points"), b"nonsense", 1.0))
    assert refused == ["left/points"]


def test_stages_come_while_somebody_looks(running: tuple[PeopleLoop, Wire]) -> None:
    loop, wire = running
    wire.people = lambda t: (Person(np.array([5.0, 0.0])), Person(np.array([-4.0, 2.0])))
    follow(loop, wire, lambda s: len(s.id) > 0, time.monotonic())
    assert loop.look().reason == "waiting for a scan"  # nobody had looked

    def shown(_: Seen) -> bool:
        return loop.look().stages is not None

    follow(loop, wire, shown, time.monotonic() + 3.0)  # not old before a slow computer looks
    told = loop.look()
    assert told.stages is not None
    assert told.reason == ""
    assert len(told.stages.points) <= 8_000
    assert sum(told.stages.counts) > 8_000
    for somebody in ([5.0, 0.0], [-4.0, 2.0]):
        apart = np.linalg.norm(told.stages.objects.center[:, :2] - somebody, axis=1)
        assert apart.min() < 0.3
    deadline = time.monotonic() + 20.0  # no more scans come
    while loop.look().stages is not None and time.monotonic() < deadline:
        time.sleep(0.05)
    gone = loop.look()
    assert gone.stages is None
    assert gone.reason == f"no scan for {gone.age:.1f} s"
