"""A manoeuvre's document as a trajectory to follow: arm, tracks and base, and what it counts on."""

from __future__ import annotations

import math

import numpy as np

from backend.collision.closest import closest_pairs
from backend.control.climb import TOUCHING, Climb, Phase
from backend.control.follow import TOLERANCE, Trajectory
from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_live import LiveSurmount
from backend.documents.surmount_side import base_poses
from backend.errors import InputError
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import Machine
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import rz
from backend.spatial.types import Array
from backend.surmount.bearing import Ledge, bearing, margins

UNIT = 1.6
"""A machine with tracks this long may be off its way by TOLERANCE, others in proportion [m]."""
INSTANTS = 150
"""At which the parts that must not touch are held against the step."""
ENOUGH = 1.0
"""Farther from the step than this a part is not measured exactly [m]."""
GIVEN = "step"
"""What a step is called that was given by numbers."""


def trajectory_of(machine: Machine, live: LiveSurmount, document: SurmountDocument) -> Trajectory:
    """Of a document that is ok. Raises InputError for a manoeuvre that leaves what bears it."""
    times, q = np.array(document.time), np.array(document.joints)
    base = base_poses(np.array(document.base))
    ledge = ledge_of(live)
    support = bearing(machine, q, base, ledge)
    margin = margins(machine, live.asked.payload, q, base, support)
    phases = tuple(Phase(one.name, one.start, one.end) for one in document.phases)
    if not phases:
        phases = (Phase("surmounting", 0.0, float(times[-1])),)
    k = int(np.argmin(margin))
    if not margin[k] > 0.0:
        raise InputError(
            f"its centre of mass leaves what bears it by {max(-margin[k], 0.0):.2f} m "
            f"at {times[k]:.1f} s."
        )
    off, turned = TOLERANCE
    return Trajectory(
        times=times,
        joints=q,
        rates=np.array(document.joint_velocities),
        tracks=np.array(document.tracks),
        base=base,
        tolerance=(off * machine.tracks.length / UNIT, turned),
        climb=Climb(
            obstacles=(live.step.name or GIVEN,),
            phases=phases,
            support=support,
            margin=margin,
            touching=TOUCHING,
            clearance=max(clearance(machine, q, base, ledge), 0.0),
        ),
    )


def ledge_of(live: LiveSurmount) -> Ledge:
    """The step as the live task describes it, from where the machine stood for it."""
    T, step = live.T_site_root, live.step
    yaw = math.atan2(float(T[1, 0]), float(T[0, 0])) - step.angle
    way = np.array([math.cos(yaw), math.sin(yaw)])
    ground = float(T[2, 3])
    return Ledge(T[:2, 3] + step.distance * way, way, ground, ground + step.height, step.depth)


def clearance(machine: Machine, q: Array, T_site_root: Array, ledge: Ledge) -> float:
    """The least distance of parts that must not touch to the higher ground beside the edge, at most
    ENOUGH [m].
    """
    kept = np.array([part not in TOUCHING for part in machine.body_parts])
    wide = 4.0 * machine.max_reach
    high = box_of(ledge, wide)
    rows = np.unique(np.linspace(0, len(q) - 1, min(INSTANTS, len(q))).round().astype(int))
    least = ENOUGH
    for one in link_poses(machine, q[rows], T_site_root[rows]):
        found = closest_pairs(body_boxes(machine, one).take(kept), high)
        least = min(least, float(found.distance[0]))
    return least


def box_of(ledge: Ledge, wide: float) -> Boxes:
    """The higher side of a step, as a box as wide and deep as that at most [m]."""
    up = ledge.behind > ledge.before
    deep = min(ledge.depth, wide) if up else wide
    low, high = sorted((ledge.before, ledge.behind))
    middle = ledge.edge + (0.5 if up else -0.5) * deep * ledge.way
    R = rz(math.atan2(float(ledge.way[1]), float(ledge.way[0])))
    half = np.array([[0.5 * deep, wide, 0.5 * (high - low)]])
    return Boxes(np.array([[*middle, 0.5 * (low + high)]]), R[None], half)
