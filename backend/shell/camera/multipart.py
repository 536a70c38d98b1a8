"""Pictures out of an MJPEG stream: multipart/x-mixed-replace (RFC 2046), a JPEG a part."""

from __future__ import annotations

import math
from dataclasses import dataclass
from email.message import Message

LARGEST = 4 * 2**20  # of a picture [bytes]
LONGEST_HEAD = 8192  # of a part's headers [bytes]
JPEG = b"\xff\xd8"


class NoStreamError(Exception):
    """What arrives is no MJPEG stream; the words say why."""


@dataclass(frozen=True)
class Part:
    """stamp: the time by the camera's own clock [s]; None if it says nothing of it."""

    jpeg: bytes
    stamp: float | None


def boundary_of(content_type: str) -> bytes:
    """The separator of parts. Raises NoStreamError."""
    message = Message()
    message["Content-Type"] = content_type
    found = message.get_boundary()
    if message.get_content_maintype() != "multipart" or not found:
        raise NoStreamError("the address leads to no MJPEG stream")
    # Some cameras state the boundary with its leading dashes, some without.
    return b"--" + found.encode("latin-1", "replace").removeprefix(b"--")


class Parts:
    """Cuts a stream into parts. Memory is bounded by one picture and what one `feed` brings."""

    def __init__(self, boundary: bytes) -> None:
        self._boundary = boundary
        self._buffer = bytearray()
        self._headers: dict[bytes, bytes] | None = None
        self._searched = 0

    def feed(self, data: bytes) -> list[Part]:
        """The pictures that `data` completes. Raises NoStreamError."""
        self._buffer += data
        found: list[Part] = []
        while True:
            if self._headers is None and not self._head():
                return found
            body = self._body()
            if body is None:
                return found
            if body.startswith(JPEG):
                found.append(Part(body, _stamp(self._headers or {})))
            self._headers = None

    def _head(self) -> bool:
        """Whether a boundary and a part's headers are complete; takes them off the buffer."""
        start = self._buffer.find(self._boundary)
        end = -1 if start < 0 else self._buffer.find(b"\r\n\r\n", start)
        if end < 0:
            if len(self._buffer) > LONGEST_HEAD:
                raise NoStreamError("the stream has no parts")
            return False
        lines = bytes(self._buffer[start:end]).split(b"\r\n")[1:]
        pairs = (line.partition(b":") for line in lines)
        self._headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
        del self._buffer[: end + 4]
        self._searched = 0
        return True

    def _body(self) -> bytes | None:
        """The part's content once it is complete: by its length, or up to the next boundary."""
        length = (self._headers or {}).get(b"content-length", b"")
        if length.isdigit():
            size = int(length)
            if size > LARGEST:
                raise NoStreamError(f"a picture of over {LARGEST >> 20} MiB")
            if len(self._buffer) < size:
                return None
            end, rest = size, size
        else:
            separator = b"\r\n" + self._boundary
            end = self._buffer.find(separator, self._searched)
            if end < 0:
                if len(self._buffer) > LARGEST:
                    raise NoStreamError(f"a picture of over {LARGEST >> 20} MiB")
                self._searched = max(0, len(self._buffer) - len(separator))
                return None
            rest = end + 2
        body = bytes(self._buffer[:end])
        del self._buffer[:rest]
        return body


def _stamp(headers: dict[bytes, bytes]) -> float | None:
    try:
        value = float(headers.get(b"x-timestamp", b""))
    except ValueError:
        return None
    return value if math.isfinite(value) and value > 0.0 else None
