"""What looks for manoeuvres, and what holds them against the scene, in processes of their own."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from backend.control.follow import Trajectory
from backend.documents.surmount_document import SurmountDocument, SurmountParameters
from backend.documents.surmount_live import LiveSurmount, blocked, nearest_now
from backend.documents.surmount_side import base_poses, side_view
from backend.machine.model import Machine
from backend.shell.surmount_follow import trajectory_of
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

Told = Callable[[int, int, str], bool]
"""How many were done, of how many, and of what; False when nobody wants the rest."""
Solve = Callable[
    [LiveSurmount, SurmountParameters | None, Mapping[str, Machine], Told], SurmountDocument
]
WORDS = 120
"""Letters of what is being done."""


class Search(NamedTuple):
    """parameters: of the one candidate that is wanted; None for the one with the least energy."""

    live: LiveSurmount
    parameters: SurmountParameters | None = None


class Look(NamedTuple):
    """Whether what is left of a manoeuvre is still free; see `blocked`."""

    machine: str
    q: Array
    T_site_root: Array
    boxes: Boxes
    names: tuple[str, ...]
    keep: float
    before: Mapping[str, float]


class Answer(NamedTuple):
    """base: T_site_root (m, 4, 4); before: what was near at the beginning, by name [m]; side: see
    backend.documents.surmount_state.SideView; hit: what is in its way, in words.
    """

    document: SurmountDocument
    trajectory: Trajectory | None
    base: Array | None
    before: Mapping[str, float]
    side: dict[str, Any] | None
    hit: str
    seconds: float


class Line:
    """What the searching process tells, and whether it shall give up; shared by both."""

    def __init__(self, context: Any) -> None:
        self._counts = context.RawArray("i", 3)  # done, of, stop
        self._words = context.RawArray("c", WORDS)

    def clear(self) -> None:
        """Before something is looked for."""
        self._counts[:] = (0, 0, 0)
        self._words.value = b""

    def stop(self) -> None:
        """Whatever is looked for is not wanted any more."""
        self._counts[2] = 1

    @property
    def stopped(self) -> bool:
        return bool(self._counts[2])

    def tell(self, done: int, of: int, words: str) -> bool:
        """Whether to go on."""
        self._counts[0], self._counts[1] = done, of
        self._words.value = words.encode(errors="replace")[: WORDS - 1]
        return not self.stopped

    def told(self) -> dict[str, Any]:
        """What backend.documents.surmount_state.SurmountProgress describes."""
        words = self._words.value.decode(errors="ignore")
        return {"done": int(self._counts[0]), "of": int(self._counts[1]), "words": words}


def begin_search(
    machines: Mapping[str, Machine], line: Line, solve: Solve
) -> Callable[[Search], Answer]:
    """In the process that searches: what answers."""
    return partial(_searched, machines, line, solve)


def begin_watch(machines: Mapping[str, Machine]) -> Callable[[Look | None], str]:
    """In the process that watches: what is in the way, in words; empty if nothing. None asks for
    nothing but that it is there.
    """
    return lambda look: "" if look is None else in_the_way(machines[look.machine], look)


def in_the_way(machine: Machine, look: Look) -> str:
    """In words; empty if nothing."""
    found = blocked(
        machine, look.q, look.T_site_root, look.boxes, look.names, look.keep, look.before
    )
    return "" if found is None else f"{found[1]} is in its way: {max(found[2], 0.0):.2f} m"


def _searched(
    machines: Mapping[str, Machine], line: Line, solve: Solve, question: Search
) -> Answer:
    live, began = question.live, time.monotonic()
    machine = machines[live.machine]
    document = solve(live, question.parameters, machines, line.tell)
    if not document.ok:
        return Answer(document, None, None, {}, None, "", time.monotonic() - began)
    base = base_poses(np.array(document.base))
    q = np.array(document.joints)
    near = nearest_now(machine, live.q, live.T_site_root, live.boxes, live.names, live.keep)
    look = Look(live.machine, q, base, live.boxes, live.names, live.keep, near)
    made = trajectory_of(machine, live, document)
    side, hit = side_view(machine, document), in_the_way(machine, look)
    return Answer(document, made, base, near, side, hit, time.monotonic() - began)
