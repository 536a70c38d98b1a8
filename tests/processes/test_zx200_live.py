"""A real machine's description, unchanged, as both machines of a site."""

from __future__ import annotations

from pathlib import Path

import pytest
from live import all_valid, backend

from backend.machine.load import load_machine

pytestmark = [pytest.mark.processes, pytest.mark.timeout(1200)]

SITE = """
name = "two-zx200"
title = "Two ZX200"
[frame]
epsg = 32652
origin = [308600.0, 4129950.0, 0.0]
"""
MACHINE = """
[[machine]]
name = "{name}"
model = "{model}"
[machine.start]
position = [{east}, 4129950.0, 0.0]
yaw_deg = {yaw}
joints_deg = {{ swing = 0.0, boom = -35.0, stick = 90.0, bucket = 50.0 }}
"""


def test_the_demo_runs_on_it(shared_data: Path, tmp_path: Path) -> None:
    model = shared_data / "zx200" / "zx200.xacro"
    site = tmp_path / "site.toml"
    load_machine(str(model))  # its bodies are fitted to its meshes once and kept
    site.write_text(
        SITE
        + MACHINE.format(name="west", model=model, east=308600.0, yaw=0.0)
        + MACHINE.format(name="east", model=model, east=308622.0, yaw=180.0)
    )
    with backend("demo", "--site", str(site)) as station:
        snapshot = station.wait_for(all_valid, timeout=120.0)
        described = station.get("/api/machines")
        assert {m["bodies"] for m in described.values()} <= set(range(20, 61))
        assert snapshot["pairs"][0]["distance"] is not None
        assert snapshot["machines"]["west"]["reach"] > 4.0
        assert snapshot["machines"]["east"]["fix"] == "RTK fixed"
