"""A simulated machine on real ground: its drives do what they do on the plane, but its base goes
where contact leads it. It climbs, hangs on its bucket, slides, and really falls.

    demand → `dynamics.step`: lags, limits → servos and belts of `backend.contact` → where it is

A servo is stiff, not rigid. What a joint lacks under its load is made up for within `MAKES_UP`, as
a closed cylinder holds its length; and a demand is never farther ahead of its joint than `RELIEF`,
as a relief valve opens: a bucket pressed against the ground lifts the machine, or stalls.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from backend.contact.spec import Options
from backend.contact.world import ContactWorld
from backend.machine.model import Machine
from backend.shell.sim.dynamics import SimState
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

STEP = 0.0025
"""Of the contact, at most [s]; lighter machines than LIGHT take half of it."""
LIGHT = 100.0
"""[kg]"""
MAKES_UP = 0.15
"""[s]"""
RELIEF = 0.08
"""[rad]"""
ON_TOP = 0.05
"""A machine this near to the top of a box stands on it [m]."""
OVER = math.radians(45.0)
"""A machine that leans farther than this lies, or will [rad]."""


class Grounded:
    """One machine among boxes on a plane: at its own height or, where it begins on top of one, at
    that one's foot. Not thread-safe.

    terrain: boxes in the site frame; start: where it stands; dt: of `step`, the same each time [s].
    Raises InputError for a machine without masses or without two tracks.
    """

    def __init__(
        self, machine: Machine, payload: float, terrain: Boxes, start: SimState, dt: float
    ) -> None:
        heavy = sum(link.inertia.mass for link in machine.links if link.inertia is not None)
        self._steps = math.ceil(dt / (STEP if heavy > LIGHT else 0.5 * STEP) - 1e-9)
        self._dt = dt
        self._down = np.array([0.0, 0.0, ground_height(start.position, terrain)])
        moved = Boxes(terrain.centers - self._down, terrain.rotations, terrain.half_extents)
        options = Options(step=dt / self._steps)
        self.world = ContactWorld(machine, payload, moved, options)
        self._slack = np.zeros(len(start.q))
        root = transform.make(start.T_site_root[:3, :3], start.position - self._down)
        self.world.reset(root, start.q)
        self._last = start

    def step(self, driven: SimState) -> SimState:
        """Where the machine is dt [s] later, when its drives have come to `driven`: its joints,
        rates and tracks count.
        """
        world = self.world
        before = world.q
        lacking = driven.q - before
        self._slack = np.clip(
            self._slack + lacking * self._dt / MAKES_UP * (np.abs(lacking) < RELIEF),
            -RELIEF,
            RELIEF,
        )
        control = world.control(driven.q + self._slack, driven.qd, driven.travel)
        for _ in range(self._steps):
            world.step(control)
        T = world.T_world_root
        q = world.q
        if not (np.isfinite(T).all() and np.isfinite(q).all()):
            return self._last  # it stays where it was last known to be
        yaw, pitch, roll = (float(angle) for angle in rotation.to_attitude(T[:3, :3]))
        yaw = self._last.yaw + math.remainder(yaw - self._last.yaw, 2.0 * math.pi)
        self._last = SimState(
            q, (q - before) / self._dt, T[:3, 3] + self._down, yaw, pitch, roll, world.belts
        )
        return self._last

    def relieved(self, driven: SimState) -> SimState:
        """The drives, not farther ahead of their joints than they can push."""
        q = self._last.q
        held: Array = np.clip(driven.q, q - RELIEF, q + RELIEF)
        return driven if np.array_equal(held, driven.q) else replace(driven, q=held)

    @property
    def over(self) -> bool:
        """Whether it fell over."""
        return bool(self.world.T_world_root[2, 2] < math.cos(OVER))


def ground_height(stands: Array, terrain: Boxes) -> float:
    """Of the plane under a machine that stands at (3,) [m]."""
    x, y, z = (float(v) for v in stands)
    for k in range(len(terrain)):
        R, half = terrain.rotations[k], terrain.half_extents[k]
        reach = np.abs(R) @ half
        centre = terrain.centers[k]
        inside = np.abs(R.T @ (np.array([x, y, centre[2]]) - centre)) <= half
        if abs(float(centre[2] + reach[2]) - z) < ON_TOP and inside.all():
            return float(centre[2] - reach[2])
    return z
