"""The scene's colours, the same as the page's. Saturated colour means abnormal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backend.safety.record import Level

Rgb = tuple[int, int, int]


def rgb(text: str) -> Rgb:
    """(r, g, b) of "#RRGGBB"."""
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


PAGE = rgb("#0F1418")
PANEL = rgb("#171D23")
# Greys of thin lines are lighter than on the page: the scene's tone mapping darkens them.
GRID_MINOR = rgb("#36434E")
GRID_MAJOR = rgb("#566878")
LETTERING = rgb("#C2CED8")
TEXT = rgb("#E6EAED")
SECONDARY = rgb("#A9B3BB")
REACH_NOW = rgb("#BCCBD7")
REACH_MAX = rgb("#94A6B4")
PARTNER = rgb("#A970F0")
SITE = rgb("#3E8E78")
PEOPLE = rgb("#FFFFFF")
SELF = rgb("#C0B8D9")
TIP_OVER = rgb("#79E0B6")
UNDECIDED = rgb("#8A949E")
BLOCKED = rgb("#FF6B5E")  # a stopping distance that does not end in what is certified free
GHOST = rgb("#DDE4EA")  # what a machine would look like
GHOST_HIT = rgb("#E0655E")  # and would touch something
PEOPLE = rgb("#FFFFFF")
BLIND = rgb("#46545F")  # where an operator does not see
EYES = rgb("#6E8496")  # edge of what an operator sees
OUTSIDE = rgb("#5B6B78")  # points that are too far to count
EARTH = rgb("#8F8168")  # points on the ground
STALE = rgb("#8A949E")
EDGE = rgb("#0B0F13")
PAINT = rgb("#D8D8D8")  # of machines described without colours; tinted when drawn
IRON = rgb("#3C4044")

LEVEL: dict[Level, Rgb] = {
    Level.CLEAR: SECONDARY,
    Level.SLOW: rgb("#FFA51F"),
    Level.STOP: rgb("#FF6B5E"),
    Level.UNKNOWN: rgb("#FF6B5E"),
}

# One per machine, in the site's order: muted, so that they cannot be taken for a level's colour.
TINTS: tuple[Rgb, ...] = (
    rgb("#D2C394"),
    rgb("#9FB9CC"),
    rgb("#BFB0CF"),
    rgb("#A9C4AC"),
    rgb("#CDAFA3"),
)


def line(color: Rgb) -> Rgb:
    """What to send for a line so that it shows in `color`: viser takes vertex colours as linear."""
    linear = [((c / 255.0 + 0.055) / 1.055) ** 2.4 if c > 10 else c / 255.0 / 12.92 for c in color]
    return round(255 * linear[0]), round(255 * linear[1]), round(255 * linear[2])


def each(color: Rgb, points: NDArray[np.float32]) -> NDArray[np.uint8]:
    """`line` for every end of lines `points` (k, 2, 3), as uint8 (k, 2, 3).

    Lines whose colour changes later are made with this: the browser shows a line that was made
    with a single colour in white once it gets one for each end.
    """
    return np.broadcast_to(np.array(line(color), dtype=np.uint8), points.shape)


def tint(color: Rgb, machine_tint: Rgb) -> Rgb:
    """A model's own colour in a machine's tint: its brightness is kept, its hue nearly replaced.

    Parts darker than a third (tracks, bucket, glass) stay what they are, a little muted.
    """
    r, g, b = color
    value = (0.30 * r + 0.59 * g + 0.11 * b) / 255.0
    grey = 255.0 * value
    if value < 0.34:
        lifted = 46.0 + 0.75 * grey
        return _mix((lifted, lifted, lifted), color, 0.25)
    lift = min(1.0, 0.45 + 0.75 * value)
    tinted = (machine_tint[0] * lift, machine_tint[1] * lift, machine_tint[2] * lift)
    return _mix(tinted, color, 0.12)


def _mix(a: tuple[float, float, float], b: Rgb, share: float) -> Rgb:
    mixed = [round(x + (y - x) * share) for x, y in zip(a, b, strict=True)]
    return mixed[0], mixed[1], mixed[2]
