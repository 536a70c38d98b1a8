"""The scenes of Sun 2020 on the real page: every panel draws what the snapshot says."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from live import Backend, all_valid, backend
from watched import SIZES, Watch

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]


@pytest.fixture(scope="module")
def still() -> Iterator[Backend]:
    """Sun's simulation scene: both machines hold still, so that numbers can be compared."""
    with backend("demo", "--site", "sun2020-simulation") as running:
        running.wait_for(all_valid)
        yield running


def test_each_panel_draws_what_the_snapshot_says(
    still: Backend, watch: Watch, artifacts: Path
) -> None:
    watched = watch(f"{still.url}/?images=sun", SIZES[0])
    page = watched.page
    page.keyboard.press("2")  # B is the machine that must avoid A, as in the paper
    watched.until(
        "JSON.parse(document.getElementById('reach').dataset.state).own === 'b'"
        " && JSON.parse(document.getElementById('slice-0').dataset.state).own === 'b'"
    )
    deadline = time.monotonic() + 60.0
    while True:
        # On a busy computer a snapshot may find a stream stale: that is another test's matter.
        drawn, snapshot = watched.both()
        valid = all(m["validity"] == "VALID" for m in snapshot["machines"].values())
        plan, reach = drawn["plan"]["state"], drawn["reach"]["state"]
        drawn_all = plan["nearest"] is not None and drawn["trends"]["state"]["points"] > 3
        if valid and drawn_all and not reach["hollow"] and snapshot["alarms"]:
            break
        assert time.monotonic() < deadline, "never all valid and drawn"
        time.sleep(0.2)
    machine = snapshot["machines"]["b"]
    np.testing.assert_allclose(plan["base"], machine["position"][:2], atol=0.1)
    assert plan["machines"] == 2
    assert plan["zone"] > 8
    nearest = snapshot["pairs"][0]["distance"]
    assert plan["nearest"] == pytest.approx(max(nearest, 0.0), abs=0.1) or nearest < 0
    # Sun 2020, Section 4.2, third case: theta = 162 deg, d = 4.01 m, the star is in the obstacle.
    swing = math.degrees(machine["joints"]["swing"])
    assert (reach["star"][0] - swing + 180) % 360 - 180 == pytest.approx(0.0, abs=1.0)
    assert reach["star"][1] == pytest.approx(4.013, abs=0.02)
    assert reach["collides"] is True
    assert reach["blocked"] > 0
    angles = {k: math.degrees(v) for k, v in machine["joints"].items()}
    for index, (x, y) in enumerate((("boom", "stick"), ("boom", "bucket"), ("stick", "bucket"))):
        state = drawn[f"slice-{index}"]["state"]
        assert state["kind"] == "projection"
        assert state["cells"] > 100
        star = np.rad2deg(state["star"])
        np.testing.assert_allclose(star, [angles[x], angles[y]], atol=1.0)
    bars = drawn["bars"]["state"]["joints"]
    for role, value in angles.items():
        assert (bars[role] - value + 180) % 360 - 180 == pytest.approx(0.0, abs=1.0)
    limits = drawn["limits"]["state"]
    own = next(c for c in snapshot["concerns"] if c["machine"] == "b")
    assert limits["level"] == own["level"]
    assert all(math.isfinite(float(canvas["age"])) for canvas in drawn.values())
    watched.until(
        "document.getElementById('alarm-line').textContent"
        ".startsWith(window.cockpit.state.snapshot.alarms[0]?.level)"
    )
    assert page.inner_text("#mode") == "DEMO"
    page.screenshot(path=artifacts / "sun2020-simulation.png")
    assert watched.errors == []
