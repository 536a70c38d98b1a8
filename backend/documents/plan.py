"""One trajectory task, planned: what `cockpit plan` prints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backend.cspace.joint_image import certified4
from backend.cspace.regions import cell_of, regions
from backend.documents.plan_document import (
    CylindricalLimits,
    LimitsDocument,
    PlanChecks,
    PlanDocument,
    PlanTaskDocument,
)
from backend.documents.plan_figures import figures
from backend.documents.scene import Scene, make_scene
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.planning.trajectory.carry import goals
from backend.planning.trajectory.penalty import Iteration
from backend.planning.trajectory.plan import Method, plan
from backend.planning.trajectory.records import (
    Cylindrical,
    Obstacles,
    Refusal,
    Task,
    Trajectory,
)
from backend.planning.trajectory.sweep import make_sweep
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.spatial import transform
from backend.spatial.types import Array

PROOF_SHAPE = (96, 32, 32, 32)
"""Cells of the certified image on which a way is proven not to exist."""


def plan_document(
    asked: PlanTaskDocument,
    machines: dict[str, Machine],
    frame: SiteFrame | None,
    where: str = "task",
    site: SiteBodies = NO_SITE_BODIES,
    method: Method | None = None,
    told: Callable[[Iteration], None] | None = None,
) -> PlanDocument:
    """A trajectory or why there is none; raises InputError for a task that makes no sense.

    machines: the description of every machine of the state; site: what stands on the site besides;
    method: the task's when None; told: hears of every step of the penalty method.
    """
    if asked.machine not in machines:
        known = ", ".join(machines)
        raise InputError(
            f'{where}: machine "{asked.machine}" is not in state; allowed are {known}.'
        )
    scene = make_scene(asked.state, machines, frame, where, site)
    machine, body = machines[asked.machine], scene.placed[asked.machine]
    task = _task(asked, scene, where)
    around = scene.around(asked.machine)
    obstacles = Obstacles(around.boxes, around.names, asked.ground)
    T = body.link_poses[0].copy()
    T[:3, 3] += scene.origin
    method = asked.method if method is None else method
    return planned(asked.machine, machine, task, obstacles, T, method, told)[0]


def planned(
    name: str,
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    T_frame_root: Array,
    method: Method = "toppra",
    told: Callable[[Iteration], None] | None = None,
) -> tuple[PlanDocument, Trajectory | None]:
    """A task planned, as a document and as what can be followed.

    name: of the machine; T_frame_root: (4, 4) to the frame in which end points are told; told: of
    each of the penalty method's iterations.
    """
    made = plan(machine, task, obstacles, method, told)
    document = PlanDocument(
        ok=isinstance(made, Trajectory) and not made.violations,
        machine=name,
        method=method,
        clearance=task.clearance,
    )
    if isinstance(made, Refusal):
        made = proven(machine, task, obstacles, made)
        refused = document.model_copy(
            update={
                "why": made.why,
                "kind": made.kind,
                "blockers": list(made.blockers),
                "proven": made.proven,
            }
        )
        return refused, None
    points = end_point(machine, made.q, T_frame_root)
    checks = made.checks
    if made.violations:
        why = f"the {method} method's result is violated: {' '.join(made.violations)}"
        broken = {"why": why, "kind": "check", "proven": False, "violations": [*made.violations]}
        document = document.model_copy(update=broken)
    found = document.model_copy(
        update={
            "duration": made.duration,
            "time": made.time.tolist(),
            "roles": [joint.role for joint in machine.joints],
            "joints": made.q.tolist(),
            "joint_velocities": made.rates.tolist(),
            "joint_accelerations": made.accelerations.tolist(),
            "end_point": points.tolist(),
            "checks": PlanChecks(
                min_clearance=_finite(checks.min_clearance),
                min_own_clearance=_finite(checks.min_own),
                min_ground_clearance=_finite(checks.min_ground),
                min_stability_margin=_finite(checks.min_stability_margin),
                worst_rate=checks.worst_rate,
                worst_acceleration=checks.worst_acceleration,
                samples=checks.samples,
            ),
            "figures": figures(machine, task, made, T_frame_root),
            "way": made.way,
            "notes": list(made.notes),
        }
    )
    return found, made


def proven(
    machine: Machine,
    task: Task,
    obstacles: Obstacles,
    refusal: Refusal,
    shape: tuple[int, int, int, int] = PROOF_SHAPE,
) -> Refusal:
    """The refusal, proven where the goal's posture is cut off in the certified image.

    Whatever the bucket's attitude on the way, no cell that may be free leads from the start to the
    goal: those of the image that are not certified colliding, bodies as built, without clearance.
    """
    if refusal.kind != "not found":
        return refusal
    ends = goals(machine, task, make_sweep(machine, obstacles, task.clearance).relaxed(task.q))
    if isinstance(ends, Refusal):
        return refusal
    layers = {"site": obstacles.boxes}
    try:
        image = certified4(machine, layers, 0.0, shape, task.q)
    except ValueError:
        return refusal  # the arm does not move in a plane: there is no such image
    grid = image.grid
    edges = [grid.edges(k) for k in range(4)]
    lower = np.array([e[0] for e in edges])
    steps = np.array([e[1] - e[0] for e in edges])

    def cell(q: Array) -> tuple[int, ...]:
        posture = q[:4].copy()
        if machine.joints[0].continuous:
            posture[0] = lower[0] + (posture[0] - lower[0]) % (2.0 * np.pi)
        return cell_of(lower, steps, shape, posture)

    found = regions(~image.certified_colliding(), cell(task.q), machine.joints[0].continuous)
    there = int(found.labels[cell(ends[0])])
    if found.present == 0 or there == 0 or there == found.present:
        return refusal
    told = " and ".join(refusal.blockers[:2]) or "obstacles"
    why = (
        f"no way exists to the goal in that posture, whatever the clearance: {told} cut it off "
        f"from the start, proven on {' x '.join(map(str, shape))} cells of joint space."
    )
    return Refusal("blocked", why, refusal.blockers, proven=True)


def _task(asked: PlanTaskDocument, scene: Scene, where: str) -> Task:
    name = asked.machine
    machine, body, goal = scene.machines[name], scene.placed[name], asked.goal
    T_site_root = body.link_poses[0]
    if goal.end_point is not None:
        p = np.array(goal.end_point) - scene.origin
    else:
        assert goal.theta is not None
        assert goal.r is not None
        assert goal.z is not None
        ahead = goal.r * np.array([np.cos(goal.theta), np.sin(goal.theta)])
        p = np.array([*(body.swing_center[:2] + ahead), goal.z - scene.origin[2]])
    limits = asked.limits
    return Task(
        # Sensors may tell joints a little beyond their ends.
        q=np.clip(scene.poses[name].joints, machine.lower, machine.upper),
        p_root=transform.apply(transform.inverse(T_site_root), p[None])[0],
        attitude=goal.attitude,
        band=asked.attitude_band,
        payload=asked.payload,
        clearance=asked.clearance + scene.eta(name),
        lift=asked.lift,
        share=asked.stability_share,
        speeds=by_role(machine, limits, "joint_velocities", where),
        accelerations=by_role(machine, limits, "joint_accelerations", where),
        cylindrical=cylindrical(limits.cylindrical),
        T_site_root=T_site_root,
    )


def by_role(machine: Machine, limits: LimitsDocument, which: str, where: str) -> Array:
    """(n,) of the limits called `which`, infinite where none is given. Raises InputError."""
    roles = [joint.role for joint in machine.joints]
    values = np.full(len(roles), np.inf)
    for role, value in getattr(limits, which).items():
        if role not in roles:
            raise InputError(
                f"{where}: limits.{which}.{role} is not a joint of {machine.name}; allowed are "
                f"{', '.join(roles)}."
            )
        values[roles.index(role)] = value
    return values


def cylindrical(given: CylindricalLimits) -> Cylindrical:
    """The same limits as arrays, infinite where none is given."""

    def three(what: str) -> Array:
        values = [getattr(given, f"{axis}_{what}") for axis in ("theta", "r", "z")]
        return np.array([np.inf if v is None else v for v in values])

    return Cylindrical(three("velocity"), three("acceleration"))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
