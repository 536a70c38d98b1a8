"""Boxes and meshes of a site file become named boxes in the site frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from backend.errors import InputError
from backend.site.bodies import site_bodies
from backend.site.site import load_site

SITE = """
name = "yard"
[frame]
epsg = 32652
origin = [308600.0, 4129950.0, 0.0]
[[machine]]
name = "left"
model = "mini"
[[obstacle]]
name = "wall"
center = [308610.0, 4129950.0, 1.0]
half_extents = [0.1, 2.0, 1.0]
[[obstacle_mesh]]
name = "hall"
file = "hall.stl"
position = [308620.0, 4129950.0, 0.0]
yaw_deg = 90.0
"""


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "site.toml").write_text(SITE)
    ell = trimesh.util.concatenate(
        [
            trimesh.creation.box(bounds=[[0, 0, 0], [4, 1, 2]]),
            trimesh.creation.box(bounds=[[0, 1, 0], [1, 4, 2]]),
        ]
    )
    ell.export(tmp_path / "hall.stl")
    return tmp_path / "site.toml"


def test_boxes_contain_the_mesh_where_it_stands(site: Path) -> None:
    bodies = site_bodies(load_site(site))
    assert bodies.names[0] == "wall"
    assert all(name.startswith("hall/") for name in bodies.names[1:])
    assert len(bodies.boxes) > 2  # an L is not one box
    np.testing.assert_allclose(bodies.boxes.centers[0], [10.0, 0.0, 1.0])
    for x, y in ((4, 1), (4, 0), (1, 4), (0, 4), (0, 0)):
        corner = np.array([20.0 - y, x, 2.0])  # turned by 90 degrees
        local = np.einsum("nji,nj->ni", bodies.boxes.rotations, corner - bodies.boxes.centers)
        assert (np.abs(local) <= bodies.boxes.half_extents + 1e-9).all(axis=1).any()


def test_a_missing_or_broken_mesh_is_named(site: Path) -> None:
    hall = site.with_name("hall.stl")
    hall.write_bytes(b"solid nothing")
    with pytest.raises(InputError, match=r"obstacle_mesh hall.*hall\.stl"):
        site_bodies(load_site(site))
    hall.unlink()
    with pytest.raises(InputError, match="does not exist"):
        site_bodies(load_site(site))


def test_names_of_obstacles_and_meshes_are_distinct(site: Path) -> None:
    site.write_text(SITE.replace('name = "hall"', 'name = "wall"'))
    with pytest.raises(InputError, match="wall"):
        load_site(site)
