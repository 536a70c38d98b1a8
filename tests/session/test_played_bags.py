"""Bags as a ROS 2 machine writes them, through the player's own entrance: no adapter between."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from test_bags import STORAGES, messages, write_bag

from backend.errors import InputError
from backend.fusion.pose import Validity
from backend.shell.session.evaluate import evaluate
from backend.shell.session.tracks import sources
from cockpit.playback import see


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_is_seen_on_a_site(
    tmp_path: Path, storage: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    bag = write_bag(tmp_path / "bag", messages("/left", 100) + messages("/right", 100), storage)  # type: ignore[arg-type]
    seen = see(bag, "demo")
    assert sources(seen.session, seen.topics) == ("evaluated",)
    last = [snapshot for _, snapshot in evaluate(seen.session, seen.topics, seen.config)][-1]
    for name in ("left", "right"):
        pose = last.machines[name].pose
        assert pose.validity is Validity.VALID
        assert pose.joints[0] == pytest.approx(9.9, abs=0.2)  # 0.1 rad a message, the last is 9.9
        assert pose.joints[1:3] == pytest.approx([0.5, -1.0], abs=1e-6)
    assert not math.isnan(last.pairs[0].distance)
    again = see(bag, "demo")
    assert again.session.path == seen.session.path


def test_a_bag_needs_a_site(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", messages("/left", 20))
    with pytest.raises(InputError, match="--site is needed"):
        see(bag, None)
