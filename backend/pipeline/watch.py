"""From clouds of all LiDARs to tracks: what the process beside the fast loop works out.

    clouds → site frame, without machines → merged → detected → tracked → `Seen`

Each cloud is taken to the site frame, and machines' bodies are taken out of it, by the poses of its
own moment: so the machine's own motion is no motion of what it sees (Rasul 2021, Section 3).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from backend.perception.detect import Objects, Stages, detect, within
from backend.perception.detect import Settings as Detecting
from backend.perception.stages import MOST, StagedScan, codes, counts, thinned
from backend.pipeline.people_records import Missing, Seen, Sensor
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array, BoolArray
from backend.tracking.records import (
    MEASURED,
    PX,
    PY,
    VX,
    VY,
    Detections,
    Lost,
    Settings,
    Tracks,
)
from backend.tracking.tracker import later, nothing, now, track

NOISE: Array = np.array([0.06, 0.06, 0.15, 0.5, 0.2, 0.2, 0.2])
"""Standard deviations of a detection's x, y, z, yaw, length, width, height [m, rad]."""
HORIZON = 1.0


@dataclass(frozen=True)
class Cloud:
    """A turn of a LiDAR, or a part of one. time: by the local clock [s]; points: (n, 3) in the
    sensor's frame [m]; T_site_sensor: (4, 4) at that time; machines: all machines' bodies then.
    """

    machine: str
    sensor: str
    time: float
    points: Array
    T_site_sensor: Array
    machines: Boxes


@dataclass(frozen=True)
class Watched:
    """What one scan hands to the next."""

    tracks: Tracks = field(default_factory=nothing)
    next_id: int = 1


class Part(NamedTuple):
    """One cloud of a scan. points: (n, 3) site frame, those that are numbers [m]; near: (n,) within
    reach of its sensor; machine: of those near, of a machine's own body.
    """

    points: Array
    near: BoolArray
    machine: BoolArray


@dataclass(frozen=True)
class Scan:
    """All clouds together. time: the newest cloud's [s]; points: (n, 3) site frame, in which
    objects are looked for [m]; origin: (n, 3) of the sensor of each; parts: where they are from.
    """

    time: float
    points: Array
    origin: Array
    sensors: tuple[Sensor, ...]
    parts: tuple[Part, ...]


def watch(
    before: Watched,
    clouds: tuple[Cloud, ...],
    detecting: Detecting | None = None,
    tracking: Settings | None = None,
) -> tuple[Watched, Seen]:
    """The tracks after one scan of all LiDARs together, at least one; its time is the newest
    cloud's. Clouds from before the last scan's time are merged all the same.
    """
    settings = detecting or Detecting()
    scan = merged(clouds, settings)
    return follow(before, scan, found_in(scan, settings).objects, tracking)


def merged(clouds: tuple[Cloud, ...], settings: Detecting) -> Scan:
    """Clouds, at least one, in the site frame, each by its own moment's poses and bodies."""
    kept, origins, parts = [], [], []
    for cloud in clouds:
        R, origin = cloud.T_site_sensor[:3, :3], cloud.T_site_sensor[:3, 3]
        points = np.asarray(cloud.points, dtype=float)
        points = points[np.isfinite(points).all(axis=1)] @ R.T + origin
        near = np.hypot(*(points - origin)[:, :2].T) <= settings.reach
        around = points[near]
        machine = within(around, cloud.machines, settings)
        kept.append(around[~machine])
        origins.append(np.broadcast_to(origin, kept[-1].shape))
        parts.append(Part(points, near, machine))
    time = max(cloud.time for cloud in clouds)
    points, origin = np.concatenate(kept), np.concatenate(origins)
    return Scan(time, points, origin, _sensors(clouds), tuple(parts))


def found_in(scan: Scan, settings: Detecting) -> Stages:
    """Stages of the points of a scan in which objects are looked for."""
    return detect(scan.points, scan.origin, NO_BOXES, settings)


def follow(
    before: Watched, scan: Scan, objects: Objects, tracking: Settings | None = None
) -> tuple[Watched, Seen]:
    """The tracks after a scan in which these objects were found."""
    time = max(scan.time, before.tracks.time)
    values = np.column_stack([objects.center, objects.yaw, objects.size])
    found = track(
        before.tracks, Detections(time, values, MEASURED, NOISE), before.next_id, tracking
    )
    return Watched(found.tracks, found.next_id), _seen(found.tracks, time, scan.sensors, found.lost)


def staged(scan: Scan, found: Stages, most: int = MOST) -> StagedScan:
    """What became of every point of a scan, thinned to `most` of them. found: as of `found_in`."""
    points = np.concatenate([part.points for part in scan.parts])
    near = np.concatenate([part.near for part in scan.parts])
    machine, ground = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    machine[near] = np.concatenate([part.machine for part in scan.parts])
    kept, cluster = near & ~machine, np.full(len(points), -1)
    ground[kept], cluster[kept] = found.ground, found.cluster
    stage = codes(Stages(near, machine, ground, cluster, found.plane, found.objects))
    rows = thinned(stage, cluster, most)
    return StagedScan(
        scan.time,
        points[rows].astype(np.float32),
        stage[rows],
        cluster[rows],
        counts(stage),
        found.plane,
        found.objects,
    )


def _sensors(clouds: tuple[Cloud, ...]) -> tuple[Sensor, ...]:
    """Each LiDAR where it was last, with all points: a turn comes in one cloud or in several."""
    newest: dict[tuple[str, str], Sensor] = {}
    for cloud in sorted(clouds, key=lambda cloud: cloud.time):
        key = cloud.machine, cloud.sensor
        before = newest[key].points if key in newest else 0
        x, y, z = cloud.T_site_sensor[:3, 3].tolist()
        newest[key] = Sensor(*key, cloud.time, (x, y, z), before + len(cloud.points))
    return tuple(newest.values())


def _seen(tracks: Tracks, time: float, sensors: tuple[Sensor, ...], lost: tuple[Lost, ...]) -> Seen:
    mean, cov = now(tracks)
    ahead, ahead_cov = later(tracks, HORIZON)
    places = np.ix_([PX, PY, VX, VY], [PX, PY, VX, VY])
    flat = np.ix_([PX, PY], [PX, PY])
    return Seen(
        time,
        time,
        sensors,
        tracks.id,
        tracks.status,
        _short(mean),
        _short(np.array([c[places] for c in cov]).reshape(-1, 4, 4)),
        _short(ahead[:, [PX, PY]]),
        _short(np.array([c[flat] for c in ahead_cov]).reshape(-1, 2, 2)),
        tracks.last_seen,
        tuple(_missing(one) for one in lost),
    )


def _short(values: Array) -> Array:
    """To a tenth of a millimetre: recordings are text, and nobody is seen that well."""
    return np.asarray(np.round(values, 4))


def _missing(one: Lost) -> Missing:
    x, y, z = one.place.tolist()
    return Missing(one.id, (x, y, z), one.last_seen, one.ended)
