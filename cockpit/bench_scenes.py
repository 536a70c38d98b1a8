"""The scenes of `bench_cspace`: an arm or a machine beside a partner in its reach."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

LENGTHS = (1.72, 0.951, 0.70)
"""Links of the arm [m] (Sun 2020)."""
_HALF_WIDTHS = (0.12, 0.10, 0.25)
_HALF_HEIGHTS = (0.12, 0.10, 0.15)

# Tracks, upper body, cab, boom, stick and bucket: centres, half sizes [m], pitch [rad].
_PARTNER = (
    ((0.0, 0.5, 0.25), (0.8, 0.15, 0.25), 0.0),
    ((0.0, -0.5, 0.25), (0.8, 0.15, 0.25), 0.0),
    ((0.0, 0.0, 0.85), (0.8, 0.7, 0.35), 0.0),
    ((0.1, 0.3, 1.5), (0.6, 0.35, 0.6), 0.0),
    ((1.2, 0.0, 1.6), (0.7, 0.12, 0.15), -0.3),
    ((2.1, 0.0, 1.3), (0.6, 0.10, 0.12), 0.7),
    ((2.4, 0.0, 0.6), (0.2, 0.3, 0.35), 1.2),
)


@dataclass(frozen=True)
class BenchScene:
    """partner: boxes in the machine's root frame."""

    name: str
    machine: Machine
    partner: Boxes


def arm_scene() -> BenchScene:
    """Three boxes on a swing against seven, about 4 m away."""
    mini = load_machine("mini")
    links = tuple(next(i for i, k in enumerate(mini.links) if k.joint == j) for j in (1, 2, 3))
    half = np.stack([np.array(LENGTHS) / 2.0, _HALF_WIDTHS, _HALF_HEIGHTS], axis=1)
    bodies = Boxes(half * [1.0, 0.0, 0.0], np.tile(np.eye(3), (3, 1, 1)), half)
    arm = replace(
        mini,
        bodies=bodies,
        body_links=links,
        body_names=("boom/0", "stick/0", "bucket/0"),
        self_pairs=(),
    )
    T = transform.make(rotation.from_attitude(2.6, 0.1, -0.08), np.array([3.9, 1.0, 0.0]))
    centers, sizes, pitches = zip(*_PARTNER, strict=True)
    turns = rotation.about_axis(np.array([0.0, 1.0, 0.0]), np.array(pitches))
    return BenchScene("arm x 7", arm, Boxes(np.array(centers), turns, np.array(sizes)).moved(T))


def mini_scene() -> BenchScene:
    """Two minis whose arms reach each other."""
    mini = load_machine("mini")
    standing = body_boxes(mini, link_poses(mini, np.array([0.3, 0.6, -1.2, -0.4])))
    T = transform.make(rotation.from_attitude(2.9, 0.05, -0.04), np.array([4.6, 0.8, 0.0]))
    return BenchScene(f"mini x {len(standing)}", mini, standing.moved(T))
