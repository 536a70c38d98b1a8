"""Trajectories that operators ask for: planned beside the running machines, and watched while on
offer. Nothing here moves a machine; following one is `driving`'s.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from backend.control.follow import NEAR, Trajectory
from backend.documents.plan_document import PlanDocument
from backend.documents.plan_figures import series
from backend.documents.plan_live import Announced, LiveTask, kept, live_task, obstacles_of, unknown
from backend.documents.plan_state import PlanRequest
from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.planning.trajectory.figures import seen_motion
from backend.shell.aside import Aside, WorkerGone
from backend.shell.plan_worker import Answer, Look, begin
from backend.shell.standing import elsewhere, off_by
from backend.spatial.angles import wrap
from backend.spatial.types import Array

log = logging.getLogger(__name__)

WATCHED = 0.5
"""Between two looks at whether plans still hold [s]."""
OLD = 3.0
"""Not looked at for longer than this, whether a plan holds is not known [s]."""
SAME = math.radians(1.0)
"""How near the end of a trajectory must be to joint values that were asked for [rad]."""

LONGEST = 10_000
"""Cycles of a followed trajectory that are kept."""
SHOWN = 400
"""Of these at most so many are told."""

Seen = tuple[float, float, Array, Array]

LIVING = ("offered", "unknown")


class Progress(NamedTuple):
    """What is followed with a machine: the plan's name, the path's time [s], why it is over, and
    whether it arrived.
    """

    plan: str
    at: float
    ended: str
    arrived: bool


@dataclass(frozen=True, eq=False)
class Plan:
    """A machine's newest. looked: when it was held against the scene last, by this clock [s];
    seen: of every cycle in which it was followed, the path's time, the pose's, joints and rates.
    """

    name: str
    who: str
    asked: PlanRequest
    live: LiveTask
    state: str = "planning"
    why: str = ""
    answer: Answer | None = None
    looked: float = -math.inf
    text: str = ""
    seen: deque[Seen] = field(default_factory=lambda: deque(maxlen=LONGEST))


class PlanDesk:
    """All methods may be called from any thread.

    latest: the newest snapshot; followed: what is followed with a machine, None for nothing; told:
    of every request, what was done, by whom, with what details.
    """

    def __init__(
        self,
        config: Config,
        latest: Callable[[], Snapshot | None],
        followed: Callable[[str], Progress | None],
        told: Callable[[str, str, dict[str, Any]], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config, self._latest, self._followed = config, latest, followed
        self._told, self._clock = told, clock
        machines = {name: config.machines[name] for name in config.own}
        self._aside: Aside[LiveTask | Look, Any] = Aside(
            partial(begin, machines), "plans trajectories"
        )
        self._lock = threading.Lock()
        self._plans: dict[str, Plan] = {}
        self._count = 0
        self._closing, self._wake = False, threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, asked: PlanRequest, who: str) -> str:
        """Begin to plan; the plan's name. The machine's plan of before is on offer no more.

        Raises InputError for what cannot be, and while the machine's plan is being followed.
        """
        snapshot = self._latest()
        if snapshot is None:
            raise InputError("no cycle has finished yet; try again.")
        live = live_task(asked, snapshot, self._config, self._announced(asked.machine))
        progress = self._followed(asked.machine)
        if progress is not None and not progress.ended:
            raise InputError(f"{progress.plan} is being followed; drop it first.")
        with self._lock:
            self._count += 1
            name = f"{asked.machine}-{self._count}"
            self._plans[asked.machine] = Plan(name, who, asked, live)
            if self._thread is None and not self._closing:
                self._thread = threading.Thread(target=self._run, name="plans", daemon=True)
                self._thread.start()
        self._wake.set()
        self._told("plan", who, {"plan": name, **asked.model_dump(exclude_defaults=True)})
        return name

    def drop(self, machine: str, who: str) -> None:
        """Take a machine's plan off; who follows it does so no more."""
        with self._lock:
            gone = self._plans.pop(machine, None)
        if gone is not None:
            self._told("plan drop", who, {"plan": gone.name})

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        """What can be followed, or why that plan cannot."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            return found
        if found.state == "offered" and found.answer is not None:
            why = self._overlooked(found)
            return why or (found.answer.trajectory or f"{plan} has no trajectory")
        return f"{plan}: {found.why or found.state}"

    def over(self, machine: str, plan: str) -> str:
        """Why a plan that is followed must not be any more; empty while it may."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            return "the plan was dropped"
        return found.why if found.state in ("void", "none") else ""

    def document(self) -> dict[str, Any]:
        """By machine what backend.documents.plan_state.PlanOffer describes."""
        with self._lock:
            plans = dict(self._plans)
        return {machine: self._described(plan) for machine, plan in plans.items()}

    def text(self, machine: str, plan: str) -> str:
        """JSON of backend.documents.plan_document.PlanDocument. Raises InputError before it is."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            raise InputError(f"{found}.")
        if found.answer is None:
            raise InputError(f"{plan}: {found.why or 'is still being planned'}.")
        return found.text

    def way(self, machine: str, plan: str) -> tuple[PlanDocument, Array] | None:
        """The trajectory of a plan, and T_site_root (4, 4) where the machine stood for it."""
        found = self._of(machine, plan)
        if isinstance(found, str) or found.answer is None or found.answer.trajectory is None:
            return None
        return found.answer.document, found.live.T_site_root

    def keep(self, snapshot: Snapshot) -> None:
        """What the sensors saw of machines that follow; called in every cycle of the fast loop."""
        for machine in self._config.own:
            plan = self._plans.get(machine)
            if plan is None or plan.answer is None:
                continue
            progress = self._followed(machine)
            if progress is None or progress.plan != plan.name or progress.ended:
                continue
            pose = snapshot.machines[machine].pose
            if np.isfinite(pose.joints).all():
                row = progress.at, pose.time, pose.joints, pose.joint_velocities
                plan.seen.append(row)

    def followed(self, machine: str, plan: str) -> dict[str, Any]:
        """What backend.documents.plan_series.FollowedSeries describes. Raises InputError."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            raise InputError(f"{found}.")
        described = self._config.machines[machine]
        rows = _of_each_pose(list(found.seen))
        at, times = (np.array([row[k] for row in rows], dtype=float) for k in (0, 1))
        shape = len(rows), len(described.joints)
        q, rates = (np.array([row[k] for row in rows]).reshape(shape) for k in (2, 3))
        step = max(1, math.ceil(len(rows) / SHOWN))
        picked = np.arange(len(rows))[::-step][::-1]
        times -= times[:1].sum()
        motion = seen_motion(described, found.asked.payload, times, q, rates, picked)
        return {
            **series(described, motion, found.live.T_site_root),
            "at": np.round(at[picked], 3).tolist(),
            "joints": np.round(q[picked], 5).tolist(),
        }

    def close(self) -> None:
        """Give up whatever is planned, and end the process."""
        with self._lock:
            self._closing, thread = True, self._thread
        self._wake.set()
        if thread is not None:
            thread.join(timeout=5.0)
        self._aside.close()

    def look(self) -> None:
        """Hold every plan on offer against the newest snapshot."""
        snapshot = self._latest()
        with self._lock:
            plans = [plan for plan in self._plans.values() if plan.state in LIVING]
        for plan in plans:
            state, why = self._held(plan, snapshot)
            self._keep(plan, replace(plan, state=state, why=why, looked=self._clock()))

    def _run(self) -> None:
        while not self._closing:
            with self._lock:
                waiting = [plan for plan in self._plans.values() if plan.state == "planning"]
            if waiting:
                self._plan(waiting[0])
                continue
            self.look()
            self._wake.wait(WATCHED)
            self._wake.clear()

    def _plan(self, plan: Plan) -> None:
        try:
            answer: Answer = self._aside.ask(plan.live)
        except (RuntimeError, WorkerGone) as error:
            # What makes no sense is told by the planner in words; anything else is logged, too.
            why = str(error).removeprefix("InputError: ")
            if why == str(error):
                log.error("%s: %s", plan.name, error)
            self._keep(plan, replace(plan, state="none", why=why))
            return
        document = answer.document
        state, why = ("offered", "") if document.ok else ("none", document.why or "")
        if document.ok and not _at(plan.live.goal, answer.trajectory):
            state, why = "none", "those joint values are not reached with the elbow that way up."
            answer = answer._replace(trajectory=None)
        done = replace(
            plan,
            state=state,
            why=why,
            answer=answer,
            text=document.model_dump_json(),
            looked=self._clock(),
        )
        self._keep(plan, done)
        self._told("plan made", plan.who, {"plan": plan.name, "ok": document.ok, "why": why})

    def _held(self, plan: Plan, snapshot: Snapshot | None) -> tuple[str, str]:
        """Whether a plan on offer still holds, and why not."""
        machine, live, answer = plan.asked.machine, plan.live, plan.answer
        assert answer is not None
        assert answer.trajectory is not None
        if snapshot is None:
            return "unknown", "no cycle has finished yet"
        why = unknown(machine, snapshot, self._config)
        if why:
            return "unknown", why
        body, q = snapshot.machines[machine].body, snapshot.machines[machine].pose.joints
        assert body is not None
        why = elsewhere(live.T_site_root, body.link_poses[0])
        if why:
            return "void", why
        progress = self._followed(machine)
        at = 0.0
        if progress is not None and progress.plan == plan.name:
            if progress.ended:
                return ("done", "") if progress.arrived else ("void", progress.ended)
            at = progress.at
        if at <= 0.0:
            off = off_by(self._config.machines[machine], q, answer.trajectory.joints[0])
            if off > NEAR:
                moved = f"the machine moved, {math.degrees(off):.0f} degrees from where it begins"
                return "void", moved
        rows = answer.trajectory.joints[answer.trajectory.times >= at - 1e-9]
        keep = kept(machine, snapshot, self._config)
        obstacles = obstacles_of(machine, snapshot, self._config, ground=False)
        try:
            found: str = self._aside.ask(Look(machine, obstacles, rows, keep, answer.before))
        except (RuntimeError, WorkerGone) as error:
            log.error("%s: %s", plan.name, error)
            return "unknown", f"it cannot be held against the scene: {error}"
        return ("void", f"{found} is in its way now") if found else ("offered", "")

    def _announced(self, machine: str) -> dict[str, Announced]:
        """What is on offer or followed with the other machines, from where it is now."""
        with self._lock:
            plans = {k: plan for k, plan in self._plans.items() if k != machine}
        found = {}
        for other, plan in plans.items():
            made = None if plan.answer is None else plan.answer.trajectory
            if plan.state not in LIVING or made is None:
                continue
            progress = self._followed(other)
            at = progress.at if progress is not None and progress.plan == plan.name else 0.0
            first = max(int(np.searchsorted(made.times, at, side="right")) - 1, 0)
            found[other] = Announced(made.joints[first:], plan.live.T_site_root)
        return found

    def _keep(self, before: Plan, after: Plan) -> None:
        """Unless it was dropped, or another was asked for meanwhile."""
        with self._lock:
            if self._plans.get(before.asked.machine) is before:
                self._plans[before.asked.machine] = after

    def _of(self, machine: str, plan: str) -> Plan | str:
        with self._lock:
            found = self._plans.get(machine)
        if found is None or found.name != plan:
            newer = "" if found is None else f"; {found.name} is"
            return f"{plan or 'a plan without a name'} is not on offer{newer}"
        return found

    def _overlooked(self, plan: Plan) -> str:
        age = self._clock() - plan.looked
        return f"{plan.name}: not held against the scene for {age:.0f} s" if age > OLD else ""

    def _described(self, plan: Plan) -> dict[str, Any]:
        answer = plan.answer
        made = None if answer is None else answer.document
        late = self._overlooked(plan) if plan.state == "offered" else ""
        goal, T = plan.live.task.p_root, plan.live.T_site_root
        return {
            "plan": plan.name,
            "state": "unknown" if late else plan.state,
            "why": late or plan.why,
            "kind": (made.kind or "") if made else "",
            "blockers": made.blockers if made else [],
            "proven": bool(made and made.proven),
            "who": plan.who,
            "asked": plan.asked.model_dump(),
            "goal": (T[:3, :3] @ goal + T[:3, 3]).tolist(),
            "duration": made.duration if made else None,
            "clearance": plan.live.task.clearance,
            "keep": plan.live.keep,
            "checks": made.checks.model_dump() if made and made.checks else None,
            "notes": made.notes if made else [],
            "seconds": answer.seconds if answer else None,
            "age": self._clock() - plan.looked if math.isfinite(plan.looked) else None,
        }


def _of_each_pose(rows: list[Seen]) -> list[Seen]:
    """Without those that say again what the one before them said."""
    return [b for a, b in zip([None, *rows], rows, strict=False) if a is None or a[1] < b[1]]


def _at(goal: Array | None, trajectory: Trajectory | None) -> bool:
    """Whether it ends at the joint values that were asked for, if any."""
    if goal is None or trajectory is None:
        return True
    return bool(np.abs(wrap(trajectory.joints[-1] - goal)).max() < SAME)
