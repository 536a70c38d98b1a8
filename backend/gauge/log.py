"""What a reader leaves out, doubts or assumes, collected while it reads."""

from __future__ import annotations

import math

from backend.gauge.records import Conflict, Skipped

MAX_ENTRIES = 500  # of each list; beyond, only their number
LENGTH = 1e-3  # lengths that differ by less agree [m]
ANGLE = 1e-4  # directions that differ by less agree [rad]


class Log:
    """Mutable, used by one reader and thrown away."""

    def __init__(self) -> None:
        self._skipped: list[Skipped] = []
        self._conflicts: list[Conflict] = []
        self._notes: list[str] = []
        self._more = [0, 0]

    def skip(self, where: str, why: str) -> None:
        if len(self._skipped) < MAX_ENTRIES:
            self._skipped.append(Skipped(where, why))
        else:
            self._more[0] += 1

    def conflict(
        self, where: str, what: str, stated: float | str, used: float | str, unit: str = ""
    ) -> None:
        if len(self._conflicts) < MAX_ENTRIES:
            self._conflicts.append(Conflict(where, what, stated, used, unit))
        else:
            self._more[1] += 1

    def check(self, where: str, what: str, stated: float, used: float) -> None:
        """Compares two lengths [m]; one that is not stated (NaN, inf) agrees with everything."""
        if math.isfinite(stated) and not abs(stated - used) <= LENGTH:
            self.conflict(where, what, stated, used, "m")

    def note(self, text: str) -> None:
        if text not in self._notes:
            self._notes.append(text)

    @property
    def skipped(self) -> tuple[Skipped, ...]:
        more = [Skipped("elsewhere", f"{self._more[0]} more")] if self._more[0] else []
        return (*self._skipped, *more)

    @property
    def conflicts(self) -> tuple[Conflict, ...]:
        more = [Conflict("elsewhere", "more conflicts", str(self._more[1]), "")]
        return (*self._conflicts, *(more if self._more[1] else []))

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(self._notes)
