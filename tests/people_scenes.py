"""Two people who walk and one object beside a swinging machine, as a LiDAR on it sees them.

Scenes of the kind of Rasul 2021, Section 5: what is detected in each scan comes from points. Who
walks turns by 90 degrees or more every 12 to 18 s, and sooner where the ring of 3 to 15 m about the
machine ends: about four turns in each scene of 45 s. Nobody can foretell when; for about 1.3 s
around each of them every prediction is wrong, and how often people turn says how good any can be.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.perception.detect import Objects, detect
from backend.shell.sim.lidar import Lidar, Person, scan
from backend.shell.sim.people import Walk, walk
from backend.spatial.rotation import rz
from backend.spatial.transform import make
from backend.tracking.records import PX, PY, PZ, Detections

MINI = load_machine("mini")
PERIOD = 0.1  # of the LiDAR [s]
MOUNT = np.array([-0.3, 0.0, 2.6])  # on the upper body, over the cab [m]
MEASURED, NOISE = (PX, PY, PZ), np.array([0.06, 0.06, 0.15])
LEGS = (12.0, 18.0)
"""Time between two turns [s]."""
RING = (3.0, 15.0)
"""Within which people walk [m]."""
_POSTURE = 0.5 * (np.clip(MINI.lower, -1.0, 1.0) + np.clip(MINI.upper, -1.0, 1.0))


class Scene(NamedTuple):
    """walks: of both people; post: (2,) where the object stands; scans: of all, in time."""

    walks: tuple[Walk, ...]
    post: np.ndarray
    scans: tuple[Detections, ...]


def scene(seed: int, seconds: float = 45.0) -> Scene:
    """The machine swings to and fro by 0.8 rad; people turn by 90 to 180 degrees, or stop."""
    rng = np.random.default_rng(seed)
    walks = tuple(
        walk(rng, seconds + 2.0, speeds=(0.7, 1.3), legs=LEGS, around=RING) for _ in range(2)
    )
    at = rng.uniform(-np.pi, np.pi)
    post = 7.0 * np.array([np.cos(at), np.sin(at)])
    scans = []
    for k in range(round(seconds / PERIOD)):
        t = k * PERIOD
        objects = _seen(walks, post, t, rng)
        scans.append(Detections(t, objects.center, MEASURED, NOISE))
    return Scene(walks, post, tuple(scans))


def _seen(walks: tuple[Walk, ...], post: np.ndarray, t: float, rng: np.random.Generator) -> Objects:
    q = _POSTURE.copy()
    q[0] = 0.8 * np.sin(0.5 * t)
    bodies = body_boxes(MINI, link_poses(MINI, q))
    turn = rz(q[0])
    T = make(turn, turn @ MOUNT)
    everybody = (*(Person(w.at(t)) for w in walks), Person(post, radius=0.3, height=1.2))
    points = scan(Lidar(), T, bodies, everybody, rng).points
    return detect(points, T[:3, 3], bodies).objects
