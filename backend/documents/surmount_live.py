"""A manoeuvre's task from a live snapshot: the machine at rest before a step, among all that is
known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from backend.collision.closest import closest_pairs
from backend.documents.plan_live import FAST, kept, people_of, unknown
from backend.documents.surmount_state import SurmountRequest
from backend.errors import InputError
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.pipeline.surroundings import within
from backend.pipeline.working_gauge import site_of
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.rotation import to_attitude
from backend.spatial.types import Array, BoolArray

AHEAD = math.radians(45.0)
"""A step whose edge is turned farther from the tracks than this is not ahead [rad]."""
SQUARE = math.radians(2.0)
"""A machine turned farther from the way across the edge than this has to square up first [rad]."""
LEAST = 0.01
"""Lower than this over the ground is no step [m]."""
NEARER = 0.05
"""What is measured anew may seem this much nearer than before [m]."""
TRAVEL = 15.0
"""Beyond the edge, no manoeuvre goes [m]."""
CONTACT = 0.01
"""Contact, whatever was near before [m]."""
INSTANTS = 150
"""Of a manoeuvre that are held against the scene."""


@dataclass(frozen=True)
class Step:
    """What is to be surmounted, seen from the middle of the tracks. height: over the ground of the
    machine [m], negative downwards; distance: to the edge across it [m]; angle: of the machine to
    the way across the edge [rad]; depth: behind the edge [m], infinite without end.
    """

    name: str
    height: float
    distance: float
    angle: float = 0.0
    depth: float = math.inf


@dataclass(frozen=True, eq=False)
class LiveSurmount:
    """What is looked for, as it was at `time` [s] of the snapshot's clock. T_site_root: (4, 4);
    q: (n,) [rad]; boxes, names: all that the machine must not touch, in the site frame, without
    the step; keep: what the limiter keeps from it [m]; parameters: given, else searched for.
    """

    machine: str
    time: float
    asked: SurmountRequest
    step: Step
    T_site_root: Array
    q: Array
    boxes: Boxes
    names: tuple[str, ...]
    keep: float


def live_surmount(asked: SurmountRequest, snapshot: Snapshot, config: Config) -> LiveSurmount:
    """Raises InputError for what makes no sense, and while anything is not known that counts."""
    name = asked.machine
    if name not in config.own:
        raise InputError(f'machine is "{name}"; allowed are {", ".join(config.own)}.')
    why = unknown(name, snapshot, config)
    if why:
        raise InputError(f"{why}: nothing is planned before that is known.")
    state, machine = snapshot.machines[name], config.machines[name]
    assert state.body is not None
    label = config.labels[name]
    if not machine.masses_trusted:
        raise InputError(f"{label}: its masses are not known; a manoeuvre needs all of them.")
    rates = state.pose.joint_velocities
    if not (np.abs(rates) < FAST).all():
        role = machine.joints[int(np.nanargmax(np.abs(rates)))].role
        raise InputError(f"{label} moves ({role}); a manoeuvre begins at rest.")
    T_site_root = state.body.link_poses[0]
    step = _asked_step(asked, T_site_root, config)
    if abs(step.angle) > SQUARE:
        side = "right" if step.angle > 0.0 else "left"
        raise InputError(
            f"{label} is turned by {math.degrees(abs(step.angle)):.0f} degrees from the way across "
            f"the edge: turn it {side} to within {math.degrees(SQUARE):.0f} degrees of that."
        )
    boxes, names, keep = around(name, step, snapshot, config)
    q = np.clip(state.pose.joints, machine.lower, machine.upper)
    return LiveSurmount(name, snapshot.time, asked, step, T_site_root, q, boxes, names, keep)


def around(
    name: str, step: Step, snapshot: Snapshot, config: Config
) -> tuple[Boxes, tuple[str, ...], float]:
    """All that the placed machine `name` could meet but the step, in the site frame, its names, and
    what the limiter keeps from it [m]. Raises InputError while that is not known.
    """
    keep = kept(name, snapshot, config)
    if not math.isfinite(keep):
        raise InputError(f"{config.labels[name]}: how far poses may be wrong is not known.")
    body = snapshot.machines[name].body
    assert body is not None
    site = site_of(name, snapshot.gauge, config)
    boxes, names = [site.boxes], [*site.full_names]
    for other, state in snapshot.machines.items():
        if other != name and state.body is not None:
            boxes.append(state.body.boxes)
            names += [f"{other}:{part}" for part in config.machines[other].body_names]
    people, whose = people_of(snapshot, config)
    found, names = concatenated([*boxes, people]), [*names, *whose]
    radius = config.machines[name].bounding_radius + step.distance + TRAVEL
    near = within(found, body.swing_center, radius).tolist()
    on = [k for k in near if not _is(names[k], step.name)]
    return found.take(np.array(on, dtype=np.int64)), tuple(names[k] for k in on), keep


def step_of(name: str, boxes: Boxes, k: int, T_site_root: Array) -> Step | str:
    """The step that box k is for a machine that stands at T_site_root (4, 4), or why it is none."""
    R, half = boxes.rotations[k], boxes.half_extents[k]
    up = int(np.argmax(np.abs(R[2])))
    if abs(float(R[2, up])) < math.cos(math.radians(3.0)):
        return f"{name} does not stand upright: it has no level top."
    p = T_site_root[:3, 3]
    height = float(boxes.centers[k][2] + half[up] - p[2])
    yaw = float(to_attitude(T_site_root[:3, :3])[0])
    heading = np.array([math.cos(yaw), math.sin(yaw)])
    across = [j for j in range(3) if j != up]
    from_centre = p[:2] - boxes.centers[k][:2]
    on_top = all(abs(float(from_centre @ R[:2, j])) < half[j] for j in across)
    if abs(height) < LEAST and on_top:
        return _down(name, boxes, k, (across, up), p, heading)
    if height < LEAST:
        return f"{name} is not higher than the ground of the machine."
    found = []
    for j in across:
        normal = R[:2, j] / float(np.hypot(*R[:2, j]))
        side = 1.0 if float(from_centre @ normal) > 0.0 else -1.0
        way = -side * normal  # across the face that is nearest to the machine
        distance = float(from_centre @ (side * normal)) - float(half[j])
        angle = math.atan2(float(way[0] * heading[1] - way[1] * heading[0]), float(way @ heading))
        found.append((abs(angle), distance, angle, float(2.0 * half[j]), 3 - up - j))
    _, distance, angle, depth, beside = min(found)
    if abs(angle) > AHEAD or distance <= 0.0:
        return f"{name} is not ahead of the machine: drive until it faces an edge of it."
    aim = p[:2] + heading * distance / math.cos(angle)
    off = abs(float((aim - boxes.centers[k][:2]) @ R[:2, beside]))
    if off > half[beside]:
        return f"{name}: the machine heads {off - half[beside]:.1f} m past its edge."
    return Step(name, height, distance, angle, depth)


def _down(
    name: str,
    boxes: Boxes,
    k: int,
    axes: tuple[list[int], int],
    p: Array,
    heading: Array,
) -> Step:
    """From the top of a box down over the edge ahead."""
    across, up = axes
    R, half, centre = boxes.rotations[k], boxes.half_extents[k], boxes.centers[k]
    found = []
    for j in across:
        normal = R[:2, j] / float(np.hypot(*R[:2, j]))
        way = normal if float(normal @ heading) > 0.0 else -normal
        angle = math.atan2(float(way[0] * heading[1] - way[1] * heading[0]), float(way @ heading))
        found.append((abs(angle), float(half[j] - (p[:2] - centre[:2]) @ way), angle))
    _, distance, angle = min(found)
    return Step(name, -float(2.0 * half[up]), distance, angle)


def blocked(
    machine: Machine,
    q: Array,
    T_site_root: Array,
    boxes: Boxes,
    names: tuple[str, ...],
    keep: float,
    before: Mapping[str, float],
) -> tuple[int, str, float] | None:
    """The first of postures q (m, n) on bases (m, 4, 4) that comes nearer than `keep` [m] to a box
    of the site frame, by whose name and how near; None where nothing does. before: how near what
    was near at the beginning was, as near as which the machine may be.
    """
    if not len(boxes):
        return None
    rows = np.unique(np.linspace(0, len(q) - 1, min(INSTANTS, len(q))).round().astype(int))
    poses = link_poses(machine, q[rows], T_site_root[rows])
    reach = machine.max_reach + keep + 1.0
    near = _within(boxes, T_site_root[rows][:, :3, 3], reach)
    boxes, names = boxes.take(near), tuple(n for n, on in zip(names, near, strict=True) if on)
    if not len(boxes):
        return None
    least = np.array([max(CONTACT, min(keep, before.get(n, np.inf) - NEARER)) for n in names])
    for row, one in zip(rows, poses, strict=True):
        found = closest_pairs(body_boxes(machine, one), boxes, keep)
        bad = np.flatnonzero(found.distance < least[found.index[:, 1]])
        if len(bad):
            k = int(bad[0])
            return int(row), names[found.index[k, 1]], float(found.distance[k])
    return None


def nearest_now(
    machine: Machine,
    q: Array,
    T_site_root: Array,
    boxes: Boxes,
    names: tuple[str, ...],
    keep: float,
) -> dict[str, float]:
    """By name what is nearer than `keep` [m] to a machine at q (n,) on a base (4, 4)."""
    if not len(boxes):
        return {}
    found = closest_pairs(body_boxes(machine, link_poses(machine, q, T_site_root)), boxes, keep)
    near: dict[str, float] = {}
    for (_, j), d in zip(found.index, found.distance, strict=True):
        if d < keep:
            near[names[j]] = min(float(d), near.get(names[j], math.inf))
    return near


def _within(boxes: Boxes, points: Array, reach: float) -> BoolArray:
    """(k,) whether a box may come within `reach` [m] of one of points (m, 3)."""
    off = np.linalg.norm(boxes.centers[None] - points[:, None], axis=2).min(axis=0)
    return np.asarray(off < reach + np.linalg.norm(boxes.half_extents, axis=1))


def _asked_step(asked: SurmountRequest, T_site_root: Array, config: Config) -> Step:
    if asked.step is not None:
        given = asked.step
        depth = math.inf if given.depth is None else given.depth
        return Step("", given.height, given.distance, given.angle, depth)
    standing, name = config.site.standing, asked.obstacle or ""
    names = sorted({one.split("/")[0] for one in standing.names})
    mine = [k for k, one in enumerate(standing.names) if _is(one, name)]
    if not mine:
        known = ", ".join(names) if names else "none, the site has no obstacles"
        raise InputError(f'obstacle is "{name}"; allowed are {known}.')
    found = [step_of(name, standing.boxes, k, T_site_root) for k in mine]
    steps = [one for one in found if isinstance(one, Step)]
    if not steps:
        raise InputError(f"{found[0]}")
    return min(steps, key=lambda step: step.distance)


def _is(box: str, name: str) -> bool:
    """Whether a box, "site:step", "step" or "step/0", belongs to what is called so."""
    bare = box.removeprefix("site:")
    return bool(name) and (bare == name or bare.split("/")[0] == name)
