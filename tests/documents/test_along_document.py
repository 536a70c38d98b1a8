"""`cockpit along`: what it prints, draws and refuses."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import jsonschema
import pytest
from program import cockpit

from backend.documents.along import bands, limit_of
from backend.pipeline.along_track import Stretch
from cockpit.schemas import SCHEMAS

BALLAST = ("--site", "ballast", "--machine", "rail")


def test_json_follows_its_schema_and_the_strip_is_drawn(tmp_path: Path) -> None:
    # Boom and stick stretched out to the right, over T2: into its envelope everywhere.
    cycle, svg = tmp_path / "cycle.json", tmp_path / "strip.svg"
    cycle.write_text('[{"swing": -80, "boom": 0, "stick": -50}, {"swing": -90}]')
    span = ("--from", "20", "--to", "30", "--json", "--svg", str(svg))
    done = cockpit("along", "T1", *BALLAST, "--cycle", str(cycle), *span)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, SCHEMAS["along"][0].model_json_schema())
    (band,) = document["bands"]
    assert (band["start"], band["end"], band["state"], band["limit"]) == (20, 30, "violates", "T2")
    assert band["clearance"] < 0.0
    assert document["place"]["station"] == pytest.approx(30.0)
    assert not document["place"]["assumed"]
    assert len(document["stretches"]) == 20
    classes = [node.get("class") for node in ET.parse(svg).iter()]
    assert classes.count("violates") == 1
    assert "curve" in classes
    assert "now" in classes


def test_the_simulated_cycle_of_the_ballast_site_keeps_clear(tmp_path: Path) -> None:
    done = cockpit("along", "T1", *BALLAST, "--from", "25", "--to", "35")
    assert done.returncode == 0, done.stderr
    assert "stands at 30.00 m, +0.00 m to the left" in done.stdout
    assert "25.00 to     35.00 m  clear        0.4" in done.stdout
    cycle = tmp_path / "still.csv"
    cycle.write_text("swing,boom,stick\n-10,60,-150\n")
    done = cockpit("along", "T2", *BALLAST, "--cycle", str(cycle), "--from", "25", "--to", "26")
    assert done.returncode == 0, done.stderr
    assert "is taken to stand on its middle, at 30.00 m" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("T9", *BALLAST), 'no track is called "T9"; allowed are T1, T2'),
        (("T1", *BALLAST, "--from", "50", "--to", "80"), "allowed are rising stations of T1"),
        (("T1", *BALLAST, "--step", "0"), "0 < finest <= step"),
        (("T1", *BALLAST, "--cycle", "{bad}"), "allowed are joints and degrees"),
        (("T1", *BALLAST, "--cycle", "no-such.csv"), "cannot be read"),
    ],
)
def test_mistakes_are_one_sentence(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text('[{"swing": "left"}]')
    done = cockpit("along", *(a.replace("{bad}", str(bad)) for a in arguments))
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_neighbours_of_one_state_make_one_band() -> None:
    nan = float("nan")
    items = [
        Stretch(0.0, 1.0, "clear", 0.8, 0.6, "boom/0", "gauge:T2/1"),
        Stretch(1.0, 2.0, "clear", 0.5, 0.4, "stick/0", "gauge:pole/0"),
        Stretch(2.0, 3.0, "unknown", nan, nan),
        Stretch(3.0, 4.0, "clear", float("inf"), 3.0),
    ]
    first, unknown, last = bands(items)
    assert (first.start, first.end, first.clearance, first.at) == (0.0, 2.0, 0.5, 1.5)
    assert (first.part, first.limit) == ("stick", "pole")
    assert (unknown.state, unknown.clearance, unknown.at) == ("unknown", None, None)
    assert (last.state, last.clearance, last.limit) == ("clear", None, "")
    assert [limit_of(n) for n in ("site:hall/0", "site:wall")] == ["hall/0", "wall"]
