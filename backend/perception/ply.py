"""PLY files: the points of the element `vertex`; ascii, or binary of either byte order."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backend.errors import InputError
from backend.perception.cloud_columns import (
    Cloud,
    ascii_rows,
    column,
    fits,
    header_lines,
    whole,
)

_KINDS = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Element:
    """properties: (name, kind of numpy) in their order; lists: whether one is a list."""

    name: str
    count: int
    line: int
    properties: list[tuple[str, str]] = field(default_factory=list)
    lists: bool = False

    @property
    def step(self) -> int:
        return sum(int(kind[1]) for _, kind in self.properties)


@dataclass
class _Header:
    form: str
    elements: list[_Element]
    end: int
    line: int


def read_ply(content: bytes, name: str) -> Cloud:
    """Raises InputError with the line or the byte of what is wrong."""
    header = _header(content, name)
    before, vertex = _vertex(header, name)
    names = [known for known, _ in vertex.properties]
    if any(names.count(axis) != 1 for axis in "xyz"):
        raise InputError(
            f"{name}, line {vertex.line}: the element vertex has '{' '.join(names)[:80]}'; needed "
            "are x, y and z, each once."
        )
    axes = tuple(names.index(axis) for axis in "xyz")
    if header.form == "ascii":
        skipped = sum(element.count for element in before)
        start = _after_lines(content, header.end, skipped, header.line + 1, name)
        line = header.line + 1 + skipped
        points = ascii_rows(content, start, line, vertex.count, axes, len(names), name)
    else:
        start = header.end
        for element in before:
            fits(element.count, max(element.step, 1), start, content, name)
            start += element.count * element.step
        fits(vertex.count, vertex.step, start, content, name)
        kinds = [kind for _, kind in vertex.properties]
        offsets = np.cumsum([0, *(int(kind[1]) for kind in kinds)])
        order = _ORDERS[header.form]
        points = np.stack(
            [
                column(
                    content, vertex.count, order + kinds[k], start + int(offsets[k]), vertex.step
                )
                for k in axes
            ],
            axis=1,
        )
    return Cloud(points, np.zeros(3), f"PLY {header.form}")


def _header(content: bytes, name: str) -> _Header:
    form, elements = "", list[_Element]()
    for line in header_lines(content, name):
        match line.words:
            case ["ply"] if line.number == 1:
                pass
            case ["format", word, "1.0"] if word in _ORDERS and not form:
                form = word
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["element", known, count]:
                counted = whole(count, f"the count of {known[:40]}", line.number, name)
                elements.append(_Element(known, counted, line.number))
            case ["property", "list", first, second, _] if (
                elements and first in _KINDS and second in _KINDS
            ):
                elements[-1].lists = True
            case ["property", kind, known] if elements and kind in _KINDS:
                elements[-1].properties.append((known, _KINDS[kind]))
            case ["end_header"] if form:
                return _Header(form, elements, line.end, line.number)
            case words:
                raise InputError(
                    f"{name}, line {line.number}: '{' '.join(words)[:60]}' is not allowed there; a "
                    "header has format (ascii, binary_little_endian or binary_big_endian 1.0), "
                    "element, property, comment, end_header."
                )
    raise AssertionError  # header_lines ends with the header or an error


def _vertex(header: _Header, name: str) -> tuple[list[_Element], _Element]:
    """The elements before the vertices, and the vertices."""
    for k, element in enumerate(header.elements):
        if element.lists and (header.form != "ascii" or element.name == "vertex"):
            raise InputError(
                f"{name}, line {element.line}: the element '{element.name[:40]}' has a list; lists "
                "are allowed behind the vertices only."
            )
        if element.name == "vertex":
            return header.elements[:k], element
    raise InputError(f"{name}: the header has no element vertex, which is required.")


def _after_lines(content: bytes, start: int, count: int, line: int, name: str) -> int:
    """Where `count` lines from `start` on end."""
    for k in range(count):
        start = content.find(b"\n", start) + 1
        if not start:
            raise InputError(f"{name}, line {line + k}: the file ends before its points.")
    return start
