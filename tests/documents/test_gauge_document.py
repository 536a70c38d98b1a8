"""`cockpit gauge`: what it prints, draws and refuses."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import jsonschema
import pytest
from program import cockpit

from cockpit.schemas import SCHEMAS

TRACK = """<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2">
<Units><Metric linearUnit="meter" directionUnit="decimal degrees"/></Units>
<CoordinateSystem name="GK25FIN" epsgCode="2392"/>
<Alignments><Alignment name="T &lt;1&gt;" length="260" staStart="100"><CoordGeom>
<Line dir="90"><Start>6673000 25496000</Start><End>6673000 25496200</End></Line>
<Spiral spiType="radioid" length="50" radiusStart="INF" radiusEnd="300" rot="cw">
<Start>6673000 25496200</Start><End>6672999 25496250</End></Spiral>
</CoordGeom><Profile><ProfAlign name="p"><PVI>100 5</PVI><PVI>200 7</PVI></ProfAlign></Profile>
</Alignment></Alignments>
<Surfaces><Surface name="S"><Definition surfType="TIN"><Pnts><P id="a">6673000 25496000 1</P>
<P id="b">6673010 25496000 1</P><P id="c">6673000 25496010 1</P></Pnts><Faces><F>a b c</F></Faces>
</Definition></Surface></Surfaces></LandXML>"""


@pytest.fixture
def track(tmp_path: Path) -> Path:
    path = tmp_path / "t.xml"
    path.write_text(TRACK)
    return path


def test_json_follows_its_schema(track: Path) -> None:
    done = cockpit("gauge", str(track), "--json", "--step", "40")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    jsonschema.validate(document, SCHEMAS["gauge"][0].model_json_schema())
    assert document["crs"]["epsg"] == 3879
    (alignment,) = document["alignments"]
    assert (alignment["name"], alignment["length"], alignment["length_stated"]) == (
        "T <1>",
        200,
        260,
    )
    assert alignment["sta_start"] == 100
    (line,) = alignment["elements"]
    assert (line["type"], line["sta_start"], line["length"]) == ("line", 100, 200)
    assert (line["start"], line["end"]) == ([25496000, 6673000], [25496200, 6673000])
    assert [p["station"] for p in alignment["points"]] == [100, 140, 180, 220, 260, 300]
    assert alignment["points"][1]["z"] == pytest.approx(5.8)
    assert alignment["points"][1]["heading"] == pytest.approx(0.0)
    assert alignment["points"][-1]["z"] is None
    (surface,) = document["surfaces"]
    assert (surface["points"], surface["faces"], surface["area"]) == (3, 1, 50)
    told = " ".join(f"{s['what']}: {s['why']}" for s in document["skipped"])
    for words in ("radioid", "stated 260.0000", "EPSG:2392"):
        assert words in told
    assert len(document["conflicts"]) == 2


def test_words_and_a_plan(track: Path, tmp_path: Path) -> None:
    out = tmp_path / "plan.svg"
    done = cockpit("gauge", str(track), "--svg", str(out))
    assert done.returncode == 0, done.stderr
    for words in ('alignment "T <1>"', "(stated 260.000)", "50.00 m²", "skipped:", "conflicts:"):
        assert words in done.stdout
    root = ET.parse(out).getroot()
    space = "{http://www.w3.org/2000/svg}"
    paths = [p.get("class") for p in root.iter(f"{space}path")]
    assert paths.count("alignment") == 1
    assert paths.count("surface") == 1
    assert any("T <1>" in (t.text or "") for t in root.iter(f"{space}text"))


def test_the_sites_crs_decides(track: Path) -> None:
    done = cockpit("gauge", str(track), "--json", "--site", "demo", "--step", "100")
    document = json.loads(done.stdout)
    assert document["crs"]["source"] == "site"
    assert any("site decides" in c["what"] for c in document["conflicts"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["absent.xml"], "cannot be read"),
        (["a.pdf"], "not of a known format"),
        (["--step", "0", "{track}", "--json"], "--step is 0.0"),
        (["--step", "1e-9", "{track}", "--json"], "allowed are at most"),
        (["{track}", "--site", "nowhere"], "no site called"),
        (["{track}", "--svg", "/nonexistent/x.svg"], "cannot be written"),
    ],
)
def test_mistakes_are_one_sentence_and_exit_2(
    track: Path, arguments: list[str], words: str
) -> None:
    done = cockpit("gauge", *(a.replace("{track}", str(track)) for a in arguments))
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_a_broken_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "b.xml"
    path.write_text(TRACK[:400])
    done = cockpit("gauge", str(path))
    assert (done.returncode, done.stdout) == (2, "")
    assert "not well-formed XML" in done.stderr
