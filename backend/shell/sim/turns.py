"""One turn of every LiDAR of a simulated machine, without a clock, for wire and campaigns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.lidars import sensor_pose
from backend.shell.sim.cab import Seen
from backend.shell.sim.lidar import WHOLE, Lidar, measured
from backend.shell.sim.walkers import people_at, vehicles_at
from backend.site.site import Site
from backend.spatial.boxes import concatenated
from backend.spatial.types import AnyArray, Array, IntArray


@dataclass(frozen=True)
class Turn:
    """sensor: the mount's name; T_site_sensor: (4, 4), truly; points: (n, 3) float32 as measured,
    in the sensor's frame [m]; hit: (n,) what each is of: -1 the ground, then by number the boxes of
    the machine's own bodies, of the others', of obstacles and vehicles, then the people, each twice
    (torso, head).
    """

    sensor: str
    T_site_sensor: Array
    points: AnyArray
    hit: IntArray


def scan_at(
    site: Site,
    t: float,
    own: Seen,
    others: Iterable[Seen],
    rng: np.random.Generator,
    lidar: Lidar | None = None,
    part: tuple[int, int] = WHOLE,
) -> tuple[Turn, ...]:
    """What the LiDARs of `own` measure t [s] on the schedule, in the order of its machine's mounts.

    others: the other machines; lidar: what all of them are like, apart from their beams; part: of a
    turn, which one of how many. Obstacles, people and vehicles are the site's, the ground is z = 0;
    all stand still during the turn or its part.
    """
    alike = lidar or Lidar()
    links = link_poses(own.machine, own.q, own.T_site_root)
    bodies = [body_boxes(own.machine, links)]
    bodies += [body_boxes(m.machine, link_poses(m.machine, m.q, m.T_site_root)) for m in others]
    boxes = concatenated([*bodies, site.obstacle_boxes(), vehicles_at(site, t)])
    people = people_at(site, t)
    turns = []
    for mount in own.machine.lidars:
        T = sensor_pose(own.machine, mount, links)
        seen = measured(
            replace(alike, elevations=mount.elevations), T, boxes, people, rng, part=part
        )
        turns.append(Turn(mount.name, T, seen.points.astype(np.float32), seen.hit))
    return tuple(turns)
