"""`cockpit detect`: files of points in, boxes of people and objects out."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from backend.documents.detection import (
    DetectionDocument,
    ObjectModel,
    PlaneModel,
    ScanModel,
    StagesModel,
)
from backend.errors import InputError
from backend.perception.cloud import read_cloud
from backend.perception.cloud_columns import Cloud
from backend.perception.detect import Settings, Stages, detect, detect_above
from backend.perception.ground_library import find_ground_by_library
from backend.shell.app.wire import dumps
from backend.spatial.boxes import NO_BOXES
from backend.spatial.types import Array
from cockpit.detect_stages import StagedFile
from cockpit.detect_stages import write as write_stages

COLUMNS = ("time", "x", "y", "z", "yaw", "length", "width", "height")
"""Of the CSV file, as `cockpit track` reads it."""
MSAC, LIBRARY = "msac", "scikit-learn"
"""Ways to look for the ground: our own, and a library's."""
MOST = 60  # objects in words; --json has all


@dataclass(frozen=True)
class Times:
    """period: from one file to the next [s]; stamped: the files' names are their times instead."""

    period: float = 0.1
    stamped: bool = False

    def of(self, paths: list[Path]) -> list[float]:
        """Of each file [s]. Raises InputError."""
        if not self.stamped:
            if not 0.0 < self.period < 1e6:
                raise InputError(f"--period {self.period}: must be above 0 and below 1000000 s.")
            return [k * self.period for k in range(len(paths))]
        times: list[float] = []
        for path in paths:
            try:
                time = float(path.stem)
            except ValueError:
                time = math.nan
            if not math.isfinite(time):
                raise InputError(
                    f"{path}: its name is no time; with --stamped names like 12.3{path.suffix} are "
                    "allowed."
                )
            if times and time <= times[-1]:
                raise InputError(
                    f"{path}: comes after a scan at {times[-1]} s; scans must be in the order of "
                    "their times."
                )
            times.append(time)
        return times


def run_detect(
    paths: list[Path],
    as_json: bool,
    out: Path | None,
    ground: bool,
    link: float,
    origin: str,
    reach: float,
    times: Times,
    stages: Path | None = None,
    ground_by: str = MSAC,
) -> None:
    """Prints what is in each file; writes the CSV and what became of every point. Raises
    InputError.
    """
    if ground_by not in (MSAC, LIBRARY):
        raise InputError(f"--ground-by {ground_by}: allowed are {MSAC} and {LIBRARY}.")
    settings = Settings(link=link, reach=reach)
    place = _place(origin) if origin else None
    stamps = times.of(paths)
    scans, staged = [], []
    for path, time in zip(paths, stamps, strict=True):
        scan, one = scan_of(path, time, place, ground, settings, ground_by)
        scans.append(scan)
        if stages is not None:
            staged.append(one)
        if not as_json:
            print(_words(scans[-1], settings))
    if as_json:
        print(dumps(DetectionDocument(scans=scans).model_dump()))
    if out is not None:
        _write(out, scans)
    if stages is not None:
        write_stages(stages, staged)


def scan_of(
    path: Path,
    time: float,
    origin: Array | None,
    ground: bool,
    settings: Settings,
    ground_by: str = MSAC,
) -> tuple[ScanModel, StagedFile]:
    """What is in one file, and what became of its points. Raises InputError."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from None
    cloud = read_cloud(content, str(path))
    place = cloud.origin if origin is None else origin
    if not ground:
        found = detect_above(cloud.points, place, NO_BOXES, settings)
    elif ground_by == LIBRARY:
        near = _near(cloud.points, place, settings)
        plane = find_ground_by_library(near, settings.tolerance, where=str(path))
        found = detect(cloud.points, place, NO_BOXES, settings, plane)
    else:
        found = detect(cloud.points, place, NO_BOXES, settings)
    scan = _scan(str(path), time, cloud, place, found, ground, settings)
    return scan, StagedFile(str(path), time, cloud.points, place, found, ground)


def _near(points: Array, origin: Array, settings: Settings) -> Array:
    """Points in which the ground is looked for."""
    finite = points[np.isfinite(points).all(axis=1)]
    return np.asarray(finite[np.hypot(*(finite - origin)[:, :2].T) <= settings.reach], dtype=float)


def rows_of(scan: ScanModel) -> Iterator[list[str]]:
    """One row a box; one with the time alone where there are none."""
    time = repr(scan.time)
    for box in scan.objects:
        yield [time, *(f"{v:.4f}" for v in (*box.position, box.yaw, *box.size))]
    if not scan.objects:
        yield [time, *([""] * (len(COLUMNS) - 1))]


def _scan(
    file: str,
    time: float,
    cloud: Cloud,
    origin: Array,
    found: Stages,
    ground: bool,
    settings: Settings,
) -> ScanModel:
    finite = np.isfinite(cloud.points).all(axis=1)
    objects = [
        ObjectModel(position=tuple(center), size=tuple(size), yaw=float(yaw), points=int(points))
        for center, yaw, size, points in zip(*found.objects, strict=True)
    ]
    plane = None
    if ground and found.plane is not None:
        normal = found.plane.normal
        plane = PlaneModel(
            normal=tuple(normal),
            offset=found.plane.offset,
            slope=float(math.acos(min(1.0, normal[2]))),
            share=found.plane.share,
        )
    notes = []
    if finite.any() and not found.near.any():
        low, high = (f(cloud.points[finite], axis=0) for f in (np.min, np.max))
        notes.append(
            f"no point is within {settings.reach:g} m of the sensor at {_triple(origin)}: the "
            f"points lie from {_triple(low)} to {_triple(high)}; see --origin and --reach"
        )
    elif ground and plane is None and found.near.any():
        notes.append("no ground was found: heights count from the lowest point")
    return ScanModel(
        file=file,
        format=cloud.format,
        time=time,
        origin=tuple(origin),
        stages=StagesModel(
            points=len(cloud.points),
            numbers=int(finite.sum()),
            near=int(found.near.sum()),
            ground=int(found.ground.sum()),
            clustered=int((found.cluster >= 0).sum()),
        ),
        plane=plane,
        objects=objects,
        notes=notes,
    )


def _words(scan: ScanModel, settings: Settings) -> str:
    s = scan.stages
    ground = "no ground"
    if scan.plane is not None:
        ground = (
            f"{s.ground} on the ground ({math.degrees(scan.plane.slope):.1f}° steep, "
            f"{scan.plane.share:.0%} of them on it)"
        )
    lines = [
        f"{scan.file}: {scan.format}, {scan.time:.3f} s, {s.points} points, {s.near} within "
        f"{settings.reach:g} m, {ground}, {s.clustered} in {len(scan.objects)} objects"
    ]
    if scan.objects:
        heads = ("x", "y", "z", "length", "width", "height", "yaw", "points")
        lines.append("  object" + "".join(f"{head:>10}" for head in heads))
    for k, box in enumerate(scan.objects[:MOST], start=1):
        values = (*box.position, *box.size, box.yaw)
        lines.append(f"  {k:6d}" + "".join(f"{v:10.3f}" for v in values) + f"{box.points:10d}")
    if len(scan.objects) > MOST:
        lines.append(f"  and {len(scan.objects) - MOST} more objects; --json lists all")
    return "\n".join([*lines, *(f"  {note}" for note in scan.notes)])


def _triple(values: Array) -> str:
    return ",".join(f"{v:.1f}" for v in values)


def _place(text: str) -> Array:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise InputError(f"--origin {text}: allowed are three numbers x,y,z [m].")
    return np.array(values)


def _write(out: Path, scans: list[ScanModel]) -> None:
    try:
        with out.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)
            for scan in scans:
                writer.writerows(rows_of(scan))
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written ({error.strerror or error}).") from None
