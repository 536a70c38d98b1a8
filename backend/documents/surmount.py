"""A manoeuvre as a document: what `cockpit surmount` prints and the page shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.documents.scene import make_scene
from backend.documents.surmount_document import (
    SurmountChecks,
    SurmountDocument,
    SurmountObstacle,
    SurmountPhase,
)
from backend.documents.surmount_live import SQUARE, blocked, step_of
from backend.documents.surmount_live import Step as Ahead
from backend.documents.surmount_side import base_poses
from backend.documents.surmount_task import GivenParameters, SurmountTaskDocument
from backend.documents.surmount_told import (
    assumptions,
    between,
    candidate,
    figures_of,
    legs_of,
    margin_of,
    parameters_of,
    share,
)
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.spatial import rotation
from backend.spatial.boxes import concatenated
from backend.spatial.types import Array
from backend.surmount.course import Edge, legs
from backend.surmount.laws import smooth_step
from backend.surmount.machine import climber
from backend.surmount.plan import Effort, Open, Plan, Refusal, demands_of, plan
from backend.surmount.records import Demands, Parameters
from backend.surmount.search import Told

ROWS = 0.05
"""Between two rows of a document [s]."""
LEVEL = math.radians(2.0)
"""A machine that leans more than this stands on no level ground [rad]."""


@dataclass(frozen=True, eq=False)
class Asked:
    """Over which edges a machine is to go. T_frame_root: (4, 4); q: (n,) [rad]; edges: along the
    way across them, from the first; distance: from the swing axis to that [m]; angle: of the
    machine to that way [rad]; name: of the obstacle.
    """

    name: str
    machine: Machine
    demands: Demands
    T_frame_root: Array
    q: Array
    edges: tuple[Edge, ...]
    distance: float
    angle: float
    depth: float
    obstacle: str
    effort: Effort
    given: Parameters | None = None
    spline: bool = False
    p4: float | None = None


def surmount_document(
    task: SurmountTaskDocument,
    machines: dict[str, Machine],
    frame: SiteFrame | None,
    opened: Open,
    told: Told,
    where: str = "task",
    site: SiteBodies = NO_SITE_BODIES,
) -> SurmountDocument:
    """A manoeuvre or why there is none; raises InputError for a task that makes no sense.

    machines: the description of every machine of the state; opened: what simulates; told: hears of
    the progress, and says whether to go on.
    """
    if task.machine not in machines:
        known = ", ".join(machines)
        raise InputError(f'{where}: machine "{task.machine}" is not in state; allowed are {known}.')
    scene = make_scene(task.state, machines, frame, where, site)
    machine, body = machines[task.machine], scene.placed[task.machine]
    T = body.link_poses[0]
    name, distance, angle, depth = "", 0.0, task.angle, math.inf
    edges: tuple[Edge, ...] = ()
    if task.obstacle is not None:
        ahead = _named(task.obstacle, scene.site, T, where)
        name, distance, angle, depth = ahead.name, ahead.distance, ahead.angle, ahead.depth
        edges = edges_of(ahead, task.over)
    else:
        distance = task.edges[0].distance + climber(machine, _demands(task, machine)).crawler.middle
        edges = tuple(Edge(e.distance - task.edges[0].distance, e.rise) for e in task.edges)
        _follow_each_other(edges, where)
        depth = edges[1].x if len(edges) > 1 else math.inf
    given = None if task.parameters is None else _given(task.parameters)
    asked = Asked(
        task.machine,
        machine,
        _demands(task, machine),
        T,
        np.clip(scene.poses[task.machine].joints, machine.lower, machine.upper),
        edges,
        distance,
        angle,
        depth,
        name,
        task.effort if given is None else "given",
        given,
        task.spline,
        task.p4,
    )
    made = document_of(asked, opened, told, scene.origin)
    if not made.ok:
        return made
    # Everything else that stands there, partners included.
    others = {n: one.boxes for n, one in scene.placed.items() if n != task.machine}
    boxes = concatenated([scene.site.boxes, *others.values()])
    names = (*scene.site.names, *(n for n, one in others.items() for _ in range(len(one))))
    left = np.array([not _same(one, name) for one in names], dtype=bool)
    boxes, names = boxes.take(left), tuple(n for n, on in zip(names, left, strict=True) if on)
    base = np.array(made.base)
    base[:, :3] -= scene.origin
    poses = base_poses(base)
    keep = asked.demands.clearance + scene.eta(task.machine)
    hit = blocked(machine, np.array(made.joints), poses, boxes, names, keep, {})
    if hit is not None:
        why = f"{hit[1]} is in its way after {made.time[hit[0]]:.0f} s: {max(hit[2], 0.0):.2f} m"
        return SurmountDocument(
            ok=False, why=why, kind="collision", machine=task.machine, obstacle=made.obstacle
        )
    return made


def _follow_each_other(edges: tuple[Edge, ...], where: str) -> None:
    try:
        legs(edges)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def edges_of(ahead: Ahead, over: bool) -> tuple[Edge, ...]:
    """Of a box ahead: up, and down its other side where that is wanted."""
    first = Edge(0.0, ahead.height)
    if over and math.isfinite(ahead.depth):
        return first, Edge(ahead.depth, -ahead.height)
    return (first,)


def document_of(
    asked: Asked, opened: Open, told: Told, origin: Array | None = None
) -> SurmountDocument:
    """The manoeuvre, or why there is none. origin: (3,) added to what is told [m]."""
    machine = asked.machine
    obstacle = SurmountObstacle(
        name=asked.obstacle,
        height=asked.edges[0].rise,
        distance=asked.distance,
        angle=asked.angle,
        depth=asked.depth if math.isfinite(asked.depth) else None,
    )
    refused = SurmountDocument(ok=False, machine=asked.name, obstacle=obstacle)
    yaw, pitch, roll = (float(v) for v in rotation.to_attitude(asked.T_frame_root[:3, :3]))
    if max(abs(pitch), abs(roll)) > LEVEL:
        lean = math.degrees(max(abs(pitch), abs(roll)))
        why = f"it leans by {lean:.1f} degrees; a manoeuvre begins on level ground"
        return refused.model_copy(update={"kind": "stability", "why": why})
    up = climber(machine, asked.demands)
    x = up.crawler.middle - asked.distance
    if -x < up.a + up.r:
        short = up.a + up.r + x
        why = f"the edge is {short:.2f} m nearer than the end of the tracks: drive back first"
        return refused.model_copy(update={"kind": "room", "why": why})
    made = plan(
        machine,
        asked.demands,
        asked.edges,
        x,
        asked.q,
        opened,
        asked.effort,
        asked.given,
        asked.spline,
        asked.p4,
        asked.depth if len(asked.edges) == 1 else math.inf,
        told,
    )
    if isinstance(made, Refusal):
        return refused.model_copy(update={"kind": made.kind, "why": made.why})
    squared = yaw - asked.angle
    way = np.array([math.cos(squared), math.sin(squared), 0.0])
    T_frame_course = np.eye(4)
    T_frame_course[:3, :3] = rotation.rz(squared)
    T_frame_course[:3, 3] = asked.T_frame_root[:3, 3] + asked.distance * way
    return _document(
        asked, refused, made, T_frame_course, np.zeros(3) if origin is None else origin
    )


def _document(
    asked: Asked, base: SurmountDocument, made: Plan, T_frame_course: Array, origin: Array
) -> SurmountDocument:
    motion, run, machine = made.motion, made.run, asked.machine
    dt = float(motion.time[1] - motion.time[0])
    rows = np.arange(0, len(motion.time), max(1, round(ROWS / dt)))
    rows = rows if rows[-1] == len(motion.time) - 1 else np.append(rows, len(motion.time) - 1)
    T = T_frame_course @ motion.T_step_root[rows]
    tracks = np.repeat(asked.demands.facing * motion.belts[rows, None], 2, axis=1)
    time, q, rates = motion.time[rows], motion.q[rows], motion.rates[rows]
    phases = [
        SurmountPhase(
            name=phase.name,
            start=phase.start,
            end=phase.end,
            energy=between(motion.time, run.energy, phase.start, phase.end),
            min_stability_margin=margin_of(made, phase.name, number),
        )
        for number, phase in zip(legs_of(made), motion.phases, strict=True)
    ]
    notes: list[str] = []
    figures = figures_of(machine, made)
    if abs(asked.angle) > SQUARE:
        turning = _squared_up(asked, machine)
        shift = turning[0][-1] + dt
        time = np.concatenate([turning[0], time + shift])
        q = np.concatenate([np.broadcast_to(q[0], (len(turning[0]), q.shape[1])), q])
        rates = np.concatenate([np.zeros((len(turning[0]), rates.shape[1])), rates])
        tracks = np.concatenate([turning[1], tracks])
        T = np.concatenate([turning[2], T])
        first = SurmountPhase(name="square up", start=0.0, end=float(turning[0][-1]))
        later = [
            p.model_copy(update={"start": p.start + shift, "end": p.end + shift}) for p in phases
        ]
        phases = [first, *later]
        # Of what was simulated, which begins when it faces the edge.
        later_times = [round(t + float(shift), 3) for t in figures.time]
        later_phases = [k + 1 for k in figures.phase]
        figures = figures.model_copy(update={"time": later_times, "phase": later_phases})
        notes.append("squaring up on the spot was not simulated: what tracks do when they turn is")
        notes[-1] += " not known beforehand"
    told = T.copy()
    told[:, :3, 3] += origin
    yaw, pitch, roll = rotation.to_attitude(T[:, :3, :3])
    leg = made.legs[0]
    sequences = sum(p.energy or 0.0 for p in phases if "sequence" in p.name)
    every = sum(p.energy or 0.0 for p in phases)
    moves = [move for one in made.legs for move in one.made.moves]
    clearance = asked.demands.clearance
    cleared = [clearance + one.made.verdict.left["bodies"] for one in made.legs]
    return base.model_copy(
        update={
            "ok": True,
            "method": leg.found.by,
            "duration": float(time[-1]),
            "time": time.tolist(),
            "roles": [joint.role for joint in machine.joints],
            "joints": q.tolist(),
            "joint_velocities": rates.tolist(),
            "tracks": tracks.tolist(),
            "base": np.column_stack([told[:, :3, 3], yaw, pitch, roll]).tolist(),
            "end_point": end_point(machine, q, told).tolist(),
            "phases": phases,
            "energy": sequences,
            "energy_moves": every - sequences,
            "energy_quasi_static": sum(one.made.verdict.energy for one in made.legs),
            "energy_potential": sum(s.potential for one in made.legs for s in one.made.sequences),
            "parameters": parameters_of(leg.found),
            "candidates": [candidate(one, made) for one in leg.candidates],
            "checks": SurmountChecks(
                min_clearance=min([*cleared, *(m.clearance for m in moves)]),
                min_stability_margin=min(one.made.margin for one in made.legs),
                max_penetration=run.deepest,
                max_slip=run.slip,
                worst_torque=share(np.abs(run.torques).max(axis=0), machine.max_torque),
                worst_rate=share(np.abs(run.rates).max(axis=0), machine.max_velocity),
            ),
            "figures": figures,
            "assumptions": assumptions(machine, made),
            "notes": notes,
        }
    )


def _squared_up(asked: Asked, machine: Machine) -> tuple[Array, Array, Array]:
    """Time, tracks (m, 2) and T (m, 4, 4) of turning on the spot until it faces the edge."""
    tracks = machine.tracks
    way = abs(asked.angle) * 0.5 * tracks.gauge
    duration = max(2.0, 2.1875 * way / (asked.demands.pace * tracks.max_speed))
    time = np.linspace(0.0, duration, max(2, round(duration / ROWS)) + 1)
    law = smooth_step(time / duration)
    turn = -asked.angle * law.value
    speed = -asked.angle * law.first / duration * 0.5 * tracks.gauge
    T = np.tile(asked.T_frame_root, (len(time), 1, 1))
    T[:, :3, :3] = rotation.rz(turn) @ asked.T_frame_root[:3, :3]
    return time, np.stack([-speed, speed], axis=1), T


def _named(obstacle: str, site: SiteBodies, T: Array, where: str) -> Ahead:
    mine = [k for k, one in enumerate(site.names) if _same(one, obstacle)]
    if not mine:
        known = ", ".join(sorted({one.split("/")[0] for one in site.names}))
        raise InputError(
            f'{where}: obstacle is "{obstacle}"; allowed are '
            f"{known or 'none: neither state nor site has any'}."
        )
    found = [step_of(obstacle, site.boxes, k, T) for k in mine]
    steps = [one for one in found if isinstance(one, Ahead)]
    if not steps:
        raise InputError(f"{where}: {found[0]}")
    return min(steps, key=lambda step: step.distance)


def _same(box: str, name: str) -> bool:
    bare = box.removeprefix("site:")
    return bool(name) and (bare == name or bare.split("/")[0] == name)


def _demands(task: SurmountTaskDocument, machine: Machine) -> Demands:
    return demands_of(machine, task.payload, task.friction, task.clearance, task.margin, task.pace)


def _given(given: GivenParameters) -> Parameters:
    return Parameters(given.p1, given.p2, given.p3, given.p4, given.alpha_f)
