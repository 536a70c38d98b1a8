"""One connection for all viewers, with a real MJPEG server: shared, latest wins, tried again."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

import pytest
from mjpeg_server import MjpegServer, number

from backend.shell.camera import sharing, sources
from backend.shell.camera.age import ARRIVAL, CAPTURE
from backend.shell.camera.sharing import SharedCamera
from backend.shell.camera.sources import mjpeg


def run(scenario: Coroutine[Any, Any, None]) -> None:
    asyncio.run(asyncio.wait_for(scenario, 30.0))


async def until(condition: Callable[[], bool]) -> None:
    while not condition():
        await asyncio.sleep(0.005)


def seen(camera: SharedCamera) -> int:
    return 0 if camera.picture is None else number(camera.picture.jpeg)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sharing, "FIRST_WAIT", 0.02)
    monkeypatch.setattr(sharing, "LONGEST_WAIT", 0.1)


def test_viewers_share_one_connection_which_ends_with_the_last() -> None:
    async def scenario() -> None:
        async with MjpegServer() as server:
            camera = SharedCamera(partial(mjpeg, server.url))
            await asyncio.sleep(0.05)
            assert server.connections == 0  # nobody watches
            with camera.watching():
                await until(lambda: seen(camera) > 2)
                with camera.watching(), camera.watching():
                    before = seen(camera)
                    await until(lambda: seen(camera) > before + 2)
                    assert camera.viewers == 3
                assert server.open == server.connections == 1
            await until(lambda: server.open == 0)
            assert camera.picture is None
            with camera.watching():
                await until(lambda: seen(camera) > 0)
            assert server.connections == 2

    run(scenario())


def test_a_viewer_that_sleeps_wakes_to_the_newest_picture() -> None:
    async def scenario() -> None:
        async with MjpegServer(period=0.005) as server:
            camera = SharedCamera(partial(mjpeg, server.url))
            with camera.watching() as viewer:
                await until(lambda: seen(camera) > 0)
                viewer.changed.clear()
                await until(lambda: seen(camera) > 20)
                assert viewer.changed.is_set()
                assert seen(camera) > 20  # there is one picture, not a queue of them

    run(scenario())


def test_a_camera_that_dies_is_said_in_words_and_tried_again() -> None:
    async def scenario() -> None:
        async with MjpegServer() as server:
            camera = SharedCamera(partial(mjpeg, server.url))
            with camera.watching() as viewer:
                await until(lambda: seen(camera) > 2)
                await server.die()
                viewer.changed.clear()
                await viewer.changed.wait()
                await until(lambda: camera.trouble == "the camera does not answer")
                last = camera.picture
                assert last is not None  # with its age, which goes on growing
                await server.listen()
                await until(lambda: camera.trouble == "" and camera.picture is not last)
                assert camera.picture is not None
                assert camera.picture.serial > last.serial

    run(scenario())


def test_silence_and_refusals_are_said_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "SILENT", 0.1)

    async def scenario() -> None:
        async with MjpegServer() as server:
            camera = SharedCamera(partial(mjpeg, server.url))
            with camera.watching():
                await until(lambda: seen(camera) > 0)
                server.silent = True
                await until(lambda: camera.trouble == "the camera sends nothing")
                server.refusing = True
                await until(lambda: camera.trouble == "the camera answers 503")
                assert server.url not in camera.trouble

    run(scenario())


def test_attempts_become_rarer(monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []
    rest = asyncio.sleep

    async def sleep(seconds: float) -> None:
        waits.append(seconds)
        await rest(0)

    async def scenario() -> None:
        async with MjpegServer() as server:
            server.refusing = True
            camera = SharedCamera(partial(mjpeg, server.url))
            monkeypatch.setattr(sharing.asyncio, "sleep", sleep)
            with camera.watching() as viewer:
                while len(waits) < 5:
                    viewer.changed.clear()
                    await viewer.changed.wait()

    run(scenario())
    assert [w for w in waits if w > 0.0][:4] == [0.02, 0.04, 0.08, 0.1]


@pytest.mark.parametrize(("stamped", "by"), [(True, CAPTURE), (False, ARRIVAL)])
def test_the_age_says_what_it_counts_from(stamped: bool, by: str) -> None:
    async def scenario() -> None:
        late = (lambda: time.time() - 1.5) if stamped else None
        async with MjpegServer(stamp=late) as server:
            camera = SharedCamera(partial(mjpeg, server.url))
            with camera.watching():
                await until(lambda: seen(camera) > 0)
                picture = camera.picture
                assert picture is not None
                assert picture.by == by
                assert (time.monotonic() - picture.taken >= 1.5) is stamped

    run(scenario())
