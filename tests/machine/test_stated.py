"""Boxes stated in a sidecar: taken when they contain the meshes, refused in words when not."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from backend.errors import InputError
from backend.machine import fitting
from backend.machine.load import fit_tasks, load_machine
from backend.machine.sidecar import Sidecar
from backend.machine.stated import as_toml, boxes_of, left_out, tables_of
from backend.spatial.boxes import Boxes
from backend.spatial.rotation import about_axis

HALVES = """
[bodies.boxes]
bucket = [
  { center = [0.13, 0.0, 0.0], half_extents = [0.1301, 0.2001, 0.1501] },
  { center = [0.38, 0.0, 0.0], rpy_deg = [0.0, 180.0, 0.0], half_extents = [0.1201, 0.2001, 0.1501] },
]
"""  # noqa: E501

ROD = """
[[cylinder]]
name = "rod"
barrel_link = "stick"
barrel_pivot = [0.3, 0.0, 0.2]
rod_link = "bucket"
rod_pivot = [0.3, 0.0, 0.0]
carried_by = "bucket"
barrel = {radius = 0.06, length = 0.4}
rod = {radius = 0.04, length = 0.4}
"""


@pytest.fixture
def meshed(tiny, tmp_path, monkeypatch):
    """A tiny machine whose bucket is a mesh that must not be fitted."""

    def fit(*_: object) -> Boxes:
        raise AssertionError("fitted")

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(fitting, "fit_boxes", fit)
    trimesh.creation.box(extents=(0.5, 0.4, 0.3)).export(tmp_path / "b.stl")
    return tiny(('<sphere radius="0.25"/>', '<mesh filename="b.stl"/>'))


def load(path: Path, text: str):
    path.with_suffix(".toml").write_text(text)
    return load_machine(str(path))


def test_stated_boxes_are_taken_instead_of_a_fit(meshed):
    machine = load(meshed, HALVES)
    own = [k for k, name in enumerate(machine.body_names) if name.startswith("bucket/")]
    boxes = machine.bodies.take(np.array(own))
    np.testing.assert_allclose(boxes.centers, [[0.13, 0, 0], [0.38, 0, 0]])
    np.testing.assert_allclose(boxes.rotations[1], np.diag([-1.0, 1.0, -1.0]), atol=1e-12)
    np.testing.assert_allclose(boxes.half_extents[0], [0.1301, 0.2001, 0.1501])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HALVES.replace("0.2001, 0.1501] },\n]", "0.1851, 0.1501] },\n]"),
         ["bodies.boxes.bucket", "0.0149 m", "cockpit fit", "--link bucket"]),
        # all corners inside, the middle is not
        (HALVES.replace("[0.13, ", "[0.09, ").replace("[0.38, ", "[0.41, "),
         ["0.0349 m", "bucket"]),
        (HALVES.replace("bucket", "tooth"), ["bodies.boxes.tooth", "house"]),
        (HALVES.replace("bucket", "boom"), ["bodies.boxes.boom", "no meshes"]),
        (HALVES.replace("rpy_deg", "rpy"), ["rpy", "rpy_deg", "half_extents"]),
        (HALVES.replace("0.1301", "0.0"), ["half_extents", "greater than 0"]),
        ("[bodies.boxes]\nbucket = []", ["bodies.boxes.bucket"]),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_in_one_sentence(meshed, text, words):
    with pytest.raises(InputError) as caught:
        load(meshed, text)
    said = str(caught.value)
    assert "tiny.toml" in said
    assert "\n" not in said
    for word in words:
        assert word in said


def test_a_drawn_cylinder_that_turns_round_gives_no_angle(meshed):
    """ROD stands still at 16 deg of its joint: it is drawn, and nothing is read from it."""
    reached = ROD + HALVES.replace("0.1301, 0.2001, 0.1501", "9.0, 9.0, 9.0")
    assert load(meshed, reached).strokes == ()
    with pytest.raises(InputError, match="its length turns round or stands still at 16"):
        load(meshed, ROD.replace("[[cylinder]]", "[[cylinder]]\nclosed_length = 0.0") + HALVES)


def test_a_cylinders_whole_stroke_must_be_inside(meshed):
    with pytest.raises(InputError, match=r"bucket: the link's meshes and cylinders reach"):
        load(meshed, ROD + HALVES)


def test_written_and_read_again_boxes_are_the_same_to_the_digits_written():
    rng = np.random.default_rng(2)
    turns = [about_axis(np.array([0.6, 0.0, 0.8]), a) for a in rng.uniform(-3, 3, 20)]
    boxes = Boxes(rng.uniform(-5, 5, (20, 3)), np.array(turns), rng.uniform(0.01, 2, (20, 3)))
    text = as_toml({"boom_link": tables_of(boxes), "röhre 1": tables_of(boxes)[:1]})
    assert max(map(len, text.splitlines())) < 130
    read = Sidecar.model_validate(tomllib.loads(text)).bodies.boxes
    assert list(read) == ["boom_link", "röhre 1"]
    again = boxes_of(read["boom_link"])
    np.testing.assert_allclose(again.centers, boxes.centers, atol=5.1e-5)
    np.testing.assert_allclose(again.rotations, boxes.rotations, atol=3e-5)
    assert (again.half_extents >= boxes.half_extents - 1e-9).all()
    assert (again.half_extents < boxes.half_extents + 1.1e-4).all()
    assert tables_of(again) == read["boom_link"]


def test_what_is_left_out_is_measured_where_it_is():
    box = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 3)))
    inside = np.array([[[0.0, 0, 0], [1.0, 1, 1], [-1.0, 0, 0]]])
    assert left_out(box, inside)[0] == 0.0
    out, where = left_out(box, np.concatenate([inside, inside + np.array([0.0, 0.3, 0.0])]))
    assert out == pytest.approx(0.3, abs=1e-5)
    np.testing.assert_allclose(where, [1.0, 1.3, 1.0])


def test_the_links_to_be_fitted_are_those_with_meshes_or_cylinders(meshed):
    tasks, _ = fit_tasks(str(meshed))
    assert {name: (len(t.triangles), t.max_boxes) for name, t in tasks.items()} == {
        "bucket": (12, 12)
    }
    on_stick = ROD.replace('carried_by = "bucket"', 'carried_by = "stick"')
    meshed.with_suffix(".toml").write_text("[bodies]\nmax_boxes = 5\n" + on_stick)
    tasks, side = fit_tasks(str(meshed))
    assert {name: t.max_boxes for name, t in tasks.items()} == {"stick": 4, "bucket": 5}
    assert side.bodies.max_boxes == 5
