"""A simulated machine's LiDARs on the wire: ten turns a second, in a thread of their own.

The kernel that casts the rays leaves the interpreter to others meanwhile, so that joints go on at
their rate. Clouds take the radio as everything else that the machine sends.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from backend.machine.model import Machine
from backend.shell.link.encode import encode_cloud
from backend.shell.link.session import publisher
from backend.shell.sim.cab import Seen
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.lidar import Lidar, scan
from backend.shell.sim.partners import Partners
from backend.shell.sim.radio import OnAir, Radio, arrival_time, receive
from backend.shell.sim.turns import Turn, scan_at
from backend.site.site import Site
from backend.spatial.boxes import NO_BOXES

PERIOD = 0.1  # of a turn [s]
PARTS = 5  # of a turn; the machine moves on from one to the next


class TurningLidars:
    """Publishes all clouds of the machine `name` under its one key, where the site switches LiDARs
    on and the machine has any.

    state: the machine's true state, None before the first, and its stamp [s]; cut: whether the
    radio is down, then clouds are lost; schedule: the schedule's time of a stamp; beside: opens a
    session on which other machines are heard, None for no other machines among the points.
    """

    def __init__(
        self,
        session: Any,
        site: Site,
        name: str,
        machine: Machine,
        state: Callable[[], tuple[SimState, float] | None],
        cut: Callable[[], bool],
        schedule: Callable[[float], float],
        beside: Callable[[], Any] | None = None,
    ) -> None:
        self._site, self._machine = site, machine
        self._state, self._schedule, self._cut = state, schedule, cut
        self._paint = [one.name for one in site.machines].index(name)
        self._rng = np.random.default_rng((site.machine(name).sim.seed, 2))
        self._radio = Radio(site.sim.radio_period, site.sim.latency)
        self._partners = Partners(site, name, machine, beside)
        self._closing = threading.Event()
        self._out: Any = None
        self._thread: threading.Thread | None = None
        if site.sim.lidar and machine.lidars:
            # Compiled here, once for all: there it would hold up the joints.
            scan(Lidar(directions=8), np.eye(4), NO_BOXES, (), self._rng)
            self._out = publisher(session, "points", site.machine(name).prefix)
            self._thread = threading.Thread(target=self._run, name="lidar", daemon=True)
            self._thread.start()

    def close(self) -> None:
        self._closing.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._out.undeclare()

    def _run(self) -> None:
        self._partners.listen(True)
        on_air: tuple[OnAir[bytes], ...] = ()
        due, before = time.monotonic(), -np.inf
        parts: list[tuple[float, tuple[Turn, ...]]] = []
        while not self._closing.is_set():
            now, state = time.monotonic(), self._state()
            if now >= due:
                late = now - due > PERIOD / PARTS  # then this turn takes longer
                due = now + PERIOD / PARTS if late else due + PERIOD / PARTS
                if state is not None and state[1] > before:
                    before = state[1]
                    parts.append((before, self._part(len(parts), *state)))
                if len(parts) == PARTS:
                    delay = arrival_time(before, self._radio) - before
                    on_air += tuple(OnAir(now + delay, cloud) for cloud in clouds(parts))
                    parts = []
            if self._cut():
                on_air = ()
            arrived, on_air = receive(on_air, time.monotonic())
            for cloud in arrived:
                self._out.put(cloud)
            until = min([due, *(item.arrival for item in on_air)])
            self._closing.wait(max(0.001, until - time.monotonic()))
        self._partners.listen(False)

    def _part(self, k: int, state: SimState, stamp: float) -> tuple[Turn, ...]:
        own = Seen(self._machine, state.q, state.T_site_root, self._paint)
        others, when = self._partners.seen(), self._schedule(stamp)
        return scan_at(self._site, when, own, others, self._rng, part=(k, PARTS))


def clouds(parts: list[tuple[float, tuple[Turn, ...]]]) -> list[bytes]:
    """A PointCloud2 of each LiDAR from the parts of one turn and their stamps [s]; its own stamp is
    the last one.
    """
    end = parts[-1][0]
    found = []
    for turns in zip(*(turns for _, turns in parts), strict=True):
        times = [
            np.full(len(turn.points), at - end) for (at, _), turn in zip(parts, turns, strict=True)
        ]
        points = np.concatenate([turn.points for turn in turns])
        found.append(encode_cloud(end, turns[0].sensor, points, times=np.concatenate(times)))
    return found
