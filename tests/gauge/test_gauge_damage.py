"""Bad files: one sentence or a result, never anything else."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest
from gauge_oracle import INFRAMODEL, Course, alignment, document
from test_gauge_terrain import FEATURES, PIPES, ROOF

from backend.errors import InputError
from backend.gauge import read as reading
from backend.gauge.landxml import parse
from backend.gauge.read import read

COURSE = Course(
    [
        ("line", 50.0, 0, 0),
        ("bloss", 60.0, 0, 0.004),
        ("curve", 40.0, 0.004, 0.004),
        ("cubicParabola", 60.0, 0.004, 0.0),
    ]
)
EXTRA = (
    '<StaEquation staBack="NaN" staAhead="10" staInternal="10" desc="1"/>'
    '<Cant name="c" gauge="1.5" rotationPoint="insideRail"><CantStation station="50" '
    'appliedCant="0"/><CantStation station="110" appliedCant="0.1"/></Cant>'
    '<Profile><ProfAlign name="p"><PVI>0 1</PVI><CircCurve length="20" radius="1000">80 2'
    '</CircCurve><ParaCurve length="20">140 1</ParaCurve><PVI>210 3</PVI></ProfAlign></Profile>'
)
CRS = '<CoordinateSystem name="GK25FIN" epsgCode="3879"/>'
REST = ROOF + FEATURES + PIPES
WHOLE = document(alignment(COURSE, extra=EXTRA) + REST, space=INFRAMODEL, crs=CRS)
FEET = document(alignment(COURSE, "feet", EXTRA) + REST, "feet", crs=CRS)


def judged(data: bytes) -> str:
    """Reads damaged data and uses all of what came out."""
    try:
        model = parse(data, "f.xml")
    except InputError as error:
        text = str(error)
        assert text.startswith("f.xml: ")
        assert text.endswith(".")
        assert "\n" not in text
        return "refused"
    for a in model.alignments:
        with np.errstate(all="raise"):
            s = np.linspace(-1.0, a.length + 1.0, 7)
            assert len(a.at(s).xyz) == 7
    for surface in model.surfaces:
        assert np.isfinite(surface.points).all()
        assert surface.area >= 0.0
    return "read"


def test_the_whole_file_is_read() -> None:
    model = parse(WHOLE, "f.xml")
    assert judged(WHOLE) == "read"
    assert len(model.alignments[0].elements) == 4
    assert (len(model.surfaces), len(model.features), len(model.networks)) == (1, 2, 1)


def test_cut_anywhere_it_is_refused() -> None:
    end = WHOLE.rindex(b"</LandXML>")
    for at in range(0, end, max(1, end // 60)):
        assert judged(WHOLE[:at]) == "refused"


def test_flipped_bytes() -> None:
    rng = random.Random(7)
    seen = set()
    for _ in range(150):
        data = bytearray(WHOLE)
        for _ in range(rng.randint(1, 3)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        seen.add(judged(bytes(data)))
    assert seen == {"read", "refused"}


def test_changed_numbers() -> None:
    rng = random.Random(11)
    texts = [WHOLE.decode(), FEET.decode()]
    words = ["NaN", "1e308", "-1e308", "INF", "", "0", "-1", "1e-300", "x", "9" * 400, "1,5", "-"]
    seen = set()
    for _ in range(150):
        text = rng.choice(texts)
        i = rng.choice([i for i, c in enumerate(text) if c.isdigit()])
        j = i
        while text[j].isdigit() or text[j] in ".-":
            j += 1
        seen.add(judged((text[:i] + rng.choice(words) + text[j:]).encode()))
    assert "read" in seen


def test_dropped_and_doubled_tags() -> None:
    rng = random.Random(3)
    text = WHOLE.decode()
    attributes = [part for part in text.split(" ") if "=" in part]
    for _ in range(150):
        word = rng.choice(attributes).split(">")[0]
        judged(text.replace(" " + word, "", 1).encode())


@pytest.mark.parametrize(
    "prologue",
    [
        '<!DOCTYPE LandXML [<!ENTITY e SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE LandXML [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE LandXML SYSTEM "http://127.0.0.1:9/x.dtd">',
    ],
)
def test_document_types_are_refused(prologue: str) -> None:
    text = WHOLE.decode().replace("<LandXML", prologue + "<LandXML", 1)
    with pytest.raises(InputError, match="document type declaration"):
        parse(text.encode(), "f.xml")


def test_what_is_no_landxml(tmp_path: Path) -> None:
    for data in (
        b"",
        b"hello",
        b"<a/>",
        b"\x00\xff" * 50,
        b"<LandXML",
        b"<LandXML><a></b></LandXML>",
    ):
        with pytest.raises(InputError):
            parse(data, "f.xml")
    with pytest.raises(InputError, match=r"root is <gml>; allowed is <LandXML>"):
        parse(b"<gml/>", "f.xml")
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "absent.xml")
    with pytest.raises(InputError, match="not of a known format"):
        read(tmp_path / "a.docx")


def test_depth_and_length_have_limits() -> None:
    deep = b'<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2">' + b"<a>" * 5000
    with pytest.raises(InputError, match="well-formed"):
        parse(deep + b"</a>" * 5000 + b"</LandXML>", "f.xml")


def test_large_files_are_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(WHOLE)
    monkeypatch.setattr(reading, "MAX_BYTES", 100)
    with pytest.raises(InputError, match="allowed are at most"):
        read(path)


def test_an_unknown_namespace_and_no_units_are_noted() -> None:
    body = (
        '<LandXML xmlns="urn:x"><Parcels/><CgPoints><CgPoint name="a">1 2</CgPoint></CgPoints>'
        "</LandXML>"
    )
    model = parse(body.encode(), "f.xml")
    notes = " ".join(model.notes)
    for words in ('namespace "urn:x"', "Parcels is not read", "metres and radians", "no CRS"):
        assert words in notes


def test_directions_may_count_the_other_way_throughout() -> None:
    text = document(alignment(COURSE)).decode()
    assert parse(text.encode(), "f.xml").conflicts == ()
    turned = _other_way(text)
    model = parse(turned.encode(), "f.xml")
    assert model.conflicts == ()
    assert any("counter-clockwise" in note for note in model.notes)
    one = text.replace('dir="', 'dir="1', 1)
    assert [c.what for c in parse(one.encode(), "f.xml").conflicts] == ["dir, from north clockwise"]


def _other_way(text: str) -> str:
    return re.sub(r'(dir\w*)="([\d.]+)"', lambda m: f'{m[1]}="{400 - float(m[2]):.8f}"', text)
