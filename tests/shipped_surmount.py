"""Makes the shipped session `step`: LEFT climbs the step of that site, through the real processes.

    python tests/shipped_surmount.py

Joints come at 50 Hz in it, which keeps it small. It is recorded in real time, so that a new one
differs in its details: `make golden` afterwards.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "processes")]

from live import all_valid, serve, simulated  # noqa: E402
from test_live_surmount import Climber  # noqa: E402
from wiretap import Wiretap  # noqa: E402

SESSION = ROOT / "scenes" / "sessions" / "step.mcap"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        # As it is called from the project's folder: no folder of this computer stands in it.
        os.chdir(folder)
        path = Path("scenes/sites/step.toml")
        path.parent.mkdir(parents=True)
        text = (ROOT / path).read_text().replace("joint_period = 0.005", "joint_period = 0.02")
        path.write_text(text)
        with (
            serve(str(path), "--record", "recorded") as station,
            simulated(str(path), station.endpoint, "left", "right"),
        ):
            station.wait_for(all_valid)
            with Wiretap(station.endpoint, "left") as tap:
                climber = Climber(station, tap)
                climber.accept()
                climber.hold(climber.ended)
                assert climber.follow()["arrived"], climber.follow()
                climber.move(enable=False)
                climber.stands()
                climber.close()
        time.sleep(1.0)
        (part,) = sorted(Path("recorded").rglob("*.mcap"))
        shutil.copyfile(part, SESSION)
    print(SESSION, SESSION.stat().st_size)


if __name__ == "__main__":
    main()
