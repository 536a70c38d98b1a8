"""The API of the working gauge's use cases: what is offered, started, stopped, and its runs."""

from __future__ import annotations

from typing import Any, Protocol

from fastapi import APIRouter, Request, Response

from backend.documents.use_case import UseCaseDocument
from backend.documents.use_case_state import UseCaseRequest, UseCaseStateDocument
from backend.errors import InputError
from backend.shell.app.answers import refused, who
from backend.shell.app.wire import dumps


class UseCases(Protocol):
    """What the API asks. All are called in worker threads and raise InputError."""

    def document(self) -> dict[str, Any]: ...

    def start(self, name: str, method: str, who: str) -> None: ...

    def stop(self, who: str) -> None: ...

    def text(self, name: str, method: str) -> str: ...


def use_case_router(use_cases: UseCases) -> APIRouter:
    """Routes below /api/use-case. Whoever may drive may start one; see access.rules."""
    router = APIRouter(prefix="/api/use-case", tags=["working gauge"])
    answers: dict[int | str, dict[str, Any]] = {200: {"model": UseCaseStateDocument}}

    def now() -> Response:
        return Response(dumps(use_cases.document()), media_type="application/json")

    @router.get("", responses=answers)
    def state() -> Response:
        """Which use cases this site is the scene of, and how far they are."""
        return now()

    @router.post("", responses=answers)
    def start(asked: UseCaseRequest, request: Request) -> Response:
        """Work out one run, in simulated time; no machine moves by it. One at a time."""
        try:
            use_cases.start(asked.name, asked.method, who(request))
        except InputError as error:
            return refused(error, 409)
        return now()

    @router.delete("", responses=answers)
    def stop(request: Request) -> Response:
        """Give up what is being worked out."""
        use_cases.stop(who(request))
        return now()

    @router.get("/{name}/{method}", responses={200: {"model": UseCaseDocument}})
    def run(name: str, method: str) -> Response:
        """All series of a run that has been worked out."""
        try:
            return Response(use_cases.text(name, method), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    return router
