"""Makes scenes/sessions/near-miss.mcap: the demo's near miss and the cut of a stream after it."""

from __future__ import annotations

from pathlib import Path

from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import load_site
from cockpit.desk import load_models, make_config

SESSIONS = Path(__file__).resolve().parents[1] / "scenes" / "sessions"


def main() -> None:
    site = load_site("demo")
    config = make_config(site, load_models(site), (), "DEMO")
    path = SESSIONS / "near-miss.mcap"
    path.unlink(missing_ok=True)
    synthesize(path, site, config, Script(duration=40.0, begin=14.0))


if __name__ == "__main__":
    main()
