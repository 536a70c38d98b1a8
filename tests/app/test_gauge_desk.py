"""What operators draw and switch survives a restart, and no file is lost."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.gauge.features import Pole
from backend.gauge.rules import volumes_of
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.records import AS_THE_SITE_SAYS, GaugeInForce
from backend.pipeline.site_concern import standing
from backend.pipeline.working_gauge import site_of
from backend.safety.partner import Limits
from backend.shell.gauge_desk import GaugeDesk
from backend.shell.hub import Hub
from backend.site.gauge_choice import NO_CHOICE, Drawn
from backend.site.named_bodies import SiteBodies
from backend.site.site import load_site

PIT = Drawn("Läppä 1", "keep_out", ((2.0, 2.0), (6.0, 2.5), (6.0, 5.0)), -2.0, 3.0)
YARD = Drawn("yard", "keep_in", ((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0)), None, 9.0)


@pytest.fixture(scope="module")
def config() -> Config:
    volumes = volumes_of([Pole("mast", np.array([9.0, 9.0, 0.0]), 0.2, 8.0)])
    return Config(
        frame=load_site("sun2020-simulation").frame,
        machines={"left": load_machine("mini")},
        labels={"left": "LEFT"},
        own=("left",),
        limits=Limits(0.8, 0.2),
        eta=0.1,
        mode="LIVE",
        site=SiteBodies(volumes[0].boxes, volumes[0].box_names, volumes),
    )


def desk(config: Config, path: Path) -> GaugeDesk:
    return GaugeDesk(config, Hub(), path, lambda *_: None)


def lines(made: GaugeDesk) -> str:
    return " ".join(notice.line for notice in made.notices())


def test_it_is_there_after_a_restart(config: Config, tmp_path: Path) -> None:
    path = tmp_path / "state" / "gauge" / "yard.json"
    first = desk(config, path)
    assert first.choice() is NO_CHOICE
    assert not path.exists()
    first.draw(PIT, False, "otto")
    first.draw(YARD, False, "otto")
    first.switch("mast", False, "otto")
    assert first.choice() is first.choice()
    again = desk(config, path)
    assert again.notices() == ()
    assert again.choice().switched == (("mast", False),)
    for area, kept in zip((PIT, YARD), again.choice().drawn, strict=True):
        assert (kept.name, kept.kind) == (area.name, area.kind)
        np.testing.assert_allclose(kept.polygon, area.polygon, atol=1e-8)
        assert kept.bottom == pytest.approx(area.bottom)
        assert kept.top == pytest.approx(area.top)
    assert path.stat().st_mode & 0o077 == 0
    assert [entry.name for entry in path.parent.iterdir()] == ["yard.json"]
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["epsg"] == config.frame.epsg
    # The same place on the ground where the site file's origin was moved.
    east, north, up = config.frame.origin
    frame = replace(config.frame, origin=(east - 100.0, north + 50.0, up + 1.0))
    shifted = desk(replace(config, frame=frame), path).choice().drawn[0]
    np.testing.assert_allclose(shifted.polygon, np.add(PIT.polygon, (100.0, -50.0)), atol=1e-8)
    assert shifted.bottom == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{", "is not JSON"),
        (b"\xff\xfe", "is not JSON"),
        (b'{"epsg": 32652, "drawm": []}', "drawm is not a known field"),
        (b'{"epsg": 3879}', "epsg is 3879; allowed is the site's, 32652"),
        (b'{"epsg": 32652, "format": 2}', "format is 2"),
        (b'{"epsg": 32652, "switched": {"mast": "off"}}', "switched.mast"),
        (
            b'{"epsg": 32652, "drawn": [{"name": "a", "kind": "keep_in", "polygon": [[1, 2]]}]}',
            "a: the polygon has 1 corners",
        ),
        (
            b'{"epsg": 32652, "drawn": [{"name": "mast", "kind": "keep_in", "polygon": '
            b"[[308600, 4129950], [308610, 4129950], [308610, 4129960]]}]}",
            'the name "mast" is taken',
        ),
    ],
)
def test_a_file_that_is_none_is_told_and_put_aside(
    config: Config, tmp_path: Path, content: bytes, said: str
) -> None:
    path = tmp_path / "yard.json"
    path.write_bytes(content)
    made = desk(config, path)
    assert made.choice() is NO_CHOICE
    assert said in lines(made)
    assert "nothing drawn or switched holds" in lines(made)
    (aside,) = tmp_path.iterdir()
    assert aside.name.startswith("yard-unread-")
    assert aside.name in lines(made)
    assert aside.read_bytes() == content
    made.draw(PIT, False, "otto")
    assert made.notices() == ()
    assert aside.read_bytes() == content
    assert desk(config, path).choice().names == ("Läppä 1",)
    path.write_bytes(content)  # and once more within the same second
    desk(config, path)
    assert len(list(tmp_path.iterdir())) == 2


def test_what_cannot_be_written_holds_and_is_told(
    config: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "yard.json"
    made = desk(config, path)
    made.draw(PIT, False, "otto")
    before = path.read_bytes()

    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("backend.shell.gauge_desk.write", full)
        made.draw(YARD, False, "otto")
    assert made.choice().names == ("Läppä 1", "yard")
    assert "No space left on device; what is drawn and switched holds until" in lines(made)
    assert path.read_bytes() == before
    made.switch("mast", False, "otto")
    assert made.notices() == ()
    assert desk(config, path).choice().names == ("Läppä 1", "yard")


def test_a_file_that_cannot_be_read_is_never_written_over(
    config: Config, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "yard.json"
    path.write_bytes(b"precious")

    def forbidden(_: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    with monkeypatch.context() as broken:
        broken.setattr(Path, "read_bytes", forbidden)
        made = desk(config, path)
    assert "Permission denied" in lines(made)
    made.draw(PIT, False, "otto")
    assert made.choice().names == ("Läppä 1",)
    assert "Permission denied" in lines(made)
    assert path.read_bytes() == b"precious"


def test_no_cycle_waits_for_new_bodies(config: Config, tmp_path: Path) -> None:
    """They are made when they are drawn: the loop finds the same objects."""
    made = desk(config, tmp_path / "yard.json")
    made.draw(PIT, False, "otto")
    from backend.pipeline import site_concern
    from backend.site import gauge_in_force

    misses = [
        cache.cache_info().misses
        for cache in (gauge_in_force._in_force, gauge_in_force._volume, site_concern._standing)
    ]
    around = site_of("left", GaugeInForce(made.choice()), config)
    standing(around)
    assert "gauge:Läppä 1/0" in around.names
    assert site_of("left", AS_THE_SITE_SAYS, config) is config.site
    assert misses == [
        cache.cache_info().misses
        for cache in (gauge_in_force._in_force, gauge_in_force._volume, site_concern._standing)
    ]
