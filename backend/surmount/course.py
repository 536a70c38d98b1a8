"""Several edges one after the other, up and down: legs, each with its own step, and drives between.

Going down is going up backwards in time: the machine stands on the top with the end that points
down first, and the same forces bear it (everything is slow). A leg's frame is the step frame of its
edge; the course's frame has its origin on the ground at the first edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array
from backend.surmount.laws import smooth_step
from backend.surmount.machine import Climber
from backend.surmount.moves import on_ground
from backend.surmount.records import Motion, Phase, Step
from backend.surmount.statics import weights_of


@dataclass(frozen=True)
class Edge:
    """x: along the way from the first edge [m]; rise: up positive, down negative [m]."""

    x: float
    rise: float


@dataclass(frozen=True)
class Leg:
    """One edge of a course. step: as it is gone up, in the direction that climbs; down: whether it
    is gone down, that is up backwards; x, z: of its step frame's origin in the course's [m].
    """

    step: Step
    down: bool
    x: float
    z: float


def legs(edges: tuple[Edge, ...], depth: float = math.inf) -> tuple[Leg, ...]:
    """depth: of the level ground behind the last edge [m].

    Raises InputError unless the edges follow each other and rise or fall.
    """
    for k, edge in enumerate(edges):
        if not (math.isfinite(edge.x) and math.isfinite(edge.rise)) or edge.rise == 0.0:
            raise InputError(f"edge {k + 1}: x and rise must be finite, and rise not 0.")
        if k and edge.x <= edges[k - 1].x:
            raise InputError(f"edge {k + 1} is not beyond edge {k}: allowed are rising distances.")
    found, ground = [], 0.0
    for k, edge in enumerate(edges):
        before = math.inf if k == 0 else edge.x - edges[k - 1].x
        after = depth if k == len(edges) - 1 else edges[k + 1].x - edge.x
        down = edge.rise < 0.0
        if down:
            # Seen from below: its top is the ground before it, and where that ends, it falls.
            step = Step(-edge.rise, depth=before, before=after)
            found.append(Leg(step, True, edge.x, ground + edge.rise))
        else:
            rises = edges[k + 1].rise if k < len(edges) - 1 else 0.0
            step = Step(edge.rise, depth=after, before=before, beyond=max(rises, 0.0))
            found.append(Leg(step, False, edge.x, ground))
        ground += edge.rise
    return tuple(found)


def backwards(motion: Motion) -> Motion:
    """The same in the other direction of time."""
    end = motion.duration
    phases = tuple(
        Phase(f"down {p.name}", end - p.end, end - p.start) for p in reversed(motion.phases)
    )
    return Motion(
        time=end - motion.time[::-1],
        q=motion.q[::-1],
        rates=-motion.rates[::-1],
        belts=-motion.belts[::-1],
        T_step_root=motion.T_step_root[::-1],
        support=motion.support[::-1],
        held=motion.held[::-1],
        torques=motion.torques[::-1],
        phases=phases,
    )


def turned(motion: Motion) -> Motion:
    """Seen from the other side: x and y of the step frame the other way (down, going ahead)."""
    T = motion.T_step_root.copy()
    T[:, :2] *= -1.0
    held = motion.held * np.array([-1.0, 1.0])
    support = motion.support[:, ::-1] * np.array([-1.0, 1.0])
    return replace(motion, belts=-motion.belts, T_step_root=T, held=held, support=support)


def shifted(motion: Motion, x: float, z: float) -> Motion:
    """In the course's frame."""
    T = motion.T_step_root.copy()
    T[:, 0, 3] += x
    T[:, 2, 3] += z
    support = motion.support + np.array([x, 0.0])
    return replace(motion, T_step_root=T, held=motion.held + np.array([x, z]), support=support)


def drive(climber: Climber, q: Array, x: tuple[float, float], z: float, dt: float) -> Motion:
    """Straight ahead on level ground at height z, from one x of P_b to another, the arm still."""
    way = x[1] - x[0]
    machine, pace = climber.machine, climber.demands.pace
    top = pace * machine.tracks.max_speed
    duration = max(1.0, 2.1875 * abs(way) / top)
    duration = max(
        duration, math.sqrt(7.5132 * abs(way) / (pace * machine.tracks.max_acceleration))
    )
    count = max(2, round(duration / dt)) + 1
    u = np.linspace(0.0, 1.0, count)
    law = smooth_step(u)
    places = x[0] + way * law.value
    T = climber.root_poses(places, np.full(count, z), np.zeros(count))
    rows = np.broadcast_to(q, (count, len(q)))
    stance = on_ground(climber, 0.0, 0.0)
    support = stance.lines[None, :, [0, 2]] + np.stack([places, np.zeros(count)], axis=1)[:, None]
    torques = weights_of(climber, T[:1], rows[:1]).gravity
    return Motion(
        time=u * duration,
        q=rows,
        rates=np.zeros(rows.shape),
        belts=way * law.first / duration,
        T_step_root=T,
        support=support,
        held=np.full((count, 2), np.nan),
        torques=np.broadcast_to(torques, rows.shape),
        phases=(Phase("drive", 0.0, duration),),
    )
