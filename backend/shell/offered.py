"""What may be followed: trajectories and manoeuvres, by their names."""

from __future__ import annotations

from backend.control.follow import Trajectory
from backend.shell.plan_desk import PlanDesk
from backend.shell.surmount_desk import SurmountDesk


class Offered:
    """A backend.shell.driving.follows.Plans of both."""

    def __init__(self, plans: PlanDesk, surmounts: SurmountDesk) -> None:
        self._plans, self._surmounts = plans, surmounts

    def offered(self, machine: str, plan: str) -> Trajectory | str:
        """What can be followed from its beginning, or why it cannot."""
        return self._of(machine, plan).offered(machine, plan)

    def over(self, machine: str, plan: str) -> str:
        """Why what is followed must not be any more; empty while it may."""
        return self._of(machine, plan).over(machine, plan)

    def _of(self, machine: str, plan: str) -> PlanDesk | SurmountDesk:
        return self._surmounts if self._surmounts.has(machine, plan) else self._plans
