"""Manoeuvres as the 3D scene plays them: a ghost of the whole machine, its base included."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from backend.shell.surmount_desk import Way
from backend.spatial import transform
from cockpit.plan_scene import Newest, PlanScene
from cockpit.views.use_case_nodes import Played

TITLE = "OVER · preview"


class Ways(Protocol):
    """Where manoeuvres are, a desk."""

    def way(self, machine: str, plan: str) -> Way | None:
        """None where there is none of that name."""
        ...


class SurmountScene(Newest):
    """Looks manoeuvres up by their names."""

    def __init__(self, desk: Ways) -> None:
        def look(machine: str, plan: str) -> Played | None:
            way = desk.way(machine, plan)
            return None if way is None else as_played(way)

        super().__init__(look)


def as_played(way: Way) -> Played:
    """Names its phases beside the ghost as they pass."""
    document, roots = way
    times = np.array(document.time)
    tool = transform.apply(transform.inverse(roots[0]), np.array(document.end_point))
    count, nowhere = len(times), np.zeros((0, 3))
    starts = np.array([phase.start for phase in document.phases])
    index = np.clip(np.searchsorted(starts, times + 1e-9, side="right") - 1, 0, None)
    names = [phase.name for phase in document.phases]
    return Played(
        *(document.machine, roots[0], f"{times[-1]:.1f} s", times, np.array(document.joints)),
        *(np.full(count, np.inf), np.zeros(count, np.int64), (), np.zeros((count, 2, 3))),
        *(tool, nowhere, TITLE, roots, tuple(names[k] for k in index) if names else ()),
    )


def previewed(plans: PlanScene, surmounts: SurmountScene) -> Callable[[str, str], Played | None]:
    """A trajectory or a manoeuvre, whichever a machine's plan is the name of."""
    return lambda machine, plan: plans.played(machine, plan) or surmounts.played(machine, plan)
