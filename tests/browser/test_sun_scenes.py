"""The other scenes of Sun 2020 on the real page.

Apart from the first one: two sites at once are too much for two cores.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from live import all_valid, backend
from watched import SIZES, Watch

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]

# Site -> the machine that avoids, whether its base is in Sun's warning zone, d of Eq. (3).
SCENES = {
    "sun2020-driving": ("b", False, 4.013),  # Fig. 6, left: B drives far from A
    "sun2020-experiment": ("b", False, 3.376),  # Figs. 17-23: Table 6
}


@pytest.mark.parametrize("site", SCENES)
def test_the_other_scenes_show_their_figures(site: str, watch: Watch, artifacts: Path) -> None:
    own, in_zone, d = SCENES[site]
    with backend("demo", "--site", site) as station:
        station.wait_for(all_valid)
        watched = watch(f"{station.url}/?images=sun", SIZES[0])
        watched.page.keyboard.press("2")
        watched.until(f"JSON.parse(document.getElementById('plan').dataset.state).own === '{own}'")
        snapshot = station.wait_for(all_valid)
        machine = snapshot["machines"][own]
        assert machine["reach"] == pytest.approx(d, abs=0.03)
        image = watched.page.evaluate(
            "[...window.cockpit.state.images.values()].find(i => i.header.own === 'b')?.header"
        )
        if image is not None:
            assert image["current"]["in_zone"] is in_zone
        time.sleep(1.0)
        watched.page.screenshot(path=artifacts / f"{site}.png")
        assert watched.errors == []
