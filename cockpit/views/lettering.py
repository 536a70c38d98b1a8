"""Stroke letters painted on the ground: line segments, no font needed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cockpit.views.shapes import Float32

# Strokes on a 2 x 4 raster, x to the right and y up from the lower left corner.
STROKES: dict[str, tuple[str, ...]] = {
    "0": ("00 20 24 04 00",),
    "1": ("03 14 10", "00 20"),
    "2": ("04 24 22 02 00 20",),
    "3": ("04 24 20 00", "02 22"),
    "4": ("04 02 22", "24 20"),
    "5": ("24 04 02 22 20 00",),
    "6": ("24 04 00 20 22 02",),
    "7": ("04 24 10",),
    "8": ("00 20 24 04 00", "02 22"),
    "9": ("22 02 04 24 20 00",),
    "E": ("24 04 00 20", "02 12"),
    "N": ("00 04 20 24",),
    "m": ("00 02 12 10", "12 22 20"),
    "-": ("02 22",),
}
ADVANCE = 3.2  # raster units from letter to letter


def width(text: str, height: float) -> float:
    """Length of a written text [m]."""
    return max(0.0, (len(text) * ADVANCE - (ADVANCE - 2.0)) * height / 4.0)


def written(text: str, origin: tuple[float, float], height: float) -> Float32:
    """Line segments (k, 2, 3) in the plane z = 0, from the lower left corner `origin` along x [m].

    Letters without strokes leave a space.
    """
    lines: list[list[tuple[float, float, float]]] = []
    for position, letter in enumerate(text):
        for stroke in STROKES.get(letter, ()):
            points = [
                (
                    origin[0] + (position * ADVANCE + int(knot[0])) * height / 4.0,
                    origin[1] + int(knot[1]) * height / 4.0,
                    0.0,
                )
                for knot in stroke.split()
            ]
            lines += [[a, b] for a, b in pairwise(points)]
    return np.array(lines, dtype=np.float32).reshape(-1, 2, 3)
