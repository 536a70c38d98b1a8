"""A simulated machine's LiDAR over a real session: clouds come, and people are where they are."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from live import end, start

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.lidars import sensor_pose
from backend.machine.load import load_machine
from backend.perception.detect import detect
from backend.shell.link.cloud import Cloud, decode_cloud
from backend.shell.link.codec import decode
from backend.shell.link.messages import TrueState
from backend.shell.link.session import open_session, with_port
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.process import run
from backend.shell.sim.turning import TurningLidars
from backend.shell.sim.walkers import people_at
from backend.site.site import Site, load_site
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import apply, make

SITE = load_site("people")
MINI = load_machine("mini")
SKEW = 3.0  # of the machines' clocks [s]


class Heard:
    """Everything that machines say of what they see and where they truly are."""

    def __init__(self, session: Any, *names: str) -> None:
        self.clouds: dict[str, list[Cloud]] = {name: [] for name in names}
        self.truths: dict[str, list[TrueState]] = {name: [] for name in names}
        self.joints: list[float] = []
        for name in names:
            session.declare_subscriber(f"{name}/points", lambda s, n=name: self._cloud(n, s))
            session.declare_subscriber(f"{name}/truth", lambda s, n=name: self._truth(n, s))
            session.declare_subscriber(f"{name}/joint_states", self._joints)

    def _cloud(self, name: str, sample: Any) -> None:
        now = time.monotonic()
        self.clouds[name].append(decode_cloud(sample.payload.to_bytes(), name, now))

    def _truth(self, name: str, sample: Any) -> None:
        truth = decode(name, "truth", sample.payload.to_bytes(), time.monotonic())
        assert isinstance(truth, TrueState)
        self.truths[name].append(truth)

    def _joints(self, sample: Any) -> None:
        self.joints.append(time.monotonic())

    def links(self, name: str, stamp: float) -> np.ndarray:
        """Link poses of the true state nearest to the stamp."""
        truth = min(self.truths[name], key=lambda one: abs(one.stamp - stamp))
        assert abs(truth.stamp - stamp) < 0.1
        R = from_attitude(truth.yaw, truth.pitch, truth.roll)
        return link_poses(MINI, truth.position, make(R, SITE.frame.from_projected(truth.base)))

    def bodies(self, stamp: float) -> Boxes:
        return concatenated(
            [body_boxes(MINI, self.links(n, stamp)) for n in self.truths if self.truths[n]]
        )


@contextmanager
def simulated(site: Site, *names: str, began: float = 0.0) -> Iterator[tuple[Heard, float]]:
    """Machines in threads of their own, and when their schedule began [s since the epoch]."""
    endpoint = with_port("tcp/127.0.0.1:0")
    session = open_session(listen=[endpoint], mode="router")
    heard, until, zero = Heard(session, *names), threading.Event(), time.time() - began
    threads = [
        threading.Thread(target=run, args=(site, n, (endpoint,), zero, until, SKEW), daemon=True)
        for n in names
    ]
    for thread in threads:
        thread.start()
    try:
        yield heard, zero
    finally:
        until.set()
        for thread in threads:
            thread.join(timeout=8.0)
        session.close()
    assert not any(thread.is_alive() for thread in threads)


def wait(condition: Any, seconds: float = 30.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "nothing happened in time"
        time.sleep(0.02)


def errors(heard: Heard, began: float, skew: float) -> list[float]:
    """How far from each person the nearest detection of LEFT's LiDAR is, in eight clouds [m]."""
    found = []
    for cloud in heard.clouds["left"][2:10]:
        assert cloud.sensor == "lidar"
        assert 10_000 < len(cloud.points) < 28_800
        T = sensor_pose(MINI, MINI.lidars[0], heard.links("left", cloud.stamp))
        seen = detect(apply(T, cloud.points), T[:3, 3], heard.bodies(cloud.stamp)).objects
        for person in people_at(SITE, cloud.stamp - skew - began):
            off = np.linalg.norm(seen.center[:, :2] - person.place, axis=1)
            found.append(float(off.min(initial=np.inf)))
    return found


def test_people_are_detected_where_they_are() -> None:
    # After 8 s both people are near and neither is hidden from LEFT.
    with simulated(SITE, "left", "right", began=6.0) as (heard, began):
        wait(lambda: all(len(clouds) >= 12 for clouds in heard.clouds.values()))
    stamps = np.array([cloud.stamp for cloud in heard.clouds["left"]])
    assert (np.diff(stamps) > 0.0).all()
    found = errors(heard, began, SKEW)
    assert np.median(found) < 0.15
    assert np.mean(np.array(found) < 0.3) > 0.9
    # The partner is among the points, too, and is taken for nothing else where it is known.
    cloud = heard.clouds["left"][5]
    T = sensor_pose(MINI, MINI.lidars[0], heard.links("left", cloud.stamp))
    partner = body_boxes(MINI, heard.links("right", cloud.stamp))
    assert detect(apply(T, cloud.points), T[:3, 3], partner).machine.sum() > 30


def test_so_they_are_by_the_program_itself() -> None:
    endpoint = with_port("tcp/127.0.0.1:0")
    session = open_session(listen=[endpoint], mode="router")
    heard, began = Heard(session, "left"), time.time() - 6.0
    options = ("--machine", "left", "--connect", endpoint, "--start-at", f"{began:.6f}")
    process = start("sim", "--site", "people", *options)
    try:
        wait(lambda: len(heard.clouds["left"]) >= 12, 60.0)
    finally:
        end(process)
        session.close()
    found = errors(heard, began, 0.0)
    assert np.median(found) < 0.15
    assert np.mean(np.array(found) < 0.3) > 0.9


def test_a_site_that_does_not_ask_for_lidars_has_none() -> None:
    site = replace(SITE, sim=SITE.sim.model_copy(update={"lidar": False}))
    with simulated(site, "left") as (heard, _):
        wait(lambda: len(heard.joints) > 100)
    assert heard.clouds["left"] == []


def test_a_cut_radio_cuts_the_clouds_as_well() -> None:
    endpoint = with_port("tcp/127.0.0.1:0")
    cockpit = open_session(listen=[endpoint], mode="router")
    machine = open_session(connect=[endpoint])
    came: list[Cloud] = []
    cockpit.declare_subscriber(
        "left/points", lambda s: came.append(decode_cloud(s.payload.to_bytes(), "left", 0.0))
    )
    cut, asked = True, 0

    def state() -> tuple[SimState, float]:
        nonlocal asked
        asked += 1
        none = np.zeros(4)
        return SimState(none, none, np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2)), 100.0 + asked

    lidars = TurningLidars(
        machine, SITE, "left", MINI, state, lambda: cut, lambda stamp: stamp - 100.0
    )
    try:
        wait(lambda: asked > 8)
        assert came == []
        cut = False
        wait(lambda: len(came) >= 3)
        assert came[0].stamp > 104.0  # nothing from before
    finally:
        lidars.close()
        machine.close()
        cockpit.close()
