"""What campaigns of faults share: both simulated machines, one of them driven, and figures."""

from __future__ import annotations

import contextlib
import os
import statistics
import time
from collections.abc import Iterator

from live import end, start
from operators import Operator
from wiretap import Wiretap

SITE = "demo"
TIMES = int(os.environ.get("FAULTS", "100"))


def show(what: str, expected: str, measured: str) -> None:
    print(f"  {what:44} expected {expected:22} measured {measured}", flush=True)


def spread(seconds: list[float]) -> str:
    """In milliseconds."""
    ordered = sorted(seconds)
    p99 = ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))]
    middle = statistics.median(ordered)
    return f"p50 {1e3 * middle:.0f}, p99 {1e3 * p99:.0f}, max {1e3 * ordered[-1]:.0f} ms"


@contextlib.contextmanager
def machines(*endpoints: str) -> Iterator[None]:
    """Both simulated machines, connected to every endpoint."""
    connected = [word for endpoint in endpoints for word in ("--connect", endpoint)]
    with contextlib.ExitStack() as running:
        for name in ("left", "right"):
            running.callback(end, start("sim", "--site", SITE, "--machine", name, *connected))
        yield


def lever(operator: Operator) -> float:
    """Of the boom: towards the middle of its travel, so that it never ends."""
    return 0.4 if operator.joints("left")["boom"] > 0.6 else -0.4


def moving(operator: Operator, tap: Wiretap) -> None:
    """Until a command of from now on moves the machine, whatever was last said before."""
    begun = time.monotonic()

    def going() -> bool:
        newest = tap.commands[-1] if tap.commands else None
        commanded = newest is not None and newest.arrival > begun and bool(newest.velocity.any())
        return commanded and tap.statuses[-1].mode == "remote" and tap.speed() > 0.05

    operator.move(enable=False, right_y=0.0)
    operator.drive("left", going, right_y=lever(operator))
