"""What a reader leaves out, doubts or assumes, collected while it reads."""

from __future__ import annotations

import math

from backend.gauge.records import Conflict, Skipped
from backend.spatial.angles import difference

MAX_ENTRIES = 500  # of each list; beyond, only their number
LENGTH = 1e-3  # lengths that differ by less agree [m]
ANGLE = 1e-4  # directions that differ by less agree [rad]


def _near(a: float, b: float, tolerance: float) -> bool:
    return abs(float(difference(a, b))) <= tolerance


class Log:
    """Mutable, used by one reader and thrown away."""

    def __init__(self) -> None:
        self._skipped: list[Skipped] = []
        self._conflicts: list[Conflict] = []
        self._notes: list[str] = []
        self._more = [0, 0]
        self._directions: list[tuple[str, str, float, float, float]] = []

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

    def direction(self, where: str, key: str, stated: float, used: float, tolerance: float) -> None:
        """A stated direction beside the bearing of the geometry, clockwise from north [rad]."""
        self._directions.append((where, key, stated, used, tolerance))

    def settle_directions(self) -> None:
        """Compares all directions at once: programs disagree whether they count clockwise, as
        LandXML's do, or counter-clockwise, as Inframodel's text says. Directions only check the
        coordinates, so a file that does the second throughout is noted and no more."""
        clockwise = [d for d in self._directions if _near(d[2], d[3], d[4])]
        counter = [d for d in self._directions if _near(-d[2], d[3], d[4])]
        if len(counter) > len(clockwise):
            self.note("the file's directions count counter-clockwise from north")
        agreeing = counter if len(counter) > len(clockwise) else clockwise
        seen = {id(d) for d in agreeing}
        for d in self._directions:
            if id(d) not in seen:
                stated, used = (math.degrees(v) % 360.0 for v in d[2:4])
                self.conflict(d[0], f"{d[1]}, from north clockwise", stated, used, "degrees")
        self._directions = []

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
