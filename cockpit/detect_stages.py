"""What `cockpit detect --stages` writes: what became of every point, as arrays of numpy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.perception.detect import Stages
from backend.perception.stages import NAMES, codes
from backend.spatial.types import AnyArray, Array


@dataclass(frozen=True)
class StagedFile:
    """One file of points (n, 3) [m], as it is; ground: whether it was looked for."""

    file: str
    time: float
    points: Array
    origin: Array
    found: Stages
    ground: bool


def arrays(scans: list[StagedFile]) -> dict[str, AnyArray]:
    """n points, k scans and m boxes of all files, in their order.

    points (n, 3) in the file's frame [m]; stage (n,): index into stage_names (5,); cluster (n,):
    row of boxes, -1 for none; scan (n,) and box_scan (m,): rows of files (k,), times (k,) [s],
    origins (k, 3) of the sensor [m] and planes (k, 4): the ground's unit normal and offset [m], NaN
    where none was found or looked for; boxes (m, 7): x, y, z of the middle, yaw, length, width,
    height [m, rad].
    """
    none = np.full(4, np.nan)
    planes = [
        none
        if not scan.ground or scan.found.plane is None
        else np.append(scan.found.plane.normal, scan.found.plane.offset)
        for scan in scans
    ]
    objects = [scan.found.objects for scan in scans]
    of_points = np.repeat(np.arange(len(scans)), [len(scan.points) for scan in scans])
    of_boxes = np.repeat(np.arange(len(scans)), [len(one.yaw) for one in objects])
    first = np.searchsorted(of_boxes, of_points)  # box of the point's scan
    cluster = np.concatenate([scan.found.cluster for scan in scans])
    return {
        "points": np.concatenate([scan.points for scan in scans]),
        "stage": np.concatenate([codes(scan.found) for scan in scans]),
        "stage_names": np.array(NAMES),
        "cluster": np.where(cluster >= 0, cluster + first, -1),
        "scan": of_points,
        "files": np.array([scan.file for scan in scans]),
        "times": np.array([scan.time for scan in scans]),
        "origins": np.array([scan.origin for scan in scans]),
        "planes": np.array(planes),
        "boxes": np.concatenate([np.column_stack([o.center, o.yaw, o.size]) for o in objects]),
        "box_scan": of_boxes,
    }


def write(out: Path, scans: list[StagedFile]) -> None:
    """Raises InputError."""
    try:
        with out.open("wb") as file:
            np.savez_compressed(file, **arrays(scans))
    except OSError as error:
        raise InputError(
            f"--stages {out}: cannot be written ({error.strerror or error})."
        ) from None
