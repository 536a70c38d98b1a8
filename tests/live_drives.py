"""Careless drives in real time: two pages, two machines, everything between them as it runs."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from live import all_valid, serve, simulated
from operators import Operator
from wiretap import Wiretap

from backend.collision.verdict import contact
from backend.machine.model import Machine
from backend.shell.link.messages import TrueState
from backend.shell.sim.careless import Careless, bodies_of, placed
from backend.shell.sim.drives import NAMES, machine_of
from backend.shell.sim.dynamics import SimState
from backend.site.site import Site, load_site

STICKS = ("left_x", "left_y", "right_x", "right_y", "track_left", "track_right")
TOGETHER = 0.02
"""True states of the two machines further apart than this are not compared [s]."""


@dataclass
class LiveOutcome:
    """contact: whether the true poses ever touched; nearest [m]; path: joint travel of both [rad];
    compared: number of moments at which FCL judged; moved: share of time in which sticks counted.
    """

    contact: bool
    nearest: float
    path: float
    compared: int
    moved: float


def site_of(seed: int, folder: Path, model: str = "mini") -> Path:
    """A site file with two machines as a careless drive of that seed puts them."""
    machine = machine_of(model)
    states = placed([machine, machine], np.random.default_rng((seed, 7)))
    origin = np.array([308600.0, 4129950.0, 0.0])
    parts = [
        'name = "careless"\ntitle = "Careless drive"',
        "[frame]",
        "epsg = 32652",
        f"origin = {origin.tolist()}",
        'geoid_offset = 0.0\nheading_reference = "grid"',
        "[safety]\neta = 0.10\nslow_below = 0.8\nstop_below = 0.2",
    ]
    for name, state in zip(NAMES, states, strict=True):
        joints = ", ".join(
            f"{joint.role} = {math.degrees(value):.6f}"
            for joint, value in zip(machine.joints, state.q, strict=True)
        )
        parts += [
            "[[machine]]",
            f'name = "{name}"\nlabel = "{name.upper()}"\nmodel = "{model}"',
            "[machine.start]",
            f"position = {(origin + state.position).tolist()}",
            f"yaw_deg = {math.degrees(state.yaw):.6f}",
            f"joints_deg = {{ {joints} }}",
            '[machine.sim]\nprogram = "hold"',
        ]
    path = folder / f"careless-{seed}.toml"
    path.write_text("\n".join(parts) + "\n")
    return path


def drive(seed: int, folder: Path, seconds: float) -> LiveOutcome:
    """One careless drive over Zenoh, judged by FCL on the true states."""
    path = site_of(seed, folder)
    site, machine = load_site(str(path)), machine_of("mini")
    with (
        serve(str(path), "--no-record") as station,
        simulated(str(path), station.endpoint, *NAMES),
        Wiretap(station.endpoint, NAMES[0]) as first,
        Wiretap(station.endpoint, NAMES[1]) as second,
    ):
        station.wait_for(all_valid)
        operators = [Operator(station) for _ in NAMES]
        for name, operator in zip(NAMES, operators, strict=True):
            operator.take(name)
        threads = [
            threading.Thread(target=_careless, args=(operator, name, (seed, k), seconds))
            for k, (name, operator) in enumerate(zip(NAMES, operators, strict=True))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for operator in operators:
            operator.close()
        time.sleep(0.5)
    moved = [c for tap in (first, second) for c in tap.commands]
    share = sum(bool(c.velocity.any()) for c in moved) / max(len(moved), 1)
    return _judged(machine, site, first.truths, second.truths, share)


def _careless(operator: Operator, name: str, seed: tuple[int, int], seconds: float) -> None:
    hands = Careless(np.random.default_rng(seed))
    begun = time.monotonic()
    while (t := time.monotonic() - begun) < seconds:
        if operator.state(name) not in ("Enabled", "Active"):
            operator.enable(name)  # a busy computer may have paused it
        sticks = hands.at(t)
        operator.move(**{stick: getattr(sticks, stick) for stick in STICKS})
        time.sleep(0.02)
    operator.move(enable=False)


def _state(truth: TrueState, site: Site) -> SimState:
    position = site.frame.from_projected(truth.base)
    attitude = truth.yaw, truth.pitch, truth.roll
    return SimState(truth.position, truth.velocity, position, *attitude, np.zeros(2))


def _judged(
    machine: Machine, site: Site, one: list[TrueState], other: list[TrueState], moved: float
) -> LiveOutcome:
    stamps = np.array([truth.stamp for truth in other])
    touched, nearest, compared = False, math.inf, 0
    for truth in one:
        k = int(np.abs(stamps - truth.stamp).argmin())
        if abs(stamps[k] - truth.stamp) > TOGETHER:
            continue
        both = [bodies_of(machine, _state(t, site)) for t in (truth, other[k])]
        touches, apart = contact(*both)
        touched, nearest, compared = touched or touches, min(nearest, apart), compared + 1
    path = sum(
        float(np.abs(np.diff([t.position for t in truths], axis=0)).sum())
        for truths in (one, other)
    )
    return LiveOutcome(touched, nearest, path, compared, moved)
