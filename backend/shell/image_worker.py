"""A process that makes images, so that they never hold up the interpreter of the fast loop."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from backend.pipeline.records import Snapshot
from backend.shell.aside import NICENESS, Aside, WorkerGone
from backend.shell.kinds import Made, Recipe, Wishes, make_images

__all__ = ["ImageWorker", "WorkerGone"]

_Question = tuple[Snapshot, Wishes]


class ImageWorker(Aside[_Question, list[Made]]):
    """Asks a process of its own for the images of a recipe. One caller at a time."""

    def __init__(self, recipe: Recipe, niceness: int = NICENESS) -> None:
        super().__init__(partial(_begin, recipe), "makes images", niceness)

    def make(self, snapshot: Snapshot, wishes: Wishes) -> list[Made]:
        """Blocks until all images are made. Raises WorkerGone, or RuntimeError with what failed."""
        return self.ask((snapshot, wishes))


def _begin(recipe: Recipe) -> Callable[[_Question], list[Made]]:
    def make(question: _Question) -> list[Made]:
        return make_images(recipe, *question)

    return make
