"""From clouds on the wire to tracks for the pipeline, in a process beside the fast loop."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from backend.machine.lidars import sensor_pose
from backend.machine.model import Machine
from backend.perception.detect import Settings as Detecting
from backend.perception.stages import StagedScan
from backend.pipeline.config import Config
from backend.pipeline.people_records import Seen
from backend.pipeline.place import between
from backend.pipeline.records import Body3D, MachineState, Notice, Snapshot
from backend.pipeline.watch import Cloud, Watched, follow, found_in, merged, staged
from backend.shell.aside import Aside, WorkerGone
from backend.shell.image_loops import Stopwatch, ticks
from backend.shell.link.cloud import Cloud as HeardCloud
from backend.shell.link.cloud import decode_cloud
from backend.shell.link.codec import DecodeError
from backend.shell.link.receiver import Heard
from backend.shell.stages_look import Look, StagesLook
from backend.spatial.boxes import concatenated
from backend.spatial.types import AnyArray

log = logging.getLogger(__name__)

LOOK_HZ = 40.0
"""How often clouds are looked for."""
GATHER = 0.06
"""So long clouds of other LiDARs are waited for, to be merged with the first [s]."""
KEPT = 1.0
"""Poses of the last moments that clouds are placed by [s]."""
OLDEST = 0.5
"""Older clouds are not worth looking at [s]."""
PART = 0.025
"""Points of one turn that are this near in time are placed by one pose [s]."""
MOST_PARTS = 8


class Question(NamedTuple):
    """least: number that a new track may get; clouds: of one scan; staged: whether somebody looks
    at what detection makes of the points.
    """

    least: int
    clouds: tuple[Cloud, ...]
    staged: bool = False


Answer = tuple[Seen, StagedScan | None]


def begin() -> Callable[[Question], Answer]:
    """What the process does: it remembers who it follows."""
    state, settings = Watched(), Detecting()

    def answer(question: Question) -> Answer:
        nonlocal state
        before = replace(state, next_id=max(state.next_id, question.least))
        scan = merged(question.clouds, settings)
        found = found_in(scan, settings)
        state, seen = follow(before, scan, found.objects)
        return seen, staged(scan, found) if question.staged else None

    return answer


def people_worker() -> Aside[Question, Answer]:
    return Aside(begin, "looks for people", niceness=0)  # before images: motions wait for it


class PeopleLoop:
    """A thread that takes the newest clouds, has them worked out, and hands on the newest tracks.

    clouds: what was heard since the last call; refused: told of a key whose cloud cannot be read.
    """

    def __init__(
        self,
        config: Config,
        clouds: Callable[[], Iterable[Heard]],
        worker: Aside[Question, Answer],
        refused: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.timing = Stopwatch()
        self.trouble = ""
        self._config = config
        self._clouds = clouds
        self._worker = worker
        self._refused = refused
        self._clock = clock
        self._poses: deque[tuple[float, dict[str, MachineState]]] = deque()
        self._waiting: dict[tuple[str, str], HeardCloud] = {}
        self._known: set[tuple[str, str]] = set()
        self._newest: Seen | None = None
        self._stages = StagesLook(clock)
        self._next_id = 1  # of a process that is started again: nobody gets a number twice
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._guard, name="people loop", daemon=True)

    def keep(self, snapshot: Snapshot) -> None:
        """Told every snapshot, for the poses of clouds. Quick."""
        with self._lock:
            self._poses.append((snapshot.state_time, snapshot.machines))
            while self._poses and self._poses[0][0] < snapshot.state_time - KEPT:
                self._poses.popleft()

    def take(self) -> Seen | None:
        """The newest tracks, once."""
        with self._lock:
            seen, self._newest = self._newest, None
        return seen

    def look(self) -> Look:
        """What detection makes of the points, worked out only while somebody looks again and again.
        From any thread.
        """
        return self._stages.look(self.trouble)

    def notices(self) -> tuple[Notice, ...]:
        return (Notice("people", f"PEOPLE · {self.trouble}"),) if self.trouble else ()

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._worker.close()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def _guard(self) -> None:
        try:
            self._run()
        except Exception as error:
            if self._stopping.is_set():
                return
            # Without tracks people are unknown, and nothing moves: but why, must be told.
            self.trouble = f"the people loop stopped: {error!r}"
            log.exception("%s", self.trouble)

    def _run(self) -> None:
        for _ in ticks(1.0 / LOOK_HZ, self._clock, self._stopping):
            for heard in self._clouds():
                self._hear(heard)
            clouds = self._ready()
            if not clouds:
                continue
            start = self._clock()
            try:
                seen, stages = self._worker.ask(
                    Question(self._next_id, clouds, self._stages.wanted())
                )
            except (WorkerGone, RuntimeError) as error:
                if self._stopping.is_set():
                    return
                self.trouble = str(error)
                log.warning("%s", self.trouble)
                self._stopping.wait(0.2)
                continue
            self.trouble = ""
            end = self._clock()
            self.timing.add(start, end)
            self._next_id = max(self._next_id, int(seen.id.max(initial=0)) + 1)
            with self._lock:
                self._newest = replace(seen, ready=end)
            if stages is not None:
                self._stages.keep(stages)

    def _hear(self, heard: Heard) -> None:
        try:
            cloud = decode_cloud(heard.payload, heard.machine, heard.arrival)
        except DecodeError:
            self._refused(f"{heard.machine}/{heard.suffix}")
            return
        key = (cloud.machine, cloud.sensor)
        self._waiting[key] = cloud
        self._known.add(key)

    def _ready(self) -> tuple[Cloud, ...]:
        """The clouds that wait, placed, once the others' came or were waited for."""
        now = self._clock()
        waiting = {
            key: cloud for key, cloud in self._waiting.items() if now - cloud.arrival < OLDEST
        }
        self._waiting = waiting
        if not waiting:
            return ()
        first = min(cloud.arrival for cloud in waiting.values())
        if len(waiting) < len(self._known) and now - first < GATHER:
            return ()
        with self._lock:
            poses = tuple(self._poses)
        placed: list[Cloud] = []
        for key, cloud in tuple(waiting.items()):
            found = placed_cloud(cloud, poses, self._config.machines)
            if found == "wait" and now - cloud.arrival < 2.0 * GATHER:
                continue
            del self._waiting[key]
            if isinstance(found, tuple):
                placed += found
        return tuple(placed)


def placed_cloud(
    cloud: HeardCloud,
    poses: tuple[tuple[float, dict[str, MachineState]], ...],
    machines: dict[str, Machine],
) -> tuple[Cloud, ...] | str:
    """The cloud with the poses of its own moment, in parts where its points tell their times;
    "wait" while these poses are not there yet, and else why it cannot be used.
    """
    if not poses or cloud.machine not in machines:
        return "no poses"
    mount = next((m for m in machines[cloud.machine].lidars if m.name == cloud.sensor), None)
    if mount is None:
        return f"{cloud.machine} has no LiDAR called {cloud.sensor!r}"
    offset = poses[-1][1][cloud.machine].pose.clock_offset
    stamp = cloud.arrival if offset is None else cloud.stamp + 0.5 * (offset[0] + offset[1])
    if not math.isfinite(stamp):
        return "no time"
    parts = _parts(cloud)
    if poses[-1][0] < stamp + max(since for since, _ in parts):
        return "wait"
    placed = []
    for since, points in parts:
        at = stamp + since
        bodies = _bodies(poses, machines, at)
        own = bodies.get(cloud.machine)
        if own is None:
            return f"{cloud.machine} is not placed"
        T = sensor_pose(machines[cloud.machine], mount, own.link_poses)
        boxes = concatenated([body.boxes for body in bodies.values()])
        placed.append(Cloud(cloud.machine, cloud.sensor, at, points, T, boxes))
    return tuple(placed)


def _parts(cloud: HeardCloud) -> list[tuple[float, AnyArray]]:
    """Points of about one time each, and that time since the cloud's stamp [s]: while a turn lasts
    the machine moves on.
    """
    if cloud.times is None or not len(cloud.times):
        return [(0.0, cloud.points)]
    first, last = float(cloud.times.min()), float(cloud.times.max())
    count = min(max(math.ceil((last - first) / PART), 1), MOST_PARTS)
    which = np.minimum(
        (count * (cloud.times - first) / max(last - first, 1e-9)).astype(int), count - 1
    )
    members = (which == k for k in range(count))
    return [(float(cloud.times[part].mean()), cloud.points[part]) for part in members if part.any()]


def _bodies(
    poses: tuple[tuple[float, dict[str, MachineState]], ...],
    machines: dict[str, Machine],
    at: float,
) -> dict[str, Body3D]:
    """All machines that are placed, where they were at a time [s]."""
    k = next((k for k in range(len(poses) - 1, -1, -1) if poses[k][0] <= at), 0)
    before, after = poses[k][1], poses[min(k + 1, len(poses) - 1)][1]
    return {
        name: between(machine, before[name].pose, after[name].pose, at)
        for name, machine in machines.items()
        if before[name].body is not None and after[name].body is not None
    }
