"""The backend killed while it drives a machine, again and again, nothing else running.

`FAULTS=10 pytest ...` makes a tenth of the default of 100.
"""

from __future__ import annotations

import signal
import time
import urllib.request

import pytest
from faults import SITE, TIMES, machines, moving, show, spread
from live import all_valid, serve
from operators import Operator
from wiretap import Wiretap

from backend.shell.link.session import with_port


@pytest.mark.timeout(7_200)
def test_kills_of_the_backend() -> None:
    endpoint, beside = (with_port("tcp/127.0.0.1:0") for _ in range(2))
    heard = "--no-record", "--connect", beside  # the tap hears commands, too
    stops, backs, rearmed = [], [], 0
    with Wiretap(beside, "left", listens=True) as tap, machines(endpoint, beside):
        for k in range(TIMES):
            begun = time.monotonic()
            with serve(SITE, *heard, endpoint=endpoint) as station:
                if k:
                    with urllib.request.urlopen(station.url, timeout=10) as answer:
                        assert answer.status == 200
                    backs.append(time.monotonic() - begun)
                station.wait_for(all_valid)
                operator = Operator(station)
                rearmed += operator.machine("left")["holder"] != ""
                rearmed += tap.speed() > 0.02 and tap.statuses[-1].mode == "remote"
                moving(operator, tap)
                time.sleep(0.2)
                killed = time.monotonic()
                station.process.send_signal(signal.SIGKILL)
                operator.close()
                while tap.stood(killed) is None:
                    assert time.monotonic() - killed < 5.0, "the machine goes on"
                    time.sleep(0.005)
                stops.append(tap.stood(killed) - killed)
                print(f"  kill {k}: stood after {1e3 * stops[-1]:.0f} ms", flush=True)
    show(f"{TIMES} kills of the backend → standstill", "<= 500 ms", spread(stops))
    show("page back", "<= 5 s", spread(backs))
    show("armed by itself", "0", str(rearmed))
    assert max(stops) <= 0.5
    assert max(backs) <= 5.0
    assert rearmed == 0
