"""Makes the shipped sessions that are simulated without a clock: `shipped_sessions.py [NAME ...]`.

near-miss: the demo's near miss and the cut of a stream after it; ballast: a work cycle beside a
track in use. Their joints come at 50 Hz in ballast, which keeps it at 3 MB.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

ROOT = Path(__file__).resolve().parents[1]
SESSIONS = ROOT / "scenes" / "sessions"
SHIPPED = {
    "near-miss": ("demo", 0.005, Script(duration=40.0, begin=14.0)),
    "ballast": ("ballast", 0.02, Script(duration=52.0)),
}
"""Name: site, period of joint states [s], what is recorded."""


def main(names: list[str]) -> None:
    os.chdir(ROOT)
    for name in names or list(SHIPPED):
        site_name, period, script = SHIPPED[name]
        site = load_site(site_name)
        config = make_config(site, load_models(site), (), "DEMO")
        # No folder of this computer stands in the session.
        there = replace(
            site,
            path=site.path.relative_to(ROOT),
            sim=site.sim.model_copy(update={"joint_period": period}),
        )
        path = SESSIONS / f"{name}.mcap"
        path.unlink(missing_ok=True)
        synthesize(path, there, config, script)


if __name__ == "__main__":
    main(sys.argv[1:])
