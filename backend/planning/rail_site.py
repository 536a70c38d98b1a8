"""The two use cases of Mäkinen 2021, Chapter 4: a pole beside the track, and ballast removal.

The thesis gives the thresholds, the half-width 1.845 m of the adjacent track's envelope, the 25 kV
line's 1 m below and 3 m beside, and pictures. Assumed here: tracks 4.5 m apart, an envelope from
1 m below the top of rail (nothing passes underneath) to 4.7 m above, contact wires 6.15 m above the
top of rail (both as is usual in Finland), a pole 0.4 m square and 7.5 m high, and the postures.

Frame: x along the track that the machine stands on, y to the left, z up from the top of rail; the
machine's root is the origin. The adjacent track is at negative y, as in the thesis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backend.machine.model import Machine
from backend.machine.pose import pose_error, tool_pose
from backend.planning.proximity import Limits, posed
from backend.planning.records import Wish
from backend.planning.task_path import JointPath
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

HALF_WIDTH = 1.845  # of the kinematic envelope, Section 2.1.2 [m]
BELOW, BESIDE = 1.0, 3.0  # of the 25 kV line, Section 2.1.2 [m]
TRACKS_APART, ENVELOPE_HEIGHT, ENVELOPE_DEPTH = 4.5, 4.7, 1.0  # assumed [m]
WIRE_HEIGHT, LENGTH = 6.15, 40.0  # assumed [m]

POLE_START_DEG = (15.0, 25.0, -88.0, -28.0, 0.0, 0.0)
POLE_SPEED, POLE_GO, POLE_BACK = 0.6, 1.0, 5.0  # [m/s]; when it goes and turns back [s], Fig. 4.3

BALLAST_DEG = (
    (-10.0, 30.0, -85.0, -35.0, 0.0, 0.0),  # Fig. 4.5: initial pose
    (-24.0, -6.0, -55.0, -40.0, 0.0, 0.0),  # start of digging
    (-28.0, 2.0, -100.0, -25.0, 0.0, 0.0),  # bucket drawn in
    (-34.0, 40.0, -122.0, -8.0, 0.0, 0.0),  # Fig. 4.6: lifted past the road-rail interface
    (-40.0, 56.0, -128.0, -8.0, 0.0, 0.0),
    (-165.0, 52.0, -112.0, -20.0, 0.0, 0.0),  # swung along the adjacent track to the wagon
    (-180.0, 36.0, -85.0, -60.0, 0.0, 0.0),  # Fig. 4.7: emptied behind
)
BALLAST_SECONDS = (4.0, 4.0, 4.0, 3.0, 8.0, 4.0)


def pole_limits() -> Limits:
    """The pole alone, as in Figs. 4.2-4.4."""
    return Limits(("pole",), _boxes([((4.6, 3.2, 2.75), (0.2, 0.2, 4.75))]))


def ballast_limits() -> Limits:
    """The adjacent track's envelope, both overhead lines' volumes, and no pole, as in Fig. 4.5."""
    middle = 0.5 * (ENVELOPE_HEIGHT - ENVELOPE_DEPTH)
    half = 0.5 * (ENVELOPE_HEIGHT + ENVELOPE_DEPTH)
    line = (0.5 * LENGTH, BESIDE, BELOW)
    return Limits(
        ("adjacent track", "overhead line", "adjacent overhead line"),
        _boxes(
            [
                ((0.0, -TRACKS_APART, middle), (0.5 * LENGTH, HALF_WIDTH, half)),
                ((0.0, 0.0, WIRE_HEIGHT), line),
                ((0.0, -TRACKS_APART, WIRE_HEIGHT), line),
            ]
        ),
    )


def pole_wish(machine: Machine) -> tuple[Array, Callable[[float, Array], Wish]]:
    """(posture at the start (n,), wish by time and posture): the tool straight towards the pole's
    side of the track from POLE_GO on, back from POLE_BACK until it is where it began.
    """
    q_start = np.radians(POLE_START_DEG)
    T_start = tool_pose(machine, posed(machine, q_start))

    def wish(t: float, q: Array) -> Wish:
        T = tool_pose(machine, posed(machine, q))
        back = pose_error(T_start, T)
        twist = np.zeros(6)
        twist[3:] = back[3:]  # the tool keeps its attitude
        if POLE_GO <= t < POLE_BACK:
            twist[1] = POLE_SPEED
        elif t >= POLE_BACK:
            twist[:3] = back[:3] * min(2.0, POLE_SPEED / max(float(np.linalg.norm(back[:3])), 1e-9))
        return Wish(twist=twist)

    return q_start, wish


def ballast_path() -> JointPath:
    """From the initial pose to the wagon behind; reaches into the adjacent track on its way."""
    return JointPath(np.radians(BALLAST_DEG), np.array(BALLAST_SECONDS))


def _boxes(centers_and_halves: list[tuple[tuple[float, ...], tuple[float, ...]]]) -> Boxes:
    centers, halves = (np.array(v) for v in zip(*centers_and_halves, strict=True))
    return Boxes(centers, np.tile(np.eye(3), (len(centers), 1, 1)), halves)
