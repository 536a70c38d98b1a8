"""One short session of the demo, made once: LEFT comes too close to RIGHT."""

from __future__ import annotations

import pytest
from lived import Lived

from backend.shell.session.cycles import Topics
from backend.shell.session.synthetic import Script, synthesize
from backend.site.site import load_site
from cockpit.desk import load_models, make_config


@pytest.fixture(scope="session")
def lived(tmp_path_factory: pytest.TempPathFactory) -> Lived:
    site = load_site("demo")
    config = make_config(site, load_models(site), (), "DEMO")
    path = tmp_path_factory.mktemp("session") / "near-miss.mcap"
    made = synthesize(path, site, config, Script(duration=11.0, begin=16.0))
    return Lived(path, site, config, Topics.of(site), made.snapshots)
