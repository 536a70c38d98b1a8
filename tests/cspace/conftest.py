"""The postures of Sun 2020, Tables 1-6, read from the shipped site files."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from backend.cspace.sun import SunPose

LENGTHS = (1.0, 1.72, 0.951, 0.7)
REACH = sum(LENGTHS)


def poses_of(repository: Path, site: str) -> tuple[SunPose, SunPose]:
    """A and B as a site file starts them: level and pitched bases, swing on the yaw."""
    text = (repository / "scenes" / "sites" / f"{site}.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    poses = []
    for machine in table["machine"]:
        start = machine["start"]
        joints = {role: np.radians(value) for role, value in start["joints_deg"].items()}
        swing = joints.pop("swing")
        position = np.array(start["position"]) - table["frame"]["origin"]
        yaw, pitch = np.radians([start["yaw_deg"], start["pitch_deg"]])
        poses.append(SunPose(position[:2], yaw + swing, pitch, lengths=np.array(LENGTHS), **joints))
    return poses[0], poses[1]


@pytest.fixture(scope="session")
def simulation(repository: Path) -> tuple[SunPose, SunPose]:
    """Tables 1 and 3, B in the third case of Fig. 9."""
    return poses_of(repository, "sun2020-simulation")


@pytest.fixture(scope="session")
def driving(repository: Path) -> tuple[SunPose, SunPose]:
    """Tables 1 and 2."""
    return poses_of(repository, "sun2020-driving")


@pytest.fixture(scope="session")
def experiment(repository: Path) -> tuple[SunPose, SunPose]:
    """Tables 4 and 6."""
    return poses_of(repository, "sun2020-experiment")


@pytest.fixture(scope="session")
def straight() -> Callable[..., SunPose]:
    """A level arm of projected length d: boom, stick and bucket in one line, l1 takes the rest."""

    def make(x: float, y: float, yaw: float, d: float) -> SunPose:
        lengths = np.array([d - 3.0, 1.5, 1.0, 0.5])
        return SunPose(np.array([x, y]), yaw, 0.0, 0.0, 0.0, 0.0, lengths)

    return make
