"""People over Zenoh: a simulated machine's LiDAR, its clouds, and what the backend says of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from live import Backend, end, serve, start

from backend.shell.sim.walkers import people_at
from backend.site.site import load_site

pytestmark = pytest.mark.processes


def people_of(snapshot: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = snapshot["people"]
    return found


def concern(snapshot: dict[str, Any]) -> dict[str, Any]:
    return next(c for c in snapshot["concerns"] if c["name"] == "people" and c["machine"] == "left")


def looked_at(station: Backend, enough: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """What detection makes of the points, once it is enough."""
    deadline = time.monotonic() + 30.0
    told: dict[str, Any] = {}
    while time.monotonic() < deadline:
        told = station.get("/api/stages")
        if enough(told):
            return told
        time.sleep(0.2)
    raise AssertionError(f"never: {told}")


def test_walkers_are_followed_where_they_are_and_unknown_without_their_lidar() -> None:
    site = load_site("people")
    began = time.time()
    with serve("people", "--no-record") as station:
        arguments = ("--connect", station.endpoint, "--start-at", str(began))
        machine = start("sim", "--site", "people", "--machine", "left", *arguments)
        try:
            station.wait_for(
                lambda s: sum(t["status"] == "confirmed" for t in people_of(s)["tracks"]) >= 2, 90.0
            )
            near: list[float] = []
            for _ in range(40):
                snapshot = station.get("/api/snapshot")
                now = time.time() - began
                places = np.array([t["position"][:2] for t in people_of(snapshot)["tracks"]])
                if len(places):
                    near += [
                        float(np.linalg.norm(places - person.place, axis=1).min())
                        for person in people_at(site, now)
                    ]
                time.sleep(0.1)
            assert len(near) > 40
            # Walls of time between truth and answer, and who is hidden: the middle of all counts.
            assert np.median(near) < 0.5
            assert people_of(snapshot)["sensors"][0]["machine"] == "left"
            assert snapshot["backend"]["people"]["rate"] > 0.0
            stages = looked_at(station, lambda told: told["counts"] is not None)
            assert stages["drawn"] == min(stages["points"], 8_000)
            assert sum(stages["counts"].values()) == stages["points"] > 10_000
            assert min(stages["counts"][name] for name in ("ground", "machine", "object")) > 0
            assert stages["objects"] > 0
        finally:
            end(machine)
        silent = station.wait_for(lambda s: people_of(s)["reason"] != "")
        assert "no LiDAR data for" in people_of(silent)["reason"]
        assert concern(silent)["level"] == "UNKNOWN"
        assert people_of(silent)["tracks"]
        stages = looked_at(station, lambda told: told["counts"] is None)
        # The latter when the end took so long that nobody looked meanwhile.
        assert stages["reason"].startswith(("no scan for", "waiting for a scan"))
