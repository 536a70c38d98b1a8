from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from backend.errors import InputError
from backend.site.site import load_site, shipped_sites

SITE = """
name = "yard"
title = "Two machines"
[frame]
epsg = 32652
origin = [308600, 4129950.0, 0.0]
geoid_offset = 23.4
heading_reference = "true"
[safety]
eta = 0.05
[[machine]]
name = "left"
model = "mini"
[machine.start]
position = [308605.0, 4129950.0, 0.0]
yaw_deg = 90.0
pitch_deg = 2.0
joints_deg = { swing = 0.0, boom = 30.0 }
[machine.sim]
program = "dig-swing-dump"
seed = 1
dig = { reach = 3.0 }
[[machine]]
name = "right_one"
model = "../zx200.xacro"
sidecar = "zx.toml"
prefix = "site/zx200"
label = "ZX"
[sim]
latency = 0.05
[[obstacle]]
name = "pole"
center = [308602.0, 4129951.0, 1.0]
half_extents = [1, 2, 3]
yaw_deg = 90.0
[link]
connect = ["tcp/127.0.0.1:7447"]
"""


@pytest.fixture
def site_file(tmp_path: Path) -> Path:
    path = tmp_path / "yard.toml"
    path.write_text(SITE, encoding="utf-8")
    return path


def test_a_whole_file(site_file: Path) -> None:
    site = load_site(site_file)
    assert (site.name, site.title, site.folder) == ("yard", "Two machines", site_file.parent)
    assert site.frame.heading_reference == "true"
    assert site.frame.geoid_offset == 23.4
    assert (site.safety.eta, site.safety.slow_below, site.safety.stop_below) == (0.05, 0.8, 0.2)
    assert (site.rates.step_hz, site.sim.latency, site.sim.joint_period) == (50.0, 0.05, 0.005)
    left, right = site.machines
    assert (left.label, left.prefix, left.sidecar) == ("LEFT", "left", None)
    assert (right.label, right.prefix, right.sidecar) == ("ZX", "site/zx200", "zx.toml")
    assert left.start is not None
    assert left.start.attitude == pytest.approx((math.pi / 2, math.radians(2.0), 0.0))
    assert left.start.joints == pytest.approx({"swing": 0.0, "boom": math.pi / 6})
    assert left.sim.program == "dig-swing-dump"
    assert left.sim.details == {"dig": {"reach": 3.0}}
    assert right.start is None
    assert right.sim.program == "hold"
    assert site.machine("left") is left
    assert site.link.connect == ("tcp/127.0.0.1:7447",)


def test_obstacles_are_boxes_in_the_site_frame(site_file: Path) -> None:
    boxes = load_site(site_file).obstacle_boxes()
    np.testing.assert_allclose(boxes.centers, [[2.0, 1.0, 1.0]])
    np.testing.assert_allclose(np.abs(boxes.corners()[0] - boxes.centers[0]).max(0), [2, 1, 3])


def test_a_site_without_obstacles_has_no_boxes(site_file: Path) -> None:
    text = SITE[: SITE.index("[[obstacle]]")]
    site_file.write_text(text, encoding="utf-8")
    assert len(load_site(site_file).obstacle_boxes()) == 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("32652", "4326", "frame.epsg is 4326"),
        ("32652", "999999", "frame.epsg is 999999"),
        ("32652", '"32652"', 'frame.epsg is "32652"; allowed is a whole number'),
        ("[308600, 4129950.0, 0.0]", "[1e9, 0, 0]", "frame.origin"),
        ("[308600, 4129950.0, 0.0]", "[308600]", "frame.origin[2] is missing"),
        ("[308600,", "[nan,", "frame.origin[1] is nan; allowed is a finite number"),
        ("epsg =", "espg =", "frame.espg is not a known field; allowed are epsg, origin"),
        ('"true"', '"magnetic"', 'allowed is "grid" or "true"'),
        ("eta = 0.05", "eta = -1.0", "safety.eta is -1.0; allowed is at least 0"),
        ("eta = 0.05", "stop_below = 0.9", "stop_below is 0.9; allowed is less than"),
        ("[sim]", "[simulation]", "simulation is not a known field; allowed are name, title"),
        ("latency = 0.05", "latency = true", "sim.latency is True; allowed is a number"),
        ("swing =", "slew =", 'joint "slew"; allowed are swing, boom'),
        ("yaw_deg = 90.0\npitch", "yaw = 1.0\npitch", "machine[1].start.yaw is not a known field"),
        ("pitch_deg = 2.0", "pitch_deg = 60.0", "pitch_deg is 60.0; allowed is at most 45"),
        ('"right_one"', '"left"', 'name "left" twice'),
        ('"right_one"', '"Right"', 'machine[2].name is "Right"'),
        ('"site/zx200"', '"left/x"', "none lies inside another"),
        ('"site/zx200"', '"a/**"', "machine[2].prefix"),
        ('"site/zx200"', '"cockpit"', "cockpit itself publishes under"),
        ('model = "mini"', "", "machine[1].model is missing"),
        ("[1, 2, 3]", "[1, 0, 3]", "obstacle[1].half_extents[2] is 0; allowed is more than 0"),
        ("yaw_deg = 90.0\n[link]", "rotation = [[1,0,0],[0,1,0],[0,0,-1]]\n[link]", "rotation"),
        ('["tcp/127.0.0.1:7447"]', '"tcp/127.0.0.1:7447"', "link.connect is"),
        ('name = "yard"', "name = ", "not valid TOML"),
    ],
)
def test_mistakes_are_one_sentence(site_file: Path, old: str, new: str, words: str) -> None:
    assert old in SITE
    site_file.write_text(SITE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_site(site_file)
    message = str(caught.value)
    assert words in message
    assert message.startswith(str(site_file))
    assert message.endswith(".")
    assert "\n" not in message


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_site(tmp_path / "nothing.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_site(binary)
    with pytest.raises(InputError, match='no site called "nowhere"; allowed are'):
        load_site("nowhere")


def test_unknown_machine_lists_the_known(site_file: Path) -> None:
    with pytest.raises(InputError, match="allowed are left, right_one"):
        load_site(site_file).machine("middle")


def test_every_shipped_site_loads() -> None:
    assert shipped_sites()
    for name in shipped_sites():
        assert load_site(name).machines
