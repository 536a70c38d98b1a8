"""Makes the shipped session `step`: LEFT climbs the step of that site, through the real processes.

    python tests/shipped_surmount.py

Joints come at 20 Hz in it, and RIGHT is left out, which keeps it small. It is recorded in real
time, so that a new one differs in its details: `make golden` afterwards.
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

SESSION = ROOT / "scenes" / "sessions" / "step"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        # As it is called from the project's folder: no folder of this computer stands in it.
        os.chdir(folder)
        path = Path("scenes/sites/step.toml")
        path.parent.mkdir(parents=True)
        text = (ROOT / path).read_text().replace("joint_period = 0.005", "joint_period = 0.05")
        first, _, rest = text.partition('[[machine]]\nname = "right"')
        path.write_text(f"{first}[sim]{rest.partition('[sim]')[2]}")
        with (
            serve(str(path), "--record", "recorded") as station,
            simulated(str(path), station.endpoint, "left"),
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
        shutil.rmtree(SESSION, ignore_errors=True)
        SESSION.mkdir()
        for part in sorted(Path("recorded").rglob("*.mcap")):
            # What was this computer's folder is as long as before, so that nothing moves.
            there = f"{Path.cwd()}/".encode()
            here = (b"./" * len(there))[: len(there) - 1] + b"/"
            (SESSION / part.name).write_bytes(part.read_bytes().replace(there, here))
    print(*(f"{part} {part.stat().st_size}" for part in sorted(SESSION.iterdir())), sep="\n")


if __name__ == "__main__":
    main()
