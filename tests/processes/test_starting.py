"""What is loaded before a page can be seen, and what starts after it."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from pathlib import Path

from cockpit.starting import Starting

LATER = {
    *("numba", "scipy", "trimesh", "networkx", "viser", "fcl", "shapely"),
    *("zenoh", "pyarrow", "pandas", "matplotlib", "can", "xacro"),
}
"""Libraries that no page of a playback has to wait for."""


def test_a_playback_shows_its_page_before_it_loads_what_judges_and_draws(repository: Path) -> None:
    code = (
        "import json, sys; import cockpit.cli, cockpit.play; from pathlib import Path; "
        "cockpit.play.see(Path(sys.argv[1]), None); "
        "print(json.dumps([name for name in sys.modules if '.' not in name]))"
    )
    session = repository / "scenes" / "sessions" / "near-miss.mcap"
    done = subprocess.run(
        [sys.executable, "-c", code, str(session)], capture_output=True, text=True, check=True
    )
    assert not LATER & set(json.loads(done.stdout))


def test_steps_are_taken_in_order_and_a_failure_is_told() -> None:
    taken: list[str] = []

    def fail() -> None:
        raise OSError("no room")

    starting = Starting(
        (
            ("one", lambda: taken.append("one")),
            ("the scene", fail),
            ("three", lambda: taken.append("three")),
        )
    )
    assert not starting.done
    starting.start()
    starting.wait()
    assert starting.done
    assert taken == ["one", "three"]
    assert starting.failure == "the scene did not start: no room"
    starting.stop()


def test_after_stop_no_further_step_begins() -> None:
    taken: list[str] = []
    begun, go_on = threading.Event(), threading.Event()

    def long() -> None:
        begun.set()
        go_on.wait(30.0)
        taken.append("one")

    starting = Starting((("one", long), ("two", lambda: taken.append("two"))))
    starting.start()
    begun.wait(30.0)
    stopper = threading.Thread(target=starting.stop)
    stopper.start()
    while not starting._stopping.is_set():
        stopper.join(0.01)
    go_on.set()
    stopper.join(30.0)
    assert taken == ["one"]
    assert starting.done
