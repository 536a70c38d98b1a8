"""Tracking labels of the KITTI benchmark (Geiger et al. 2012) as detections.

One object a line: frame, track id, type, truncated, occluded, alpha, box in the image (4), height,
width, length [m], the middle of its bottom x y z in the camera's frame (right, down, ahead) [m] and
rotation_y about its y axis [rad]; results have a score behind. Identities are not used. Detections
are in a frame with x ahead, y to the left and z up from the camera, which moves with its car.
"""

from __future__ import annotations

import math

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array
from backend.tracking.records import MEASURED, Detections

NUMBERS = (
    *("truncated", "occluded", "alpha", "left", "top", "right", "bottom"),
    *("height", "width", "length", "x", "y", "z", "rotation_y", "score"),
)
"""The numbers behind frame, track id and type; the last may be missing."""
TYPES = (
    *("Car", "Van", "Truck", "Pedestrian", "Person", "Person_sitting", "Cyclist", "Tram", "Misc"),
    "DontCare",
)
FRAMES = 100_000
"""Allowed are frames below this."""
_DEVIATIONS = (0.1, 0.5, 0.2, 0.2, 0.2)  # of z [m], yaw [rad], length, width, height [m]


def read_kitti(text: str, name: str, period: float = 0.1, sigma: float = 0.08) -> list[Detections]:
    """Every frame from the first to the last one as a scan, also those without a line.

    period: from one frame to the next [s]; sigma: standard deviation of x and y [m]. Raises
    InputError with the line of what is wrong.
    """
    frames: dict[int, list[Array]] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if words:
            frame, box = _row(words, f"{name}, line {number}")
            boxes = frames.setdefault(frame, [])
            if box is not None:
                boxes.append(box)
    if not frames:
        raise InputError(f"{name}: has no line; needed are KITTI tracking labels.")
    noise = np.array([sigma, sigma, *_DEVIATIONS])
    return [
        Detections(frame * period, np.array(frames.get(frame, [])).reshape(-1, 7), MEASURED, noise)
        for frame in range(min(frames), max(frames) + 1)
    ]


def _row(words: list[str], where: str) -> tuple[int, Array | None]:
    """Frame and box; None for a region that nobody has looked at."""
    count = len(NUMBERS) + 3
    if len(words) not in (count - 1, count):
        raise InputError(
            f"{where}: has {len(words)} words; a KITTI tracking label has {count - 1}, or {count} "
            "with a score."
        )
    if not (words[0].isascii() and words[0].isdigit() and len(words[0]) < 8):
        frame = FRAMES
    else:
        frame = int(words[0])
    if frame >= FRAMES:
        raise InputError(f"{where}: the frame is '{words[0][:40]}'; allowed is 0 to {FRAMES - 1}.")
    if words[2] not in TYPES:
        raise InputError(f"{where}: the type is '{words[2][:40]}'; allowed are {', '.join(TYPES)}.")
    values = {
        column: _finite(word, column, where)
        for column, word in zip(NUMBERS, words[3:], strict=False)
    }
    if words[2] == "DontCare":
        return frame, None
    for column in ("height", "width", "length"):
        if not 0.0 < values[column] < 1e3:
            raise InputError(
                f"{where}: {column} is '{values[column]:g}'; allowed is above 0 and below 1000 m."
            )
    return frame, _box(values)


def _box(v: dict[str, float]) -> Array:
    """(7,) as `records.MEASURED`. Ahead of a box with rotation_y = 0 is the camera's right."""
    yaw = -v["rotation_y"] - 0.5 * math.pi
    middle = -v["y"] + 0.5 * v["height"]
    return np.array([v["z"], -v["x"], middle, yaw, v["length"], v["width"], v["height"]])


def _finite(word: str, column: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise InputError(f"{where}: {column} is '{word[:40]}'; allowed is a finite number.")
    return value
