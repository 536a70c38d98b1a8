"""A live manoeuvre, looked for."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from backend.documents.surmount import SQUARE, Asked, document_of
from backend.documents.surmount_document import (
    SurmountDocument,
    SurmountObstacle,
    SurmountParameters,
)
from backend.documents.surmount_live import LiveSurmount
from backend.machine.model import Machine
from backend.surmount.course import Edge
from backend.surmount.halves import one_by_one
from backend.surmount.plan import Effort, demands_of
from backend.surmount.records import Parameters


def solve(
    live: LiveSurmount,
    parameters: SurmountParameters | None,
    machines: Mapping[str, Machine],
    told: Callable[[int, int, str], bool],
) -> SurmountDocument:
    """The manoeuvre with the least energy, or that of given parameters; or why there is none."""
    machine, step = machines[live.machine], live.step
    if abs(step.angle) > SQUARE:
        side = "right" if step.angle > 0.0 else "left"
        degrees = math.degrees(abs(step.angle))
        why = f"it does not face the edge: turn {degrees:.0f} degrees to the {side} first"
        return SurmountDocument(
            ok=False,
            machine=live.machine,
            kind="room",
            why=why,
            obstacle=SurmountObstacle(
                name=step.name,
                height=step.height,
                distance=step.distance,
                angle=step.angle,
                depth=step.depth if math.isfinite(step.depth) else None,
            ),
        )
    given, effort = None, live.asked.effort
    chosen: Effort = effort
    if parameters is not None:
        p = parameters
        given, chosen = Parameters(p.p1, p.p2, p.p3, p.p4, p.alpha_f), "given"
    asked = Asked(
        name=live.machine,
        machine=machine,
        demands=demands_of(machine, live.asked.payload),
        T_frame_root=live.T_site_root,
        q=np.clip(live.q, machine.lower, machine.upper),
        edges=(Edge(0.0, step.height),),
        # Along the machine's own heading: it goes as it stands.
        distance=step.distance / math.cos(step.angle),
        angle=0.0,
        depth=step.depth,
        obstacle=step.name,
        effort=chosen,
        given=given,
        spline=chosen == "thorough",
    )
    return document_of(asked, one_by_one, told)
