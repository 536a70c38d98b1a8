"""Careless drives among people, in simulated time: whoever walks into the swing range must be safe.

As in `drives`, everything between the sticks and the machine is what the live cockpit runs; and so
is everything between a LiDAR's turn and the limiter: clouds placed by delayed poses, detection,
tracking, the concern. Only the clock, the machine, the rays and the people are simulated.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from backend.collision.box_distance import lower_bounds
from backend.collision.verdict import contact
from backend.fusion.samples import ClockSample, Sample
from backend.machine.kinematics import link_poses
from backend.machine.lidars import sensor_pose
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.people_records import Seen
from backend.pipeline.records import Inputs, MachineState
from backend.pipeline.step import initial, step
from backend.pipeline.watch import Cloud, Watched, watch
from backend.safety.partner import Limits as Band
from backend.safety.people import Watch
from backend.safety.record import Concern, Level
from backend.shell.link.cloud import Cloud as HeardCloud
from backend.shell.people_loop import placed_cloud
from backend.shell.sim.careless import SETTLE, Careless, bodies_of, fastest
from backend.shell.sim.drives import (
    CYCLE,
    DT,
    Drive,
    Outcome,
    Simulated,
    command,
    machine_of,
    obey,
    report,
    simulated,
)
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.lidar import Lidar, Person, measured
from backend.shell.sim.radio import Radio
from backend.site.site import load_site
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import AnyArray, Array

TURN = 0.1  # of a LiDAR [s]
PARTS = 5  # of a turn; the machine and the people move on from one to the next
WORK = 0.06  # from a cloud's arrival to its tracks [s]
SHY = 0.6  # nearer to a machine's body nobody walks by himself [m]
STILL = 0.01  # slower machines stand [rad/s, m/s]
SEEN = 5  # points of somebody who is visible
FORGETS = 0.5  # who was not visible for so long is hidden [s]


@dataclass(frozen=True)
class PeopleDrive:
    """One drive of one machine. people: how many walk about within its reach; the rest as of
    `drives.Drive`.
    """

    seed: int
    model: str = "mini"
    people: int = 1
    limited: bool = True
    up: float = 0.1
    down: float = 0.1
    seconds: float = 20.0


@dataclass
class PeopleOutcome:
    """contact: when a moving machine touched somebody who was visible [s], None for never; hidden:
    the same of somebody whom no LiDAR saw within `FORGETS`; nearest: of a moving machine [m]; path:
    joint travel [rad]; levels: cycles by level of the people's concern; limited: cycles in which
    people limited the machine.
    """

    contact: float | None = None
    hidden: float | None = None
    nearest: float = math.inf
    path: float = 0.0
    levels: dict[str, int] = field(default_factory=dict)


class Walker:
    """Somebody who walks about within the reach of a machine, and not into it."""

    def __init__(self, rng: np.random.Generator, reach: float) -> None:
        self._rng, self._reach = rng, reach
        self.place = self._somewhere(reach + 1.0, reach + 4.0)
        self._goal, self._speed, self._until = self.place, 0.0, 0.0

    def box(self) -> Boxes:
        return Boxes(
            np.array([[*self.place, 0.875]]), np.eye(3)[None], np.array([[0.22, 0.22, 0.875]])
        )

    def step(self, t: float, bodies: Boxes, middle: Array) -> None:
        """One step of DT. middle: (2,) of the machine [m]."""
        if t >= self._until or np.linalg.norm(self._goal - self.place) < 0.1:
            self._goal = middle + self._somewhere(1.0, self._reach + 1.0)
            self._speed = 0.0 if self._rng.random() < 0.2 else self._rng.uniform(0.7, 1.5)
            self._until = t + self._rng.uniform(1.0, 6.0)
        way = self._goal - self.place
        length = float(np.linalg.norm(way))
        if length < 1e-6 or self._speed == 0.0:
            return
        before = self.place
        apart = _gap(bodies, self.box())
        self.place = before + way / length * min(self._speed * DT, length)
        after = _gap(bodies, self.box())
        if after < SHY and after < apart:
            self.place, self._until = before, min(self._until, t + 0.5)

    def _somewhere(self, low: float, high: float) -> Array:
        angle, far = self._rng.uniform(-np.pi, np.pi), self._rng.uniform(low, high)
        return far * np.array([np.cos(angle), np.sin(angle)])


def people_drive(plan: PeopleDrive) -> PeopleOutcome:
    """Runs one drive until its end or the first contact."""
    site = load_site("demo")
    site = replace(site, sim=site.sim.model_copy(update={"joint_period": DT}))
    rng = np.random.default_rng((plan.seed, 17))
    machine = machine_of(plan.model)
    one = simulated("a", machine, _start(machine, rng), site, plan.seed)
    config = Config(
        frame=site.frame,
        machines={"a": machine},
        labels={"a": "A"},
        own=("a",),
        limits=Band(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode="DEMO",
        margins=False,
        people=Watch(),
    )
    radios = Radio(site.sim.radio_period, plan.down), Radio(site.sim.radio_period, plan.up)
    drive = Drive(plan.seed, limited=plan.limited, up=plan.up, down=plan.down)
    stick = Careless(np.random.default_rng((plan.seed, 3)))
    walkers = [
        Walker(np.random.default_rng((plan.seed, 5, k)), machine.max_reach)
        for k in range(plan.people)
    ]
    eyes = _Eyes(machine, plan.down, np.random.default_rng((plan.seed, 6)))
    outcome, pipeline, counted = PeopleOutcome(), initial(config), Outcome()
    samples: list[Sample] = []
    safe_until = clock_due = cycle_due = 0.0
    top_speed = fastest(machine) + 1.5
    for tick in range(1, round(plan.seconds / DT) + 1):
        t = tick * DT
        obey(one, t)
        bodies = bodies_of(machine, one.state)
        for walker in walkers:
            walker.step(t, bodies, one.state.position[:2])
        if plan.limited:
            eyes.look(one, walkers, t)
            samples += report(one, t, radios[0], drive, rng)
            if t >= clock_due - 1e-9:
                clock_due += 0.5
                samples.append(ClockSample("a", t - 0.002, t - 0.001, t))
        if t >= cycle_due - 1e-9:
            cycle_due += CYCLE
            snapshot = None
            if plan.limited:
                inputs = Inputs(tuple(samples), driven=("a",), people=eyes.tracks(config, t))
                pipeline, snapshot = step(pipeline, inputs, t, config)
                samples = []
                eyes.keep(snapshot.state_time, snapshot.machines)
                if t > 2.0 * SETTLE:
                    _count(outcome, snapshot.concerns)
            command(one, stick.at(t - SETTLE), snapshot, t, radios[1], drive, rng, counted)
        moving = max(np.abs(one.state.qd).max(), np.abs(one.state.travel).max()) > STILL
        if moving and walkers and t >= safe_until:
            touches, apart = contact(bodies, concatenated([w.box() for w in walkers]))
            outcome.nearest = min(outcome.nearest, apart)
            if touches:
                seen = not plan.limited or eyes.visible(bodies, walkers, t)
                outcome.contact, outcome.hidden = (t, None) if seen else (None, t)
                break
            safe_until = t + apart / top_speed
    outcome.path = one.path
    return outcome


class _Eyes:
    """The machine's LiDARs, and what the process beside the fast loop makes of their clouds."""

    def __init__(self, machine: Machine, delay: float, rng: np.random.Generator) -> None:
        self._machine = machine
        self._delay, self._rng = delay, rng
        self._due = 0.0
        self._parts: list[tuple[float, list[AnyArray], list[AnyArray]]] = []
        self._coming: deque[HeardCloud] = deque()
        self._poses: deque[tuple[float, dict[str, MachineState]]] = deque(maxlen=60)
        self._state = Watched()
        self._last: dict[int, float] = {}

    def look(self, one: Simulated, walkers: list[Walker], t: float) -> None:
        """A part of a turn of every LiDAR when it is due; clouds when the turn is done."""
        if t < self._due - 1e-9:
            return
        self._due += TURN / PARTS
        links = link_poses(one.machine, one.state.q, one.state.T_site_root)
        bodies = bodies_of(one.machine, one.state)
        people = tuple(Person(walker.place) for walker in walkers)
        part = len(self._parts)
        clouds, hits = [], []
        for mount in one.machine.lidars:
            T = sensor_pose(one.machine, mount, links)
            lidar = Lidar(elevations=mount.elevations)
            seen = measured(lidar, T, bodies, people, self._rng, part=(part, PARTS))
            clouds.append(seen.points.astype(np.float32))
            hits.append(seen.hit)
        self._parts.append((t, clouds, hits))
        if len(self._parts) == PARTS:
            self._turned(one, len(bodies), len(walkers), t)

    def _turned(self, one: Simulated, bodies: int, walkers: int, t: float) -> None:
        for k, mount in enumerate(one.machine.lidars):
            points = np.concatenate([clouds[k] for _, clouds, _ in self._parts])
            since = [np.full(len(clouds[k]), at - t) for at, clouds, _ in self._parts]
            hit = np.concatenate([hits[k] for *_, hits in self._parts])
            for who in range(walkers):
                first = bodies + 2 * who
                if ((hit == first) | (hit == first + 1)).sum() >= SEEN:
                    self._last[who] = t
            times = np.concatenate(since).astype(np.float32)
            self._coming.append(HeardCloud(one.name, mount.name, t, t + self._delay, points, times))
        self._parts = []

    def keep(self, time: float, machines: dict[str, MachineState]) -> None:
        self._poses.append((time, machines))

    def tracks(self, config: Config, t: float) -> Seen | None:
        """What was worked out by now, once."""
        clouds: list[Cloud] = []
        while self._coming and self._coming[0].arrival + WORK <= t:
            found = placed_cloud(self._coming[0], tuple(self._poses), dict(config.machines))
            if found == "wait":
                break
            self._coming.popleft()
            if isinstance(found, tuple):
                clouds += found
        if not clouds:
            return None
        self._state, seen = watch(self._state, tuple(clouds))
        return seen

    def visible(self, bodies: Boxes, walkers: list[Walker], t: float) -> bool:
        """Whether everybody who is touched was seen lately."""
        touched = [k for k, w in enumerate(walkers) if contact(bodies, w.box())[0]]
        return all(t - self._last.get(k, -math.inf) <= FORGETS for k in touched)


def _gap(bodies: Boxes, somebody: Boxes) -> float:
    """At most their distance, negative on overlap [m]."""
    return float(lower_bounds(bodies, somebody).min())


def _count(outcome: PeopleOutcome, concerns: tuple[Concern, ...]) -> None:
    for concern in concerns:
        if concern.name == "people":
            level = Level(concern.level).name
            outcome.levels[level] = outcome.levels.get(level, 0) + 1


def _start(machine: Machine, rng: np.random.Generator) -> SimState:
    low = np.where(np.isfinite(machine.lower), machine.lower, -math.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, math.pi)
    q = rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
    return SimState(q, np.zeros_like(q), np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2))
