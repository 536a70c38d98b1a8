"""Input at the rates of the paper's hardware, made up front, for timing the pipeline alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from backend.fusion.samples import (
    AttitudeSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    Sample,
)
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs
from backend.site.site import Site
from backend.spatial.types import Array

CYCLE = 0.02
DELAY = 0.06


def cycles(site: Site, config: Config, count: int) -> Iterator[tuple[float, Inputs]]:
    """(now, inputs) of `count` cycles at 50 Hz: joints at 200 Hz, position and heading at 20 Hz.

    The machines stand where the site file puts them, and swing and reach slowly.
    """
    rng = np.random.default_rng(0)
    level = np.array([1.0, 0.0, 0.0, 0.0])
    for cycle in range(count):
        now = 1000.0 + cycle * CYCLE
        samples: list[Sample] = []
        for machine in site.machines:
            model = config.machines[machine.name]
            assert machine.start is not None
            base = site.frame.from_projected(np.array(machine.start.position))
            roles = tuple(joint.role for joint in model.joints)
            for k in range(4):
                stamp = now - DELAY + k * 0.005
                q, rate = _motion(machine.start.joints_deg, roles, stamp)
                samples.append(JointSample(machine.name, stamp, now, roles, q, rate))
            if cycle % 3 == 0:
                antenna = base + rng.normal(scale=0.005, size=3)
                latitude, longitude, height = site.frame.to_geodetic(antenna)
                samples += [
                    FixSample(
                        *(machine.name, now - DELAY, now, latitude, longitude, height),
                        np.eye(3) * 4e-4,
                        Fix.RTK_FIXED,
                    ),
                    HeadingSample(
                        machine.name, now - DELAY, now, np.deg2rad(machine.start.yaw_deg), 1e-6
                    ),
                    AttitudeSample(
                        *(machine.name, now - DELAY, now, "base", level, np.zeros(3)), 1e-6
                    ),
                ]
        yield now, Inputs(tuple(samples))


def _motion(
    start_deg: dict[str, float], roles: tuple[str, ...], stamp: float
) -> tuple[Array, Array]:
    """Joint values [rad] and rates [rad/s] of a slow sine about the starting posture."""
    middle = np.deg2rad([start_deg.get(role, 0.0) for role in roles])
    amplitude, speed = 0.1, 2.0
    return (
        middle + amplitude * np.sin(speed * stamp),
        np.full(len(roles), amplitude * speed * np.cos(speed * stamp)),
    )
