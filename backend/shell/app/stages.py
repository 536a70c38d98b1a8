"""What detection makes of the LiDARs' points: counted, for who looks at them in the 3D scene."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import APIRouter, Response

from backend.documents.stages import StagesDocument, stages_document
from backend.shell.app.wire import dumps
from backend.shell.stages_look import Look


def stages_router(look: Callable[[], Look]) -> APIRouter:
    """The route /api/stages. look: asked anew by every request, and so kept going."""
    router = APIRouter(tags=["people"])

    @router.get("/api/stages", responses={200: {"model": StagesDocument}})
    def stages() -> Response:
        """Points by the stage of detection at which each ended. Asking has them worked out."""
        told = look()
        document = stages_document(told.stages, told.age, told.reason)
        return Response(dumps(document), media_type="application/json")

    return router
