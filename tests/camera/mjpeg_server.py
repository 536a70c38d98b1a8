"""A small MJPEG camera of one's own: it serves, counts its viewers, falls silent and breaks off."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

JPEG = b"\xff\xd8\xff\xe0" + bytes(2000)


def jpeg(number: int, size: int = 2000) -> bytes:
    """Not a picture, but it begins like one and holds its number."""
    return b"\xff\xd8" + number.to_bytes(4, "big") + bytes(size)


def number(data: bytes) -> int:
    return int.from_bytes(data[2:6], "big")


class MjpegServer:
    """stamp: what it says of the time of each picture, None for nothing."""

    def __init__(
        self, period: float = 0.02, stamp: Callable[[], float] | None = None, size: int = 2000
    ) -> None:
        self.period, self.stamp, self.size = period, stamp, size
        self.connections = self.open = self.sent = 0
        self.silent = self.refusing = False
        self._writers: set[asyncio.StreamWriter] = set()
        self._server: asyncio.Server | None = None
        self.port = 0

    async def __aenter__(self) -> MjpegServer:
        await self.listen()
        return self

    async def listen(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def __aexit__(self, *_: object) -> None:
        await self.die()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/stream"

    async def die(self) -> None:
        """Every connection breaks, and no new one is taken."""
        if self._server is not None:
            self._server.close()
        for writer in list(self._writers):
            writer.transport.abort()
        await asyncio.sleep(0)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self.open += 1
        self._writers.add(writer)
        try:
            await reader.readuntil(b"\r\n\r\n")
            if self.refusing:
                writer.write(b"HTTP/1.1 503 Busy\r\nContent-Length: 0\r\n\r\n")
                await writer.drain()
                return
            writer.write(
                b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=frame\r\n\r\n"
            )
            while True:
                if not self.silent:
                    self.sent += 1
                    body = jpeg(self.sent, self.size)
                    head = b"--frame\r\nContent-Type: image/jpeg\r\n"
                    head += f"Content-Length: {len(body)}\r\n".encode()
                    if self.stamp is not None:
                        head += f"X-Timestamp: {self.stamp():.6f}\r\n".encode()
                    writer.write(head + b"\r\n" + body + b"\r\n")
                await writer.drain()
                await asyncio.sleep(self.period)
        except (ConnectionError, asyncio.IncompleteReadError):
            return
        finally:
            self.open -= 1
            self._writers.discard(writer)
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
