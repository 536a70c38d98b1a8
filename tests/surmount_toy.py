"""One manoeuvre, worked out once a process, with made-up candidates: for what shows, offers and
watches manoeuvres, and would wait too long for a search every time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from backend.documents import surmount_solve
from backend.documents.surmount_document import SurmountDocument, SurmountParameters
from backend.documents.surmount_live import LiveSurmount, Step
from backend.documents.surmount_state import SurmountRequest
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.spatial.boxes import NO_BOXES
from backend.spatial.types import Array

ENERGIES = (6400.0, 5950.0, 6100.0, 6600.0)
CHOSEN = 1
IMPOSSIBLE = 1.0
"""Steps from this height on are refused [m]."""


def solve(
    live: LiveSurmount,
    wanted: SurmountParameters | None,
    machines: Mapping[str, Machine],
    told: Callable[[int, int, str], bool],
) -> SurmountDocument:
    """Six steps of a thirtieth of a second, or as long as it takes somebody to stop it where the
    search shall be thorough; whatever is wanted, it is the same manoeuvre.
    """
    step = live.step
    patience = 600 if live.asked.effort == "thorough" else 6
    for k in range(patience):
        if not told(k, patience, "simulated"):
            raise InputError("stopped.")
        time.sleep(1.0 / 30.0)
    if step.height >= IMPOSSIBLE:
        why = f"a step of {step.height:.2f} m is out of the arm's reach"
        return SurmountDocument(ok=False, why=why, kind="reach", machine=live.machine)
    made = document(
        *(live.machine, machines[live.machine].name, live.T_site_root, live.q),
        *(step.height, step.distance),
    )
    if wanted is None:
        return made
    return made.model_copy(update={"parameters": wanted, "candidates": [], "energy": 4444.0})


def document(
    name: str, model: str, T_site_root: Array, q: Array, height: float, distance: float
) -> SurmountDocument:
    """Over a step straight ahead."""
    made = _found(name, model, T_site_root.tobytes(), q.tobytes(), height, distance)
    candidates = [candidate(k) for k in range(len(ENERGIES))]
    return SurmountDocument.model_validate(
        {**made.model_dump(), "energy": ENERGIES[CHOSEN], "candidates": candidates}
    )


@lru_cache(maxsize=4)
def _found(
    name: str, model: str, T: bytes, joints: bytes, height: float, distance: float
) -> SurmountDocument:
    machine = load_machine(model)
    asked = SurmountRequest.model_validate({"machine": name, "obstacle": "step"})
    live = LiveSurmount(
        *(name, 0.0, asked, Step("step", height, distance, 0.0, 8.0)),
        *(np.frombuffer(T).reshape(4, 4), np.frombuffer(joints), NO_BOXES, (), 0.2),
    )
    made = surmount_solve.solve(live, None, {name: machine}, lambda *_: True)
    assert made.ok, made.why
    return made


def parameters(k: int) -> SurmountParameters:
    return SurmountParameters(p1=1.4 + 0.03 * k, p2=1.6, p3=2.9, p4=0.2, alpha_f=0.25 - 0.01 * k)


def candidate(k: int) -> dict[str, Any]:
    return {
        "parameters": parameters(k).model_dump(), "energy": ENERGIES[k], "duration": 31.0 + k,
        "min_stability_margin": 0.31 - 0.02 * k, "worst_torque": 0.24 + 0.05 * k,
        "simulated": k < 2, "chosen": k == CHOSEN,
    }  # fmt: skip
