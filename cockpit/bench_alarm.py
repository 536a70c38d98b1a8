"""From a LiDAR's points to the alarm that they raise, in real time and in the people's own process.

A machine among people is simulated beforehand; what it sends is then played in real time to the
people's process and to a loop of the pipeline as the backend runs it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from backend.documents.bench import BenchRow
from backend.fusion.samples import ClockSample, Sample
from backend.machine.kinematics import link_poses
from backend.machine.lidars import sensor_pose
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs
from backend.pipeline.step import initial, step
from backend.safety.partner import Limits
from backend.safety.people import NAME as PEOPLE
from backend.safety.people import Watch
from backend.shell.link.encode import encode_cloud
from backend.shell.link.receiver import Heard
from backend.shell.link.topics import topic
from backend.shell.people_loop import PeopleLoop, people_worker
from backend.shell.sim.careless import bodies_of
from backend.shell.sim.drives import CYCLE, DT, Drive, machine_of, obey, report, simulated
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.shell.sim.radio import Radio
from backend.site.site import load_site
from backend.spatial.boxes import Boxes, concatenated
from cockpit.bench_rows import percentile_rows

SECONDS = 20.0
SETTLE = 3.0  # until compiled functions are loaded and poses are known [s]
DELAY = 0.1  # of all that the machine sends [s]
TURN = 0.1  # of the LiDAR [s]
DIRECTIONS = 1880  # times 16 beams: 30,000 points
NAME = "a"


@dataclass
class Sent:
    """What arrives, in order: samples with arrivals, clouds with arrivals and stamps [s]."""

    samples: list[tuple[float, Sample]] = field(default_factory=list)
    clouds: list[tuple[float, float, bytes]] = field(default_factory=list)
    points: int = 0


def alarm_rows(walls: Boxes) -> list[BenchRow]:
    """walls: around the scene, so that every ray has an echo."""
    machine = machine_of("mini")
    site = load_site("demo")
    config = Config(
        frame=site.frame,
        machines={NAME: machine},
        labels={NAME: "A"},
        own=(NAME,),
        limits=Limits(site.safety.slow_below, site.safety.stop_below),
        eta=site.safety.eta,
        mode="DEMO",
        people=Watch(),
    )
    sent = _simulated(walls)
    found, alarmed = _played(config, sent)
    n = round(sent.points / max(len(sent.clouds), 1), -3)
    if not alarmed:
        raise RuntimeError("nobody raised an alarm: these durations would say nothing")
    return percentile_rows(f"alarm from {n:,.0f} points", found, 100.0)


def _simulated(walls: Boxes) -> Sent:
    site = load_site("demo")
    machine = machine_of("mini")
    q = np.array([0.0, 0.6, -1.4, -0.8])
    state = SimState(q, np.zeros(4), np.zeros(3), 0.0, 0.0, 0.0, np.zeros(2))
    one = simulated(NAME, machine, state, site, 0)
    radio, plan = Radio(site.sim.radio_period, DELAY), Drive(0, up=DELAY, down=DELAY)
    rng, sent = np.random.default_rng(3), Sent()
    (mount,) = machine.lidars
    lidar = Lidar(elevations=mount.elevations, directions=DIRECTIONS, lost=0.0)
    for tick in range(1, round(SECONDS / DT) + 1):
        t = tick * DT
        obey(one, t)
        sent.samples += [(t, sample) for sample in report(one, t, radio, plan, rng)]
        if tick % round(0.5 / DT) == 0:
            sent.samples.append((t, ClockSample(NAME, t - 0.002, t - 0.001, t)))
        if tick % round(TURN / DT) == 0:
            T = sensor_pose(machine, mount, link_poses(machine, one.state.q, one.state.T_site_root))
            around = concatenated([bodies_of(machine, one.state), walls])
            seen = scan(lidar, T, around, _people(t), rng)
            points = ((seen.points - T[:3, 3]) @ T[:3, :3]).astype(np.float32)
            sent.clouds.append((t + DELAY, t, encode_cloud(t, mount.name, points)))
            sent.points += len(points)
    return sent


def _people(t: float) -> tuple[Person, ...]:
    """One walks to the machine and away again, nine stand farther off."""
    far = 3.0 + 2.5 * np.cos(0.5 * t)
    angles = 2.4 * np.arange(1.0, 10.0)
    others = [Person((4.0 + k) * np.array([np.cos(a), np.sin(a)])) for k, a in enumerate(angles)]
    return (Person(np.array([0.8 + far, 0.0])), *others)


def _played(config: Config, sent: Sent) -> tuple[list[float], int]:
    """Durations from each cloud's arrival to the end of the cycle that judged it [s], and how many
    of these cycles had an alarm about people.
    """
    begin = time.monotonic()

    def clock() -> float:
        return time.monotonic() - begin

    arrived: list[Heard] = []
    waiting: list[tuple[float, float]] = []  # stamp and arrival of clouds that are not judged yet

    def take() -> list[Heard]:
        found = arrived[:]
        del arrived[: len(found)]
        return found

    loop = PeopleLoop(config, take, people_worker(), clock=clock)
    loop.start()
    state, found, alarmed = initial(config), [], 0
    samples, clouds, due = sent.samples, sent.clouds, 0.0
    try:
        while samples or clouds:
            now = clock()
            while clouds and clouds[0][0] <= now:
                (_, stamp, payload), clouds = clouds[0], clouds[1:]
                waiting.append((stamp, now))
                arrived.append(
                    Heard(NAME, f"{NAME}/points", "points", topic("points"), payload, now)
                )
            if now < due:
                time.sleep(min(0.002, due - now))
                continue
            due = max(due + CYCLE, now)
            until = next((k for k, (at, _) in enumerate(samples) if at > now), len(samples))
            inputs = Inputs(
                tuple(sample for _, sample in samples[:until]), driven=(NAME,), people=loop.take()
            )
            samples = samples[until:]
            state, snapshot = step(state, inputs, now, config)
            loop.keep(snapshot)
            if inputs.people is None:
                continue
            # Clouds that were left out for newer ones count as well, as late as they are.
            done = [arrival for stamp, arrival in waiting if stamp < inputs.people.time + TURN / 2]
            waiting = waiting[len(done) :]
            if now > SETTLE:
                found += [clock() - arrival for arrival in done]
                alarmed += any(
                    alarm.concern.name == PEOPLE and alarm.active for alarm in snapshot.alarms
                )
    finally:
        loop.stop()
    return found, alarmed
