"""Runs of use cases as the 3D scene plays them."""

from __future__ import annotations

from backend.documents.use_case import WORDS
from backend.planning.use_cases import UseCaseRun
from backend.shell.use_case_desk import UseCaseDesk
from cockpit.views.use_case_nodes import Played


class UseCaseScene:
    """Looks runs up by their names, and keeps what was made of them. Used from any thread."""

    def __init__(self, desk: UseCaseDesk) -> None:
        self._desk = desk
        self._made: dict[tuple[str, str], Played] = {}

    def played(self, name: str, method: str) -> Played | None:
        """None before the run has been worked out."""
        run = self._desk.run(name, method)
        if run is None:
            return None
        if (name, method) not in self._made:
            self._made[name, method] = _as_played(run, self._desk)
        return self._made[name, method]


def _as_played(run: UseCaseRun, desk: UseCaseDesk) -> Played:
    offer, near = desk.offer(run.case.name), run.nearest
    return Played(
        *(offer.machine, offer.T_site_root, WORDS[run.method], run.run.times, run.run.q),
        *(near.distance, near.pair, near.words, near.points),
        *(run.tool[:, :3, 3], run.designed[:, :3, 3]),
    )
