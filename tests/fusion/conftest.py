"""Rigs of the shipped mini at Sun's site."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from backend.fusion.crs import SiteFrame
from backend.fusion.rig import Rig, make_rig
from backend.machine.load import load_machine
from backend.machine.model import Machine

SUN_ORIGIN = (308600.0, 4129950.0, 0.0)


@pytest.fixture(scope="session")
def mini() -> Machine:
    return load_machine("mini")


@pytest.fixture(scope="session")
def sun_frame() -> SiteFrame:
    return SiteFrame(32652, SUN_ORIGIN)


@pytest.fixture(scope="session")
def rig(mini: Machine, sun_frame: SiteFrame) -> Rig:
    return make_rig("left", mini, sun_frame)


@pytest.fixture
def varied(mini: Machine, sun_frame: SiteFrame) -> Callable[..., Rig]:
    """A rig of the mini with some of its description replaced."""

    def make(frame: SiteFrame = sun_frame, **changes: object) -> Rig:
        return make_rig("left", replace(mini, **changes), frame)  # type: ignore[arg-type]

    return make
