"""What a machine stands on is its ground."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from backend.machine.kinematics import link_poses
from backend.machine.load import load_machine
from backend.pipeline.records import MachineState
from backend.pipeline.stood_on import but_ground
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

MINI = load_machine("mini")
SITE = SiteBodies(
    Boxes(
        np.array([[5.0, 0.0, 0.15], [20.0, 0.0, 1.0], [5.0, 0.0, 0.15]]),
        np.broadcast_to(np.eye(3), (3, 3, 3)).copy(),
        np.array([[4.0, 2.0, 0.15], [0.2, 0.2, 1.0], [4.0, 2.0, 0.15]]),
    ),
    ("step", "post", "gauge:T1/0"),
)


def placed(x: float, z: float, pitch: float = 0.0) -> MachineState:
    T = transform.make(rotation.from_attitude(0.3, pitch), np.array([x, 0.0, z]))
    body = SimpleNamespace(link_poses=link_poses(MINI, np.zeros(4), T))
    return cast(Any, SimpleNamespace(body=body))


@pytest.mark.parametrize(
    ("x", "z", "pitch", "stands"),
    [
        (5.0, 0.3, 0.0, True),
        (5.0, 0.34, 0.03, True),
        (5.0, 0.0, 0.0, False),  # inside of it
        (0.5, 0.3, 0.0, False),  # before its edge
        (5.0, 0.6, 0.0, False),  # over it
        (5.0, 0.3, 0.2, False),  # leaning on it
    ],
)
def test_the_top_under_the_tracks_is_ground(x: float, z: float, pitch: float, stands: bool) -> None:
    left = but_ground(SITE, placed(x, z, pitch))
    assert ("step" in left.names) is not stands
    assert {"post", "gauge:T1/0"} <= set(left.names)
    assert (left is SITE) is not stands
    # The same object again: what is prepared for it is kept.
    assert but_ground(SITE, placed(x, z, pitch)) is left


def test_a_machine_without_a_pose_stands_on_nothing() -> None:
    assert but_ground(SITE, cast(Any, SimpleNamespace(body=None))) is SITE
