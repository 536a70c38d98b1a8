"""Images made by another process: the same as here, and never the end of the backend."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "pipeline"))
from test_step import config, run

from backend.pipeline.config import Config
from backend.pipeline.exact import Cells
from backend.pipeline.images import SunParameters
from backend.pipeline.records import Snapshot
from backend.shell.image_worker import ImageWorker, WorkerGone
from backend.shell.kinds import EXACT, SUN, Recipe, Wishes, make_images

__all__ = ["config"]
pytestmark = pytest.mark.processes

CELLS = Cells(slice=16, bar=24, volume=8, reach=(12, 10))
WISHES = Wishes({"a": 0.4})


@pytest.fixture(scope="module")
def snapshot(config: Config) -> Snapshot:
    return run(config, 0.4, b_position=(8.0, 0.0))[-1]


@pytest.fixture
def recipe(config: Config) -> Recipe:
    return Recipe(config, SunParameters(20, 20, 0.1), (SUN, EXACT), CELLS)


@pytest.fixture
def worker(recipe: Recipe) -> Iterator[ImageWorker]:
    made = ImageWorker(recipe)
    yield made
    made.close()


def test_another_process_makes_the_same_images(
    worker: ImageWorker, recipe: Recipe, snapshot: Snapshot
) -> None:
    there, here = worker.make(snapshot, WISHES), make_images(recipe, snapshot, WISHES)
    assert worker.pid not in (None, os.getpid())
    named = [(one.kind, one.image.key) for one in there]
    assert named == [("sun", "a<-b"), ("sun", "b<-a"), ("exact", "a"), ("exact", "b")]
    for theirs, ours in zip(there, here, strict=True):
        assert theirs.image.state_time == snapshot.state_time
        if theirs.kind == EXACT:
            np.testing.assert_array_equal(theirs.image.volume, ours.image.volume)
            for a, b in zip(theirs.image.slices, ours.image.slices, strict=True):
                np.testing.assert_array_equal(a.cells, b.cells)
    assert there[2].image.tip_height == 0.4
    assert there[3].image.tip_height is None


def test_a_killed_process_is_told_and_replaced(worker: ImageWorker, snapshot: Snapshot) -> None:
    worker.make(snapshot, WISHES)
    first = worker.pid
    assert first is not None
    os.kill(first, signal.SIGKILL)
    with pytest.raises(WorkerGone):
        worker.make(snapshot, WISHES)
    assert len(worker.make(snapshot, WISHES)) == 4
    assert worker.pid != first


def test_what_fails_is_told_and_the_next_is_tried(recipe: Recipe, snapshot: Snapshot) -> None:
    worker = ImageWorker(replace(recipe, sun=SunParameters(-5, 20, 0.1)))
    try:
        with pytest.raises(RuntimeError, match="Error"):
            worker.make(snapshot, WISHES)
        assert worker.pid is not None
        with pytest.raises(RuntimeError):
            worker.make(snapshot, WISHES)
    finally:
        worker.close()
