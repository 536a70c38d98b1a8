"""Surfaces, features and pipes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gauge_oracle import INFRAMODEL, document

from backend.gauge.landxml import parse

ROOF = """<Surfaces state="proposed"><Surface name="  roof   A " desc="d">
<SourceData><Breaklines><Breakline name="ridge"><PntList3D>0 5 3 10 5 3</PntList3D></Breakline>
<Breakline name="bad"><PntList3D>0 5 3 10 5</PntList3D></Breakline></Breaklines></SourceData>
<Definition surfType="TIN" area2DSurf="100" area3DSurf="99"><Pnts>
<P id="1">0 0 0</P><P id="2">10 0 0</P><P id="3">10 5 3</P><P id="4">0 5 3</P>
<P id="5">10 10 0</P><P id="6">0 10 0</P>
<P id="7">NaN 1 1</P><P id="8">1e308 1 1</P><P id="9">1 2</P></Pnts>
<Faces><F>1 2 3</F><F n="0 1 2">1 3 4</F><F>4 3 5</F><F i="0">4 5 6</F>
<F i="1">1 2 5</F><F>1 2 7</F><F>1 1 2</F></Faces></Definition></Surface></Surfaces>"""


def test_a_roof() -> None:
    model = parse(document(ROOF), "f.xml")
    (roof,) = model.surfaces
    assert (roof.name, roof.state, roof.kind, roof.invisible) == ("roof A", "proposed", "TIN", 1)
    assert roof.faces.shape == (4, 3)
    assert roof.points[2].tolist() == [5.0, 10.0, 3.0]  # north came first
    assert roof.area == pytest.approx(2 * 10 * math.hypot(5, 3))
    assert roof.plan_area == pytest.approx(100.0)
    (line,) = roof.breaklines
    assert line.tolist() == [[5.0, 0.0, 3.0], [5.0, 10.0, 3.0]]
    why = [s.why for s in model.skipped]
    assert any("2 points that are not numbers" in w for w in why)
    assert any("1 points without north" in w for w in why)
    assert any("1 faces whose points are missing" in w for w in why)
    assert any("1 faces of no area" in w for w in why)
    assert any("multiple of 3" in w for w in why)
    (conflict,) = model.conflicts
    assert (conflict.what, conflict.stated) == ("area3DSurf", 99.0)


def test_two_surfaces_do_not_share_their_points() -> None:
    one = ROOF.replace("</Surfaces>", "")
    other = (
        '<Surface name="B"><Definition surfType="TIN"><Pnts><P id="1">0 0 0</P></Pnts>'
        "<Faces><F>1 2 3</F></Faces></Definition></Surface></Surfaces>"
    )
    model = parse(document(one + other), "f.xml")
    assert len(model.surfaces) == 1
    assert any("no faces and no breaklines" in s.why for s in model.skipped)


def test_a_surface_in_feet() -> None:
    foot = 1200 / 3937
    (roof,) = parse(document(ROOF, "survey feet"), "f.xml").surfaces
    assert roof.plan_area == pytest.approx(100.0 * foot**2)


FEATURES = """<PlanFeatures name="cables" state="existing">
<PlanFeature name=" cable 1 "><CoordGeom>
<Line><Start>0 0</Start><End>0 100</End></Line>
<Curve rot="ccw"><Start>0 100</Start><Center>50 100</Center><End>50 150</End></Curve>
<IrregularLine><Start>80 150</Start><End>90 150</End><PntList2D>80 150 90 150</PntList2D>
</IrregularLine>
</CoordGeom><Feature code="IM_coding"><Property label="infraCoding" value="123"/></Feature>
<Feature code="IM_cable"><Property label="cableDiameter" value="0.05"/></Feature></PlanFeature>
<PlanFeature name="mast"><Location>10 20 30</Location></PlanFeature>
<PlanFeature name="nothing"><CoordGeom><Line><Start>0 NaN</Start><End>1 1</End></Line></CoordGeom>
</PlanFeature></PlanFeatures>"""


def test_plan_features() -> None:
    model = parse(document(FEATURES, space=INFRAMODEL), "f.xml")
    cable, mast = model.features
    assert (cable.name, cable.kind, cable.state) == ("cable 1", "cable", "existing")
    assert cable.properties == {"IM_coding.infraCoding": "123", "IM_cable.cableDiameter": "0.05"}
    assert len(cable.lines) == 2
    assert cable.lines[0][0, :2].tolist() == [0.0, 0.0]
    assert cable.length == pytest.approx(100 + 50 * math.pi / 2 + 10, abs=0.02)
    curved = cable.lines[0][1:-1, :2]
    np.testing.assert_allclose(np.hypot(curved[:, 0] - 100, curved[:, 1] - 50), 50, atol=1e-9)
    middles = (cable.lines[0][1:-1, :2] + cable.lines[0][2:, :2]) / 2
    assert np.hypot(middles[:, 0] - 100, middles[:, 1] - 50).min() > 50 - 5.1e-3
    assert np.isnan(cable.lines[0][:, 2]).all()
    assert (mast.lines, mast.points.tolist()) == ((), [[20.0, 10.0, 30.0]])
    assert sum("nothing" in s.where for s in model.skipped) == 2


PIPES = """<PipeNetworks><PipeNetwork name="N" pipeNetType="storm" state="proposed"><Structs>
<Struct name="A" elevRim="12" elevSump="8"><Center>0 0 8</Center><CircStruct diameter="1000"/>
<Invert elev="8.5" flowDir="out" refPipe="P1"/></Struct>
<Struct name=" B " elevSump="7"><Center>0 40</Center><RectStruct length="2" width="1.5"/></Struct>
<Struct name="C"><Center>30 inf 6</Center><Connection/></Struct></Structs>
<Pipes><Pipe name="P1" refStart="A" refEnd="B" length="45">
<CircPipe diameter="300" thickness="0.01"/><Center>0 20 8.1</Center></Pipe>
<Pipe name="P2" refStart="B" refEnd="C"><RectPipe width="1" height="0.5"/></Pipe></Pipes>
</PipeNetwork></PipeNetworks>"""


def test_pipes() -> None:
    units = '<Metric linearUnit="meter" diameterUnit="millimeter" widthUnit="meter"/>'
    text = document(PIPES).decode()
    begin, end = text.index("<Units>") + 7, text.index("</Units>")
    model = parse((text[:begin] + units + text[end:]).encode(), "f.xml")
    (network,) = model.networks
    assert (network.name, network.kind, network.state) == ("N", "storm", "proposed")
    a, b = network.structures
    assert (a.kind, a.size, a.rim) == ("CircStruct", (1.0, 1.0), 12.0)
    assert (b.name, b.size, b.center.tolist()) == ("B", (2.0, 1.5), [40.0, 0.0, 7.0])
    assert math.isnan(b.rim)
    (pipe,) = network.pipes
    assert (pipe.size, pipe.thickness) == ((0.3, 0.3), 0.01)
    assert pipe.points.tolist() == [[0, 0, 8.5], [20, 0, 8.1], [40, 0, 7]]
    assert pipe.length == pytest.approx(math.hypot(20, 0.4) + math.hypot(20, 1.1))
    assert [c.stated for c in model.conflicts] == [45.0]
    assert any('"C" was not read' in s.why for s in model.skipped)
    assert any("not a finite number" in s.why for s in model.skipped)
