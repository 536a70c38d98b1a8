"""Plans as the 3D scene plays them: a ghost along the trajectory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backend.documents.plan_document import PlanDocument
from backend.shell.plan_desk import PlanDesk
from backend.spatial import transform
from backend.spatial.types import Array
from cockpit.views.use_case_nodes import Played

TITLE = "PLAN · preview"


class Newest:
    """Keeps what was made of each machine's newest. Used from any thread.

    look: what is played of a machine's plan, None where there is none of that name.
    """

    def __init__(self, look: Callable[[str, str], Played | None]) -> None:
        self._look = look
        self._made: dict[str, tuple[str, Played]] = {}

    def played(self, machine: str, plan: str) -> Played | None:
        """None where there is none of that name."""
        kept = self._made.get(machine)
        if kept is not None and kept[0] == plan:
            return kept[1]
        found = self._look(machine, plan)
        if found is not None:
            self._made[machine] = plan, found
        return found


class PlanScene(Newest):
    """Looks plans up by their names."""

    def __init__(self, desk: PlanDesk) -> None:
        def look(machine: str, plan: str) -> Played | None:
            way = desk.way(machine, plan)
            return None if way is None else as_played(*way)

        super().__init__(look)


def as_played(document: PlanDocument, T_site_root: Array) -> Played:
    """T_site_root: (4, 4) where the machine stood; the document's end points are in that frame."""
    times = np.array(document.time)
    tool = transform.apply(transform.inverse(T_site_root), np.array(document.end_point))
    count, nowhere = len(times), np.zeros((0, 3))
    return Played(
        *(document.machine, T_site_root, f"{times[-1]:.1f} s", times, np.array(document.joints)),
        *(np.full(count, np.inf), np.zeros(count, np.int64), (), np.zeros((count, 2, 3))),
        *(tool, nowhere, TITLE),
    )
