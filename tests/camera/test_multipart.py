"""MJPEG streams cut into pictures, however they arrive."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.shell.camera.multipart import (
    LARGEST,
    LONGEST_HEAD,
    NoStreamError,
    Part,
    Parts,
    boundary_of,
)

PICTURES = [b"\xff\xd8one", b"\xff\xd8" + b"two\r\n" * 40, b"\xff\xd8\r\n--three"]


def stream(lengths: bool, stamps: bool = False) -> bytes:
    data = b"preamble\r\n"
    for k, picture in enumerate(PICTURES):
        data += b"--frame\r\nContent-Type: image/jpeg\r\n"
        data += b"content-length: %d\r\n" % len(picture) if lengths else b""
        data += b"X-Timestamp: %d.5\r\n" % (100 + k) if stamps else b""
        data += b"\r\n" + picture + b"\r\n"
    return data + b"--frame\r\n"


@given(st.lists(st.integers(1, 60), max_size=40), st.booleans())
def test_however_it_is_cut_the_pictures_are_whole(cuts: list[int], lengths: bool) -> None:
    data, parts, found = stream(lengths), Parts(b"--frame"), []
    for cut in [*cuts, len(data)]:
        found += parts.feed(data[:cut])
        data = data[cut:]
    assert [part.jpeg for part in found] == PICTURES


def test_stamps_are_read_where_they_are_numbers() -> None:
    found = Parts(b"--frame").feed(stream(True, stamps=True))
    assert [part.stamp for part in found] == [100.5, 101.5, 102.5]
    for text in (b"yesterday", b"nan", b"inf", b"0.000000", b""):
        head = b"--frame\r\nX-Timestamp: " + text + b"\r\nContent-Length: 3\r\n\r\n\xff\xd8x"
        assert Parts(b"--frame").feed(head) == [Part(b"\xff\xd8x", None)]


def test_what_is_no_picture_is_left_out() -> None:
    text = b"--frame\r\nContent-Type: text/plain\r\nContent-Length: 2\r\n\r\nno\r\n"
    assert [p.jpeg for p in Parts(b"--frame").feed(text + stream(True))] == PICTURES


@pytest.mark.parametrize(
    ("content_type", "boundary"),
    [
        ("multipart/x-mixed-replace;boundary=frame", b"--frame"),
        ('multipart/x-mixed-replace; boundary="--frame"', b"--frame"),
        ("Multipart/X-Mixed-Replace; Boundary=b", b"--b"),
    ],
)
def test_boundaries(content_type: str, boundary: bytes) -> None:
    assert boundary_of(content_type) == boundary


@pytest.mark.parametrize("content_type", ["", "image/jpeg", "multipart/x-mixed-replace"])
def test_other_answers_are_no_stream(content_type: str) -> None:
    with pytest.raises(NoStreamError):
        boundary_of(content_type)


def test_memory_is_bounded() -> None:
    with pytest.raises(NoStreamError, match="no parts"):
        Parts(b"--frame").feed(bytes(LONGEST_HEAD + 1))
    with pytest.raises(NoStreamError, match="MiB"):
        Parts(b"--frame").feed(b"--frame\r\nContent-Length: %d\r\n\r\n" % (LARGEST + 1))
    endless = Parts(b"--frame")
    endless.feed(b"--frame\r\n\r\n\xff\xd8")
    endless.feed(bytes(LARGEST - 2))
    with pytest.raises(NoStreamError, match="MiB"):
        endless.feed(bytes(1))
