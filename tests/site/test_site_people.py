"""Who is watched for, and who walks about in the simulation, as a site file says it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from backend.errors import InputError
from backend.machine.load import load_machine
from backend.safety.swing_risk import Boundaries
from backend.site.site import load_site, shipped_sites
from cockpit.desk import make_config

SITE = """
name = "yard"
frame = { epsg = 32652, origin = [308600.0, 4129950.0, 0.0], geoid_offset = 0.0 }
[[machine]]
name = "left"
model = "mini"
[people]
slow_below = 3.0
stop_below = 0.8
stale = 0.4
[[person]]
name = "anna"
path = [[308605.0, 4129950.0], [308605.0, 4129960.0]]
[[person]]
name = "bert"
seed = 1
around = [308600.0, 4129950.0]
[[vehicle]]
name = "truck"
path = [[308615.0, 4129950.0], [308615.0, 4129960.0]]
size = [6.0, 2.5, 3.0]
"""


@pytest.fixture
def site_file(tmp_path: Path) -> Path:
    path = tmp_path / "yard.toml"
    path.write_text(SITE, encoding="utf-8")
    return path


def test_people_are_read(site_file: Path) -> None:
    site = load_site(site_file)
    assert site.watch is not None
    assert dict(site.watch) == {
        "slow_below": 3.0,
        "stop_below": 0.8,
        "walking": 1.0,
        "stale": 0.4,
        "ttc": (1.0, 3.0),
        "index": (1.0, 2.0),
    }
    assert [person.name for person in site.people] == ["anna", "bert"]
    assert [vehicle.name for vehicle in site.vehicles] == ["truck"]


def test_without_the_table_nobody_is_watched_for(site_file: Path) -> None:
    text = SITE.replace("[people]\nslow_below = 3.0\nstop_below = 0.8\nstale = 0.4\n", "")
    site_file.write_text(text, encoding="utf-8")
    assert load_site(site_file).watch is None
    assert load_site("people").watch is not None
    assert {"demo", "people"} <= set(shipped_sites())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("stop_below = 0.8", "stop_below = 3.0", "stop_below is 3.0; allowed is less than slow_b"),
        ("stop_below = 0.8", "stop_below = -0.1", "people.stop_below is -0.1; allowed is at leas"),
        ("slow_below = 3.0", "slow_below = 0", "people.slow_below is 0; allowed is more than 0"),
        ("stale = 0.4", "stale = 0.1", "people.stale is 0.1; allowed is at least 0.15"),
        ("stale = 0.4", "stale = 60.0", "people.stale is 60.0; allowed is at most 5"),
        ("stale = 0.4", "walking = nan", "people.walking is nan"),
        ("stale = 0.4", "ttc = [3.0, 1.0]", "ttc is [3.0, 1.0]; allowed is an emergency's below"),
        ("stale = 0.4", "index = [2.0, 2.0]", "index is [2.0, 2.0]; allowed is an emergency's be"),
        ("stale = 0.4", "ttc = [1.0, 9.0]", "people.ttc[2] is 9.0; allowed is at most 6"),
        ("stale = 0.4", "ttc = [1.0]", "people.ttc"),
        ("stale = 0.4", "fresh = 0.4", "people.fresh is not a known field; allowed are slow_below"),
        ("seed = 1\n", "", 'person[2]: needs one way to go; allowed is "path", or "seed"'),
        ("seed = 1", "seed = 1\nwithin = [3.0, 5.0]", "within is [3.0, 5.0]; allowed is a ring"),
        ('name = "bert"', 'name = "anna"', '"anna"'),
        ("[308615.0, 4129960.0]", "[308615.0, 4129950.0]", "twice in a row"),
        ("size = [6.0, 2.5, 3.0]", "size = [6.0, 0.0, 3.0]", "vehicle[1].size[2] is 0.0"),
    ],
)
def test_mistakes_about_people_are_one_sentence(
    site_file: Path, old: str, new: str, words: str
) -> None:
    assert old in SITE
    site_file.write_text(SITE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_site(site_file)
    message = str(caught.value)
    assert words in message
    assert message.startswith(str(site_file))
    assert message.endswith(".")
    assert "\n" not in message


def test_who_watches_needs_a_lidar(site_file: Path) -> None:
    site = load_site(site_file)
    machine = load_machine("mini")
    watch = make_config(site, {"left": machine}, (), "DEMO").people
    assert watch is not None
    assert (watch.slow_below, watch.stop_below, watch.stale) == (3.0, 0.8, 0.4)
    with pytest.raises(InputError, match=r"no machine has a LiDAR; needed is \[\[lidar\]\]"):
        make_config(site, {"left": replace(machine, lidars=())}, (), "DEMO")


def test_boundaries_of_the_levels_are_the_sites(site_file: Path) -> None:
    text = SITE.replace("stale = 0.4", "ttc = [0.8, 2.0]\nindex = [0.5, 3.0]")
    site_file.write_text(text, encoding="utf-8")
    site = load_site(site_file)
    watch = make_config(site, {"left": load_machine("mini")}, (), "DEMO").people
    assert watch is not None
    assert watch.boundaries == Boundaries(index=(0.5, 3.0), ttc=(0.8, 2.0))
