"""A machine between two poses: on the way, by the short way round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_step import config, inputs  # noqa: F401

from backend.pipeline.config import Config
from backend.pipeline.place import between
from backend.pipeline.step import initial, step


def test_halfway_is_halfway_and_outside_is_the_end(config: Config) -> None:  # noqa: F811
    machine = config.machines["a"]
    _, snapshot = step(initial(config), inputs(config, 100.0), 100.0, config)
    first = replace(snapshot.machines["a"].pose, time=10.0, yaw=np.pi - 0.1)
    then = replace(
        first,
        time=10.2,
        yaw=-np.pi + 0.1,
        position=first.position + np.array([1.0, 0.0, 0.0]),
        joints=first.joints + np.array([0.4, 0.2, 0.0, 0.0]),
    )
    middle = between(machine, first, then, 10.1)
    right = replace(
        first,
        yaw=np.pi,
        position=first.position + np.array([0.5, 0.0, 0.0]),
        joints=first.joints + np.array([0.2, 0.1, 0.0, 0.0]),
    )
    np.testing.assert_allclose(middle.link_poses, between(machine, right, right, 0.0).link_poses)
    for at, pose in ((9.0, first), (10.0, first), (10.2, then), (11.0, then)):
        end = between(machine, pose, pose, 0.0)
        found = between(machine, first, then, at)
        np.testing.assert_allclose(found.link_poses, end.link_poses, atol=1e-12)


@pytest.mark.parametrize("same", [10.0, 9.0])
def test_two_poses_of_one_time_are_the_first(config: Config, same: float) -> None:  # noqa: F811
    machine = config.machines["a"]
    _, snapshot = step(initial(config), inputs(config, 100.0), 100.0, config)
    pose = replace(snapshot.machines["a"].pose, time=10.0)
    other = replace(pose, time=same, yaw=1.0)
    found = between(machine, pose, other, 10.0)
    np.testing.assert_allclose(found.link_poses, between(machine, pose, pose, 0.0).link_poses)
