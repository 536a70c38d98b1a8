"""What all formats of point clouds have in common: text headers, and columns of records."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array

_LONGEST = 65_536  # bytes of a header's line
_MOST = 10_000  # lines of a header


class Cloud(NamedTuple):
    """points: (n, 3) as the file has them, not a number where it says so [m]; origin: (3,) of the
    sensor, where the file says so, else zeros [m]; format: in words.
    """

    points: Array
    origin: Array
    format: str


class Line(NamedTuple):
    """One line of a header. number: from 1; end: where the next one begins."""

    number: int
    words: list[str]
    end: int


def header_lines(content: bytes, name: str) -> Iterator[Line]:
    """The lines of a text header in words, until the caller has enough.

    Raises InputError where a line is no text, or the header has no end.
    """
    at = number = 0
    while True:
        number += 1
        newline = content.find(b"\n", at, at + _LONGEST)
        if newline < 0 or number > _MOST:
            raise InputError(
                f"{name}, line {number}: the header has no end; allowed are {_MOST} lines of "
                f"{_LONGEST} bytes."
            )
        try:
            text = content[at:newline].decode("ascii")
        except UnicodeDecodeError:
            raise InputError(
                f"{name}, line {number}: is no text; the header must be plain ASCII."
            ) from None
        at = newline + 1
        yield Line(number, text.split(), at)


def whole(word: str, what: str, line: int, name: str) -> int:
    """A count of the header, at least 0. Raises InputError."""
    if not (word.isascii() and word.isdigit() and len(word) <= 18):
        raise InputError(
            f"{name}, line {line}: {what} is '{word[:40]}'; allowed is a whole number."
        )
    return int(word)


def fits(count: int, step: int, start: int, content: bytes, name: str) -> None:
    """Raises InputError when `count` records of `step` bytes from `start` on are not all there."""
    there = max(len(content) - start, 0)
    if count * step > there:
        raise InputError(
            f"{name}, byte {start}: the header claims {count} points of {step} bytes each, but "
            f"{there} bytes follow, enough for {there // step}."
        )


def column(content: bytes | memoryview, count: int, kind: str, offset: int, step: int) -> Array:
    """(count,) the numbers of type `kind` at offset, offset + step and so on."""
    if not count:
        return np.zeros(0)
    values = np.ndarray((count,), np.dtype(kind), content, offset, (step,))
    with np.errstate(invalid="ignore"):
        return values.astype(float)


def ascii_rows(
    content: bytes,
    start: int,
    line: int,
    count: int,
    columns: tuple[int, ...],
    wide: int,
    name: str,
) -> Array:
    """(count, len(columns)) of rows of `wide` numbers as text. line: number of the first.

    Raises InputError with the line of what is wrong.
    """
    if not count:
        return np.zeros((0, len(columns)))
    if count * (2 * wide) - 1 > len(content) - start:
        raise InputError(
            f"{name}, line {line}: the header claims {count} points of {wide} numbers each, but "
            f"only {max(len(content) - start, 0)} bytes follow."
        )
    rows = np.empty((count, len(columns)))
    k = 0
    for text in io.BytesIO(memoryview(content)[start:]):
        words = text.split()
        if words:
            if len(words) != wide:
                raise InputError(
                    f"{name}, line {line}: has {len(words)} numbers, but the header says {wide}."
                )
            for c, at in enumerate(columns):
                rows[k, c] = _number(words[at], line, name)
            k += 1
            if k == count:
                return rows
        line += 1
    raise InputError(
        f"{name}, line {line}: the file ends after {k} points, but its header claims {count}."
    )


def _number(word: bytes, line: int, name: str) -> float:
    try:
        return float(word)
    except ValueError:
        shown = word[:40].decode("ascii", "replace")
        raise InputError(
            f"{name}, line {line}: '{shown}' is no number; allowed are numbers and nan."
        ) from None
