"""Manoeuvres over steps that operators ask for: looked for beside the running machines, and watched
while on offer. Nothing here moves a machine; following one is `driving`'s.
"""

from __future__ import annotations

import contextlib
import logging
import math
import multiprocessing
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from backend.control.follow import NEAR, Trajectory, left_at
from backend.documents.plan_live import unknown
from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_live import LiveSurmount, around, live_surmount
from backend.documents.surmount_side import aside, way_across
from backend.documents.surmount_state import SurmountChoice, SurmountRequest
from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.shell.aside import Aside, WorkerGone
from backend.shell.plan_desk import LIVING, LONGEST, OLD, SHOWN, WATCHED, Progress
from backend.shell.standing import elsewhere, off_by
from backend.shell.surmount_worker import (
    Answer,
    Line,
    Look,
    Search,
    Solve,
    begin_search,
    begin_watch,
)
from backend.spatial.types import Array

log = logging.getLogger(__name__)

NICENESS = 5
"""Images go before it when processors are short."""
DRIVEN = 0.08
"""A base that moved farther than this since [m] begins the manoeuvre somewhere else."""

Seen = tuple[float, float, Array, Array]


class Way(NamedTuple):
    """A manoeuvre as it is drawn; base: T_site_root (m, 4, 4)."""

    document: SurmountDocument
    base: Array


@dataclass(frozen=True, eq=False)
class Surmount:
    """A machine's newest. looked: when it was held against the scene last, by this clock [s];
    seen: of every cycle in which it was followed, the path's time, the pose's, joints and base.
    """

    name: str
    who: str
    asked: SurmountRequest
    live: LiveSurmount
    search: Search
    state: str = "planning"
    why: str = ""
    answer: Answer | None = None
    candidate: int | None = None
    looked: float = -math.inf
    text: str = ""
    seen: deque[Seen] = field(default_factory=lambda: deque(maxlen=LONGEST))


class SurmountDesk:
    """All methods may be called from any thread.

    latest: the newest snapshot; followed: what is followed with a machine, None for nothing; told:
    of every request, what was done, by whom, with what details; solve: what looks for them, a
    function of a module or a `partial` of one.
    """

    def __init__(
        self,
        config: Config,
        latest: Callable[[], Snapshot | None],
        followed: Callable[[str], Progress | None],
        told: Callable[[str, str, dict[str, Any]], None],
        solve: Solve,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._config, self._latest, self._followed = config, latest, followed
        self._told, self._clock = told, clock
        machines = {name: config.machines[name] for name in config.own}
        self._line = Line(multiprocessing.get_context("spawn"))
        begin = partial(begin_search, machines, self._line, solve)
        self._searching: Aside[Search, Answer] = Aside(begin, "looks for manoeuvres", NICENESS)
        self._watching: Aside[Look | None, str] = Aside(
            partial(begin_watch, machines), "watches manoeuvres"
        )
        self._lock, self._look_lock = threading.Lock(), threading.Lock()
        self._plans: dict[str, Surmount] = {}
        self._working = ""
        self._count = 0
        self._closing, self._wake = False, threading.Event()
        self._threads: list[threading.Thread] = []

    def start(self, asked: SurmountRequest, who: str) -> str:
        """Begin to look for one; its name. The machine's manoeuvre of before is on offer no more.

        Raises InputError for what cannot be, and while the machine follows anything.
        """
        snapshot = self._latest()
        if snapshot is None:
            raise InputError("no cycle has finished yet; try again.")
        live = live_surmount(asked, snapshot, self._config)
        self._refuse_while_followed(asked.machine)
        with self._lock:
            self._count += 1
            name = f"{asked.machine}-over-{self._count}"
        self._put(Surmount(name, who, asked, live, Search(live)))
        self._told("surmount", who, {"plan": name, **asked.model_dump(exclude_defaults=True)})
        return name

    def choose(self, machine: str, plan: str, choice: SurmountChoice, who: str) -> str:
        """Another candidate of a manoeuvre's document, made as a whole; its name.

        Raises InputError for one that there is not, and while the machine follows anything.
        """
        found = self._of(machine, plan)
        if isinstance(found, str):
            raise InputError(f"{found}.")
        candidates = [] if found.answer is None else found.answer.document.candidates
        k = choice.candidate
        if k >= len(candidates):
            raise InputError(f"candidate is {k}; {plan} has {len(candidates)}, counted from 0.")
        self._refuse_while_followed(machine)
        name = f"{plan.split('.')[0]}.{k}"
        search = Search(found.live, candidates[k].parameters)
        chosen = replace(
            found,
            name=name,
            who=who,
            search=search,
            state="planning",
            why="",
            candidate=k,
            seen=deque(maxlen=LONGEST),
        )
        self._put(chosen)
        self._told("surmount choice", who, {"plan": name})
        return name

    def drop(self, machine: str, who: str) -> None:
        """Take a machine's manoeuvre off, also while it is looked for; who follows it stops."""
        with self._lock:
            gone = self._plans.pop(machine, None)
            if gone is not None and gone.name == self._working:
                self._line.stop()
        if gone is not None:
            self._told("surmount drop", who, {"plan": gone.name})

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        """What can be followed, or why that manoeuvre cannot."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            return found
        if found.state == "offered" and found.answer is not None:
            why = self._overlooked(found)
            return why or (found.answer.trajectory or f"{plan} has no trajectory")
        return f"{plan}: {found.why or found.state}"

    def over(self, machine: str, plan: str) -> str:
        """Why a manoeuvre that is followed must not be any more; empty while it may."""
        found = self._of(machine, plan)
        if isinstance(found, str):
            return "the plan was dropped"
        return found.why if found.state in ("void", "none") else ""

    def has(self, machine: str, plan: str) -> bool:
        """Whether a name is, or was, one of these."""
        return plan.startswith(f"{machine}-over-")

    def document(self) -> dict[str, Any]:
        """By machine what backend.documents.surmount_state.SurmountOffer describes."""
        with self._lock:
            plans = dict(self._plans)
        return {machine: self._described(plan) for machine, plan in plans.items()}

    def text(self, machine: str, plan: str) -> str:
        """JSON of backend.documents.surmount_document.SurmountDocument. Raises InputError before
        it is.
        """
        return self._made(machine, plan).text

    def side(self, machine: str, plan: str) -> dict[str, Any]:
        """What backend.documents.surmount_state.SideView describes. Raises InputError before it
        is.
        """
        answer = self._made(machine, plan).answer
        if answer is None or answer.side is None:
            raise InputError(f"{plan} has no trajectory.")
        return answer.side

    def way(self, machine: str, plan: str) -> Way | None:
        """The manoeuvre, None where there is none of that name."""
        found = self._of(machine, plan)
        if isinstance(found, str) or found.state == "planning" or found.answer is None:
            return None
        if found.answer.base is None:
            return None
        return Way(found.answer.document, found.answer.base)

    def keep(self, snapshot: Snapshot) -> None:
        """What the sensors saw of machines that follow; called in every cycle of the fast loop."""
        for machine in self._config.own:
            plan = self._plans.get(machine)
            if plan is None or plan.answer is None:
                continue
            progress = self._followed(machine)
            if progress is None or progress.plan != plan.name or progress.ended:
                continue
            state = snapshot.machines[machine]
            if state.body is not None and np.isfinite(state.pose.joints).all():
                pose = state.pose
                plan.seen.append((progress.at, pose.time, pose.joints, state.body.link_poses[0]))

    def followed(self, machine: str, plan: str) -> dict[str, Any]:
        """What backend.documents.surmount_state.FollowedSurmount describes. Raises InputError."""
        found = self._made(machine, plan)
        assert found.answer is not None
        rows = list(found.seen)
        rows = [b for a, b in zip([None, *rows], rows, strict=False) if a is None or a[1] < b[1]]
        step = max(1, math.ceil(len(rows) / SHOWN))
        rows = rows[::-step][::-1]
        if not rows or found.answer.base is None:
            return {"at": [], "time": [], "joints": [], "base": []}
        base = np.stack([row[3] for row in rows])
        axes, origin = way_across(found.answer.base), found.answer.base[0, :3, 3]
        return {
            "at": [round(row[0], 3) for row in rows],
            "time": [round(row[1] - rows[0][1], 3) for row in rows],
            "joints": np.round([row[2] for row in rows], 5).tolist(),
            "base": np.round(aside(base, axes, origin), 4).tolist(),
        }

    def close(self) -> None:
        """Give up whatever is looked for, and end the processes."""
        with self._lock:
            self._closing, threads = True, self._threads
            self._line.stop()
        self._wake.set()
        for thread in threads:
            thread.join(timeout=5.0)
        self._searching.close()
        self._watching.close()

    def look(self) -> None:
        """Hold every manoeuvre on offer against the newest snapshot."""
        snapshot = self._latest()
        with self._lock:
            plans = [plan for plan in self._plans.values() if plan.state in LIVING]
        for plan in plans:
            state, why = self._held(plan, snapshot)
            self._keep(plan, replace(plan, state=state, why=why, looked=self._clock()))

    def _put(self, plan: Surmount) -> None:
        with self._lock:
            before = self._plans.get(plan.asked.machine)
            if before is not None and before.name == self._working:
                self._line.stop()
            self._plans[plan.asked.machine] = plan
            if not self._threads and not self._closing:
                for work, name in ((self._search, "manoeuvres"), (self._watch, "watch")):
                    thread = threading.Thread(target=work, name=name, daemon=True)
                    self._threads.append(thread)
                    thread.start()
        self._wake.set()

    def _refuse_while_followed(self, machine: str) -> None:
        progress = self._followed(machine)
        if progress is not None and not progress.ended:
            raise InputError(f"{progress.plan} is being followed; drop it first.")

    def _search(self) -> None:
        while not self._closing:
            with self._lock:
                waiting = [plan for plan in self._plans.values() if plan.state == "planning"]
                if waiting:
                    self._working = waiting[0].name
                    self._line.clear()
            if waiting:
                self._find(waiting[0])
                with self._lock:
                    self._working = ""
                continue
            self._wake.wait(WATCHED)
            self._wake.clear()

    def _watch(self) -> None:
        # While the first one is looked for: a process that begins would hold up the first look.
        with contextlib.suppress(RuntimeError, WorkerGone), self._look_lock:
            self._watching.ask(None)
        while not self._closing:
            self.look()
            time.sleep(WATCHED)

    def _find(self, plan: Surmount) -> None:
        try:
            answer: Answer = self._searching.ask(plan.search)
        except (RuntimeError, WorkerGone) as error:
            # What makes no sense is told in words; anything else is logged, too.
            why = str(error).removeprefix("InputError: ")
            if why == str(error) and not self._line.stopped:
                log.error("%s: %s", plan.name, error)
            self._keep(plan, replace(plan, state="none", why=why))
            return
        document = answer.document
        state, why = ("offered", "") if document.ok else ("none", document.why or "")
        if document.ok and answer.hit:
            state, why = "none", f"{answer.hit}, {plan.live.keep:.2f} m are kept"
        if plan.candidate is None or plan.answer is None:
            chosen = [k for k, one in enumerate(document.candidates) if one.chosen]
            candidate = next(iter(chosen), None)
        else:
            candidate = plan.candidate
            document = _one_of(plan.answer.document, candidate, document)
            answer = answer._replace(document=document)
        done = replace(
            plan,
            state=state,
            why=why,
            answer=answer,
            candidate=candidate,
            text=document.model_dump_json(),
            looked=self._clock(),
        )
        self._keep(plan, done)
        self._told("surmount made", plan.who, {"plan": plan.name, "ok": not why, "why": why})

    def _held(self, plan: Surmount, snapshot: Snapshot | None) -> tuple[str, str]:
        """Whether a manoeuvre on offer still holds, and why not."""
        machine, live, answer = plan.asked.machine, plan.live, plan.answer
        assert answer is not None
        assert answer.trajectory is not None
        assert answer.base is not None
        if snapshot is None:
            return "unknown", "no cycle has finished yet"
        why = unknown(machine, snapshot, self._config)
        if why:
            return "unknown", why
        progress, at = self._followed(machine), 0.0
        body, q = snapshot.machines[machine].body, snapshot.machines[machine].pose.joints
        assert body is not None
        if progress is not None and progress.plan == plan.name:
            if progress.arrived:
                return "done", ""
            at = progress.at
            if progress.ended and at > 0.0:
                # It can be taken up where it was left, as long as the machine is still there.
                ends = np.array([j.continuous for j in self._config.machines[machine].joints])
                path = answer.trajectory
                if not left_at(path, at, q, body.link_poses[0], ends):
                    return "void", progress.ended
            elif progress.ended:
                return "void", progress.ended
        if at <= 0.0:
            why = elsewhere(live.T_site_root, body.link_poses[0], DRIVEN)
            if why:
                return "void", why
            off = off_by(self._config.machines[machine], q, answer.trajectory.joints[0])
            if off > NEAR:
                moved = f"the machine moved, {math.degrees(off):.0f} degrees from where it begins"
                return "void", moved
        try:
            now = around(machine, live.step, snapshot, self._config)
        except InputError as error:
            return "unknown", str(error)
        left = answer.trajectory.times >= at - 1e-9
        look = Look(machine, answer.trajectory.joints[left], answer.base[left], *now, answer.before)
        try:
            with self._look_lock:
                found: str = self._watching.ask(look)
        except (RuntimeError, WorkerGone) as error:
            log.error("%s: %s", plan.name, error)
            return "unknown", f"it cannot be held against the scene: {error}"
        return ("void", found) if found else ("offered", "")

    def _keep(self, before: Surmount, after: Surmount) -> None:
        """Unless it was dropped, or another was asked for meanwhile."""
        with self._lock:
            if self._plans.get(before.asked.machine) is before:
                self._plans[before.asked.machine] = after

    def _of(self, machine: str, plan: str) -> Surmount | str:
        with self._lock:
            found = self._plans.get(machine)
        if found is None or found.name != plan:
            newer = "" if found is None else f"; {found.name} is"
            return f"{plan or 'a plan without a name'} is not on offer{newer}"
        return found

    def _made(self, machine: str, plan: str) -> Surmount:
        found = self._of(machine, plan)
        if isinstance(found, str):
            raise InputError(f"{found}.")
        if found.answer is None or found.state == "planning":
            raise InputError(f"{plan}: {found.why or 'is still being looked for'}.")
        return found

    def _overlooked(self, plan: Surmount) -> str:
        age = self._clock() - plan.looked
        return f"{plan.name}: not held against the scene for {age:.0f} s" if age > OLD else ""

    def _described(self, plan: Surmount) -> dict[str, Any]:
        answer = None if plan.state == "planning" else plan.answer
        made = None if answer is None else answer.document
        late = self._overlooked(plan) if plan.state == "offered" else ""
        step = plan.live.step
        working = plan.state == "planning" and plan.name == self._working
        return {
            "plan": plan.name,
            "state": "unknown" if late else plan.state,
            "why": late or plan.why,
            "kind": (made.kind or "") if made else "",
            "who": plan.who,
            "asked": plan.asked.model_dump(),
            "obstacle": {
                "name": step.name,
                "height": step.height,
                "distance": step.distance,
                "angle": step.angle,
                "depth": step.depth if math.isfinite(step.depth) else None,
            },
            "candidate": plan.candidate,
            "parameters": made.parameters.model_dump() if made and made.parameters else None,
            "progress": self._line.told() if working else None,
            "duration": made.duration if made else None,
            "energy": made.energy if made else None,
            "checks": made.checks.model_dump() if made and made.checks else None,
            "notes": made.notes if made else [],
            "keep": plan.live.keep,
            "seconds": answer.seconds if answer else None,
            "age": self._clock() - plan.looked if math.isfinite(plan.looked) else None,
            "made": answer is not None,
        }


def _one_of(whole: SurmountDocument, k: int, made: SurmountDocument) -> SurmountDocument:
    """What was made of candidate k, with all candidates beside it."""
    candidates = [
        one.model_copy(update={"chosen": i == k}) for i, one in enumerate(whole.candidates)
    ]
    if made.ok and not candidates[k].simulated:
        known = {"energy": made.energy, "simulated": True}
        candidates[k] = candidates[k].model_copy(update=known)
    return made.model_copy(update={"candidates": candidates})
