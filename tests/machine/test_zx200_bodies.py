"""A real machine, unchanged: its bodies contain its meshes and exceed them by what is stated."""

from __future__ import annotations

from collections import Counter
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from backend.errors import InputError
from backend.machine import bodies
from backend.machine import fitting_kernels as kernels
from backend.machine.fitting import excess
from backend.machine.fitting_clip import sample
from backend.machine.fitting_field import distance_field, room
from backend.machine.load import SHIPPED, load_machine
from backend.machine.model import Machine
from backend.machine.sidecar import read_sidecar
from backend.machine.stated import left_out
from backend.machine.sweeps import cylinders_of, swept_by_cylinders
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array

STATED = {"bucket": 0.15, "stick": 0.15, "boom": 0.185, "tracks": 0.215, "upper": 0.3}
"""Largest excess over the meshes [m], rounded in the README; 0.15 m is what is wanted of all."""


# Points of the upper body [m], in the link's frame, no two of which share a box, see the test.
APART = [
    [1.54, 1.42, 1.63],
    [-0.92, -0.46, 1.9],
    [0.45, -1.12, 1.81],
    [-0.75, -0.98, 1.73],
    [-0.5, -0.09, 1.11],
    [-2.6, 0.85, 1.74],
    [-0.53, 1.21, 2.26],
    [-1.27, 0.46, 1.48],
    [-0.11, -0.97, 1.73],
    [1.18, -1.25, 0.77],
    [-1.17, -1.01, 1.8],
    [-2.28, -0.68, 1.72],
    [-0.01, -0.7, 1.13],
]


@pytest.fixture(scope="module")
def xacro(shared_data: Path) -> Path:
    return shared_data / "zx200" / "zx200.xacro"


@pytest.fixture(scope="module")
def zx200(xacro: Path) -> Machine:
    """With the boxes of the shipped sidecar; nothing is fitted."""

    def fit(*_: object) -> Boxes:
        raise AssertionError("the sidecar has boxes for every link with meshes")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bodies, "fitted", fit)
        return load_machine(str(xacro))


@pytest.fixture(scope="module")
def swept(zx200: Machine, xacro: Path) -> dict[int, Array]:
    """Link index -> triangles of the cylinders over their whole strokes, in the link's frame."""
    sidecar = SHIPPED / "zx200.toml"
    links, joints = zx200.links, zx200.joints
    cylinders = cylinders_of(links, joints, read_sidecar(sidecar), xacro, str(sidecar))
    return swept_by_cylinders(links, joints, cylinders, str(sidecar), None)


def covered(boxes: Boxes, points: Array) -> Array:
    """(n,) whether each point (n, 3) is in at least one box."""
    inside = np.zeros(len(points), dtype=bool)
    for k in range(len(boxes)):
        local = (points - boxes.centers[k]) @ boxes.rotations[k]
        inside |= (np.abs(local) <= boxes.half_extents[k] + 1e-9).all(axis=1)
    return inside


def bodies_of(machine: Machine, link: int) -> Boxes:
    return machine.bodies.take(np.flatnonzero(np.array(machine.body_links) == link))


def parts(machine: Machine) -> dict[str, int]:
    """Part -> its link; the marker of the bucket's end, a millimetre wide, is no part."""
    return {
        link.part: i
        for i, link in enumerate(machine.links)
        if sum(len(v.vertices) for v in link.visuals) > 100
    }


@pytest.mark.parametrize("part", STATED)
def test_every_vertex_is_in_a_body_of_its_link(zx200: Machine, part: str) -> None:
    link = parts(zx200)[part]
    vertices = np.concatenate([v.vertices for v in zx200.links[link].visuals])
    assert len(vertices) > 1000
    inside = covered(bodies_of(zx200, link), vertices)
    assert inside.all(), f"{np.count_nonzero(~inside)} of {len(inside)} vertices outside"


def test_cylinders_are_enclosed_over_their_whole_strokes(
    zx200: Machine, swept: dict[int, Array]
) -> None:
    assert len(swept) >= 2
    for link, triangles in swept.items():
        assert covered(bodies_of(zx200, link), triangles.reshape(-1, 3)).all()


def test_no_triangle_reaches_out_of_the_bodies(zx200: Machine, swept: dict[int, Array]) -> None:
    """Not only the corners: every triangle is cut at every box."""
    for link in parts(zx200).values():
        meshes = [v.vertices[v.faces] for v in zx200.links[link].visuals]
        triangles = np.concatenate([*meshes, *([swept[link]] if link in swept else [])])
        assert left_out(bodies_of(zx200, link), triangles)[0] == 0.0


def test_a_box_too_small_is_refused(xacro: Path, tmp_path: Path) -> None:
    text = (SHIPPED / "zx200.toml").read_text()
    before, _, after = text.partition("bucket_link = [")
    half = after.index("half_extents = [") + len("half_extents = [")
    sidecar = tmp_path / "zx200.toml"
    sidecar.write_text(
        f"{before}bucket_link = [{after[:half]}0.01, {after[half:].split(', ', 1)[1]}"
    )
    with pytest.raises(
        InputError, match=r"boxes\.bucket_link: .* out of these 12 boxes, at .*cockpit"
    ):
        load_machine(str(xacro), sidecar)


def test_there_are_at_most_twelve_bodies_a_link(zx200: Machine) -> None:
    counts = Counter(zx200.body_links)
    assert max(counts.values()) <= 12
    assert {zx200.links[link].part for link in counts} == set(STATED)


@pytest.mark.parametrize("part", STATED)
def test_bodies_exceed_the_meshes_by_no_more_than_stated(
    zx200: Machine, swept: dict[int, Array], part: str
) -> None:
    link = parts(zx200)[part]
    meshes = [v.vertices[v.faces] for v in zx200.links[link].visuals]
    triangles = np.concatenate([*meshes, *([swept[link]] if link in swept else [])])
    measured = excess(bodies_of(zx200, link), triangles)
    print(f"\n{part}: expected <= {STATED[part]:.3f} m, measured {measured:.3f} m")
    assert measured <= STATED[part]


def test_twelve_boxes_cannot_keep_the_upper_body_within_what_is_wanted(zx200: Machine) -> None:
    """Thirteen points of the mesh need a box each, even with 0.16 m.

    The way between any two of them leaves the room that boxes may fill, and a box is convex.
    """
    link = zx200.links[parts(zx200)["upper"]]
    triangles = np.concatenate([v.vertices[v.faces] for v in link.visuals])
    away, index = cKDTree(dense := sample(triangles, 0.02)).query(np.array(APART))
    assert away.max() < 0.02
    ends = dense[index]
    allowed = 0.16  # the centimetre is for the grid's error
    space, _ = room(distance_field(triangles), allowed)
    share = np.linspace(0.0, 1.0, 300)[:, None]
    for a, b in combinations(ends, 2):
        way = a * (1.0 - share) + b * share
        value = max(kernels.value_at(space.values, space.origin, space.step, *p) for p in way)
        assert value > allowed
    assert len(ends) > 12
