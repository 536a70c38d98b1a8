"""The API of trajectories: asked for, on offer, taken off. Following one is the websocket's."""

from __future__ import annotations

from typing import Any, Protocol

from fastapi import APIRouter, Request, Response

from backend.documents.plan_document import PlanDocument
from backend.documents.plan_series import FollowedSeries
from backend.documents.plan_state import PlanRequest, PlanStateDocument
from backend.errors import InputError
from backend.shell.app.answers import refused, who
from backend.shell.app.wire import dumps


class Plans(Protocol):
    """What the API asks. All are called in worker threads; all but `document` and `drop` may raise
    InputError.
    """

    def document(self) -> dict[str, Any]: ...

    def start(self, asked: PlanRequest, who: str) -> str: ...

    def drop(self, machine: str, who: str) -> None: ...

    def followed(self, machine: str, plan: str) -> dict[str, Any]: ...

    def text(self, machine: str, plan: str) -> str: ...


def plan_router(plans: Plans) -> APIRouter:
    """Routes below /api/plan. Whoever may drive may ask for one; see access.rules."""
    router = APIRouter(prefix="/api/plan", tags=["trajectories"])
    answers: dict[int | str, dict[str, Any]] = {200: {"model": PlanStateDocument}}

    def now() -> Response:
        return Response(dumps({"plans": plans.document()}), media_type="application/json")

    @router.get("", responses=answers)
    def state() -> Response:
        """Every machine's newest plan; also the key `plans` of the snapshot."""
        return now()

    @router.post("", responses=answers)
    def start(asked: PlanRequest, request: Request) -> Response:
        """Plan from where the machine is now. No machine moves by it; the plan of before is off."""
        try:
            plans.start(asked, who(request))
        except InputError as error:
            return refused(error, 409)
        return now()

    @router.delete("/{machine}", responses=answers)
    def drop(machine: str, request: Request) -> Response:
        """Take the machine's plan off; who follows it stops."""
        plans.drop(machine, who(request))
        return now()

    @router.get("/{machine}/{plan}", responses={200: {"model": PlanDocument}})
    def made(machine: str, plan: str) -> Response:
        """All of a plan: joints, rates, accelerations, end points (site frame) over time."""
        try:
            return Response(plans.text(machine, plan), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    @router.get("/{machine}/{plan}/followed", responses={200: {"model": FollowedSeries}})
    def followed(machine: str, plan: str) -> Response:
        """What the sensors saw while it was followed; empty before."""
        try:
            return Response(dumps(plans.followed(machine, plan)), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    return router
