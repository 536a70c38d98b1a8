"""A live manoeuvre, looked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from backend.documents.surmount import Asked, document_of, edges_of
from backend.documents.surmount_document import SurmountDocument, SurmountParameters
from backend.documents.surmount_live import LiveSurmount
from backend.machine.model import Machine
from backend.surmount.halves import one_by_one
from backend.surmount.plan import demands_of
from backend.surmount.records import Parameters


def solve(
    live: LiveSurmount,
    parameters: SurmountParameters | None,
    machines: Mapping[str, Machine],
    told: Callable[[int, int, str], bool],
) -> SurmountDocument:
    """The manoeuvre with the least energy, or that of given parameters; or why there is none.

    Simulates one after the other: what else runs beside it has the other processors.
    """
    machine, step, asked = machines[live.machine], live.step, live.asked
    given = None
    if parameters is not None:
        p = parameters
        given = Parameters(p.p1, p.p2, p.p3, p.p4, p.alpha_f)
    task = Asked(
        name=live.machine,
        machine=machine,
        demands=demands_of(machine, asked.payload),
        T_frame_root=live.T_site_root,
        q=live.q,
        edges=edges_of(step, over=False),
        distance=step.distance,
        angle=step.angle,
        depth=step.depth,
        obstacle=step.name,
        effort=asked.effort if given is None else "given",
        given=given,
    )
    return document_of(task, one_by_one, told)
