"""Machines for the tests, and a small URDF to break."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from backend.machine.load import load_machine
from backend.machine.model import Machine

TINY = """<robot name="tiny">
  <link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="2 1.5 0.4"/></geometry>
  </collision></link>
  <link name="house"><inertial><origin xyz="0.1 0 0.2"/><mass value="900"/>
    <inertia ixx="90" ixy="0" ixz="0" iyy="80" iyz="0" izz="70"/></inertial>
    <collision><origin xyz="0 0 0.4"/><geometry><box size="1.5 1 0.6"/></geometry></collision>
  </link>
  <link name="boom"><collision><origin xyz="1 0 0" rpy="0 1.5707963 0"/>
    <geometry><cylinder radius="0.1" length="2"/></geometry></collision></link>
  <link name="stick"><collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.2 0.2"/></geometry>
  </collision></link>
  <link name="bucket"><collision><origin xyz="0.25 0 0"/><geometry>
  <sphere radius="0.25"/></geometry>
  </collision></link>
  <joint name="swing_joint" type="continuous"><parent link="base"/><child link="house"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 0 1"/></joint>
  <joint name="boom_joint" type="revolute"><parent link="house"/><child link="boom"/>
    <origin xyz="0.3 0.05 0.4"/><axis xyz="0 1 0"/>
    <limit lower="-1.2" upper="0.6" effort="1" velocity="0.4"/></joint>
  <joint name="arm_joint" type="revolute"><parent link="boom"/><child link="stick"/>
    <origin xyz="2 0.02 0"/><axis xyz="0 1 0"/>
    <limit lower="0.3" upper="2.6" effort="1" velocity="0.6"/></joint>
  <joint name="bucket_joint" type="revolute"><parent link="stick"/><child link="bucket"/>
    <origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-0.5" upper="2.2" effort="1" velocity="0.9"/></joint>
</robot>
"""


@pytest.fixture
def tiny(tmp_path: Path) -> Callable[..., Path]:
    """Writes TINY, with some text replaced, and gives its path."""

    def write(*changes: tuple[str, str], name: str = "tiny.urdf") -> Path:
        text = TINY
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture(scope="session")
def mini() -> Machine:
    return load_machine("mini")


@pytest.fixture(scope="session")
def ex13() -> Machine:
    return load_machine("ex13")


@pytest.fixture(scope="session")
def zx200(shared_data: Path) -> Machine:
    """The ZX200 with the boxes of its shipped sidecar."""
    return load_machine("zx200.xacro", base_folder=shared_data / "zx200")


@pytest.fixture(params=["mini", "ex13", "zx200"])
def machine(request: pytest.FixtureRequest) -> Machine:
    loaded: Machine = request.getfixturevalue(request.param)
    return loaded


@pytest.fixture(scope="session")
def draw() -> Callable[[Machine, np.random.Generator, int], np.ndarray]:
    """Random joint values (count, n) within the limits."""

    def within(machine: Machine, random: np.random.Generator, count: int) -> np.ndarray:
        low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
        high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
        return random.uniform(low, high, (count, len(low)))

    return within
