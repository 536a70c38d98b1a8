"""Where pictures come from: an MJPEG address, or the machine itself over the link."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Any

from backend.shell.camera.multipart import NoStreamError, Part, Parts, boundary_of
from backend.shell.camera.sharing import CameraGoneError, Pictures
from backend.shell.link.asking import ask
from backend.shell.link.codec import DecodeError, decode_picture

CONNECT, SILENT = 3.0, 5.0  # [s]
PERIOD = 0.2  # between two questions to a machine [s]
ANSWER = 2.0  # how long an answer is waited for [s]


async def mjpeg(url: str) -> Pictures:
    """The pictures of an MJPEG stream. Redirects are not followed: the site file names the place.

    Raises CameraGoneError, in words without the address.
    """
    import httpx

    timeout = httpx.Timeout(SILENT, connect=CONNECT)
    try:
        async with (
            httpx.AsyncClient(trust_env=False, timeout=timeout, follow_redirects=False) as client,
            client.stream("GET", url) as answer,
        ):
            if answer.status_code != 200:
                raise CameraGoneError(f"the camera answers {answer.status_code}")
            parts = Parts(boundary_of(answer.headers.get("content-type", "")))
            async for data in answer.aiter_bytes():
                # What came in one go: only the newest counts.
                for part in parts.feed(data)[-1:]:
                    yield part
    except httpx.TimeoutException:
        raise CameraGoneError("the camera sends nothing") from None
    except httpx.HTTPError:
        raise CameraGoneError("the camera does not answer") from None
    except NoStreamError as error:
        raise CameraGoneError(str(error)) from None
    raise CameraGoneError("the camera ended the stream")


async def asked(session: Any, prefix: str, camera: str) -> Pictures:
    """The pictures that a machine gives when asked, one question at a time. Raises CameraGoneError.

    session: an open Zenoh session; prefix: the machine's keys; camera: its name there.
    """
    loop = asyncio.get_running_loop()
    while True:
        began = loop.time()
        answer: asyncio.Future[bytes | None] = loop.create_future()
        got: list[bytes] = []

        def on_end(told: asyncio.Future[bytes | None] = answer, got: list[bytes] = got) -> None:
            with contextlib.suppress(RuntimeError):  # the loop has closed
                loop.call_soon_threadsafe(_resolve, told, got[0] if got else None)

        try:
            ask(session, "camera", prefix, None, got.append, on_end, ANSWER, camera=camera)
            payload = await asyncio.wait_for(answer, ANSWER + 1.0)
        except TimeoutError:
            payload = None
        except asyncio.CancelledError:
            raise
        except Exception:  # the session was closed under us
            raise CameraGoneError("the link is closed") from None
        if payload is None:
            raise CameraGoneError("the machine sends no picture")
        try:
            stamp, jpeg = decode_picture(payload)
        except DecodeError:
            raise CameraGoneError("the machine sends something that is no picture") from None
        yield Part(jpeg, stamp)
        await asyncio.sleep(max(0.0, PERIOD - (loop.time() - began)))


def _resolve(answer: asyncio.Future[bytes | None], payload: bytes | None) -> None:
    if not answer.done():
        answer.set_result(payload)
