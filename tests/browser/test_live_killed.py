"""A machine that is killed, seen by the operator.

In a file of its own: beside the site of another file, two cores are not enough.
"""

from __future__ import annotations

import signal

import pytest
from live import all_valid, serve, simulate, simulated
from watched import SIZES, Watch

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]


def test_a_killed_machine_is_stale_on_the_page_and_recovers(watch: Watch) -> None:
    site = "demo"
    with serve(site) as station, simulated(site, station.endpoint, "left", "right") as processes:
        station.wait_for(all_valid)
        watched = watch(station.url, SIZES[1])
        page = watched.page
        # Every snapshot that reaches the page is kept with what the page makes of it.
        page.evaluate(
            """() => { window.kept = []; const look = () => {
              const s = window.cockpit.state.snapshot;
              if (s && window.kept.at(-1)?.cycle !== s.cycle) window.kept.push({cycle: s.cycle,
                age: s.machines.right.ages.joints, validity: s.machines.right.validity});
              setTimeout(look, 5); }; look(); }"""
        )
        processes["right"].send_signal(signal.SIGKILL)
        watched.until("window.kept.at(-1).validity !== 'VALID'", 10.0)
        kept = page.evaluate("window.kept")
        assert all(k["validity"] != "VALID" for k in kept if k["age"] > 0.2)
        watched.until(
            "document.getElementById('alarm-line').textContent.startsWith('UNKNOWN · RIGHT')"
            " && JSON.parse(document.getElementById('plan').dataset.state).nearest === null"
            " && !document.getElementById('alarm').textContent.includes('CLEAR')"
        )
        processes["right"].wait()
        processes["right"] = simulate(site, "right", station.endpoint)
        watched.until("window.cockpit.state.snapshot.machines.right.validity === 'VALID'", 40.0)
        assert watched.errors == []
