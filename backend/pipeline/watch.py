"""From clouds of all LiDARs to tracks: what the process beside the fast loop works out.

    clouds → site frame, without machines → merged → detected → tracked → `Seen`

Each cloud is taken to the site frame, and machines' bodies are taken out of it, by the poses of its
own moment: so the machine's own motion is no motion of what it sees (Rasul 2021, Section 3).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backend.perception.detect import Settings as Detecting
from backend.perception.detect import detect, within
from backend.pipeline.people_records import Missing, Seen, Sensor
from backend.spatial.boxes import NO_BOXES, Boxes
from backend.spatial.types import Array
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
    time = max(max(cloud.time for cloud in clouds), before.tracks.time)
    kept, origins = [], []
    for cloud in clouds:
        R, origin = cloud.T_site_sensor[:3, :3], cloud.T_site_sensor[:3, 3]
        points = np.asarray(cloud.points, dtype=float)
        points = points[np.isfinite(points).all(axis=1)] @ R.T + origin
        points = points[np.hypot(*(points - origin)[:, :2].T) <= settings.reach]
        points = points[~within(points, cloud.machines, settings)]
        kept.append(points)
        origins.append(np.broadcast_to(origin, points.shape))
    merged, origin = np.concatenate(kept), np.concatenate(origins)
    objects = detect(merged, origin, NO_BOXES, settings).objects
    values = np.column_stack([objects.center, objects.yaw, objects.size])
    found = track(
        before.tracks, Detections(time, values, MEASURED, NOISE), before.next_id, tracking
    )
    return Watched(found.tracks, found.next_id), _seen(
        found.tracks, time, _sensors(clouds), found.lost
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
