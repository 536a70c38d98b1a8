"""A live manoeuvre, looked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from backend.documents.surmount_document import SurmountDocument, SurmountParameters
from backend.documents.surmount_live import LiveSurmount
from backend.errors import InputError
from backend.machine.model import Machine


def solve(
    live: LiveSurmount,
    parameters: SurmountParameters | None,
    machines: Mapping[str, Machine],
    told: Callable[[int, int, str], bool],
) -> SurmountDocument:
    """The manoeuvre with the least energy, or that of given parameters; or why there is none."""
    raise InputError("nothing here looks for manoeuvres yet.")
