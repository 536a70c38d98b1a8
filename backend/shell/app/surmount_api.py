"""The API of manoeuvres over steps: asked for, on offer, taken off. Following one is the
websocket's.
"""

from __future__ import annotations

from typing import Any, Protocol

from fastapi import APIRouter, Request, Response

from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_state import (
    FollowedSurmount,
    SideView,
    SurmountChoice,
    SurmountRequest,
    SurmountStateDocument,
)
from backend.errors import InputError
from backend.shell.app.answers import refused, who
from backend.shell.app.wire import dumps


class Surmounts(Protocol):
    """What the API asks. All are called in worker threads; all but `document` and `drop` may raise
    InputError.
    """

    def document(self) -> dict[str, Any]: ...

    def start(self, asked: SurmountRequest, who: str) -> str: ...

    def choose(self, machine: str, plan: str, choice: SurmountChoice, who: str) -> str: ...

    def drop(self, machine: str, who: str) -> None: ...

    def followed(self, machine: str, plan: str) -> dict[str, Any]: ...

    def side(self, machine: str, plan: str) -> dict[str, Any]: ...

    def text(self, machine: str, plan: str) -> str: ...


def surmount_router(surmounts: Surmounts) -> APIRouter:
    """Routes below /api/surmount. Whoever may drive may ask for one; see access.rules."""
    router = APIRouter(prefix="/api/surmount", tags=["surmounting"])
    answers: dict[int | str, dict[str, Any]] = {200: {"model": SurmountStateDocument}}

    def now() -> Response:
        text = dumps({"surmounts": surmounts.document()})
        return Response(text, media_type="application/json")

    @router.get("", responses=answers)
    def state() -> Response:
        """Every machine's newest manoeuvre; also the key `surmounts` of the snapshot."""
        return now()

    @router.post("", responses=answers)
    def start(asked: SurmountRequest, request: Request) -> Response:
        """Look for one from where the machine is now. No machine moves by it."""
        try:
            surmounts.start(asked, who(request))
        except InputError as error:
            return refused(error, 409)
        return now()

    @router.post("/{machine}/{plan}/choose", responses=answers)
    def choose(machine: str, plan: str, choice: SurmountChoice, request: Request) -> Response:
        """Work out another candidate in its place; its name is a new one."""
        try:
            surmounts.choose(machine, plan, choice, who(request))
        except InputError as error:
            return refused(error, 409)
        return now()

    @router.delete("/{machine}", responses=answers)
    def drop(machine: str, request: Request) -> Response:
        """Take the machine's manoeuvre off, also while it is looked for; who follows it stops."""
        surmounts.drop(machine, who(request))
        return now()

    @router.get("/{machine}/{plan}", responses={200: {"model": SurmountDocument}})
    def made(machine: str, plan: str) -> Response:
        """All of a manoeuvre: joints, tracks, base (site frame), candidates, figures."""
        try:
            return Response(surmounts.text(machine, plan), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    @router.get("/{machine}/{plan}/side", responses={200: {"model": SideView}})
    def side(machine: str, plan: str) -> Response:
        """The machine from the side, from moment to moment."""
        try:
            return Response(dumps(surmounts.side(machine, plan)), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    @router.get("/{machine}/{plan}/followed", responses={200: {"model": FollowedSurmount}})
    def followed(machine: str, plan: str) -> Response:
        """What the sensors saw while it was followed; empty before."""
        try:
            return Response(dumps(surmounts.followed(machine, plan)), media_type="application/json")
        except InputError as error:
            return refused(error, 404)

    return router
