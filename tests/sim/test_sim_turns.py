"""Turns of a machine's own LiDARs: what is where in the scene is where in the cloud."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.perception.detect import detect
from backend.shell.sim.cab import Seen
from backend.shell.sim.lidar import Lidar
from backend.shell.sim.turns import Turn, scan_at
from backend.shell.sim.walkers import people_at
from backend.site.site import Site, load_site, parse_site
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import apply, make

EXACT = Lidar(noise=0.0, lost=0.0)
E, N = 308600.0, 4129950.0
MINI = load_machine("mini")
ARM = np.radians([0.0, 45.0, -85.0, -70.0])


def yard(**tables: Any) -> Site:
    table = {
        "name": "yard",
        "frame": {"epsg": 32652, "origin": [E, N, 0.0]},
        "machine": [{"name": "left", "model": "mini"}],
        **tables,
    }
    return parse_site(table, Path("yard.toml"))


def swung(machine: Machine, swing: float, T: np.ndarray | None = None) -> Seen:
    q = np.clip(ARM, machine.lower, machine.upper)
    q[0] = swing
    return Seen(machine, q, np.eye(4) if T is None else T)


def turn(site: Site, own: Seen, t: float = 0.0, others: tuple[Seen, ...] = ()) -> Turn:
    (found,) = scan_at(site, t, own, others, np.random.default_rng(0), EXACT)
    return found


def test_a_cloud_is_in_the_sensor_s_frame() -> None:
    """The ground is where z = 0 says, the machine tilted, turned and swung."""
    base = make(from_attitude(2.0, 0.08, -0.05), np.array([20.0, -7.0, 0.4]))
    seen = turn(yard(), swung(MINI, 1.2, base))
    ground = seen.points[seen.hit == -1]
    assert len(ground) > 10_000
    assert ground.dtype == np.float32
    np.testing.assert_allclose(apply(seen.T_site_sensor, ground)[:, 2], 0.0, atol=1e-4)
    # Of a beam's elevation nothing is known but by the mount.
    beams = np.degrees(np.arctan2(ground[:, 2], np.hypot(ground[:, 0], ground[:, 1])))
    known = np.degrees(MINI.lidars[0].elevations)
    assert np.abs(beams[:, None] - known).min(axis=1).max() < 1e-3


def test_every_body_of_the_scene_is_met_where_it_is() -> None:
    site = yard(
        obstacle=[{"name": "post", "center": [E, N + 6.0, 1.0], "half_extents": [0.2, 0.2, 1.0]}],
        person=[{"name": "ann", "path": [[E + 5.0, N + 3.0]]}],
        vehicle=[
            {"name": "lorry", "path": [[E - 9.0, N], [E - 9.0, N + 4.0]], "size": [4.0, 2.0, 2.5]}
        ],
    )
    own = swung(MINI, 0.5)
    partner = swung(MINI, 0.3, make(np.eye(3), np.array([2.0, -8.0, 0.0])))
    seen = turn(site, own, 1.0, (partner,))
    points = apply(seen.T_site_sensor, seen.points)
    n = len(MINI.bodies)
    placed = body_boxes(MINI, link_poses(MINI, partner.q, partner.T_site_root))
    partner_corners = placed.corners().reshape(-1, 3)
    for first, last, low, high in (
        (n, 2 * n, partner_corners.min(axis=0), partner_corners.max(axis=0)),
        (2 * n, 2 * n + 1, [-0.21, 5.79, 0.0], [0.21, 6.21, 2.01]),
        (2 * n + 1, 2 * n + 2, [-10.01, -0.01, 0.0], [-7.99, 4.01, 2.51]),
        (2 * n + 2, 2 * n + 4, [4.77, 2.77, 0.0], [5.23, 3.23, 1.76]),
    ):
        of = points[(seen.hit >= first) & (seen.hit < last)]
        assert len(of) > 40
        assert (of >= np.array(low) - 1e-4).all()
        assert (of <= np.array(high) + 1e-4).all()
    assert (seen.hit < 2 * n + 4).all()
    bodies = body_boxes(MINI, link_poses(MINI, own.q))
    own_points = points[(seen.hit >= 0) & (seen.hit < n)]
    local = np.einsum("bji,nbj->nbi", bodies.rotations, own_points[:, None] - bodies.centers)
    on = (np.abs(local) <= bodies.half_extents + 1e-4).all(axis=2).any(axis=1)
    assert on.all()


def test_as_many_clouds_as_lidars_and_none_without() -> None:
    (mount,) = MINI.lidars
    low = replace(mount, name="low", link=0)
    both = swung(replace(MINI, lidars=(mount, low)), 0.7)
    first, second = scan_at(yard(), 0.0, both, (), np.random.default_rng(0))
    assert (first.sensor, second.sensor) == ("lidar", "low")
    assert not np.allclose(first.T_site_sensor, second.T_site_sensor)
    none = swung(replace(MINI, lidars=()), 0.7)
    assert scan_at(yard(), 0.0, none, (), np.random.default_rng(0)) == ()


def test_parts_of_a_turn_make_the_whole_of_it() -> None:
    own, rng = swung(MINI, 0.7), np.random.default_rng(0)
    (whole,) = scan_at(yard(), 3.0, own, (), rng, EXACT)
    parts = [scan_at(yard(), 3.0, own, (), rng, EXACT, part=(k, 7))[0] for k in range(7)]
    assert all(len(part.points) for part in parts)
    points = np.concatenate([part.points for part in parts])
    hit = np.concatenate([part.hit for part in parts])
    order, again = (np.lexsort(np.round(p, 4).T) for p in (whole.points, points))
    np.testing.assert_allclose(points[again], whole.points[order], atol=1e-4)
    np.testing.assert_array_equal(np.bincount(hit + 1), np.bincount(whole.hit + 1))


def test_the_same_seed_gives_the_same_cloud() -> None:
    clouds = [
        scan_at(yard(), 3.0, swung(MINI, 0.1), (), np.random.default_rng(seed))[0].points
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(clouds[0], clouds[1])
    assert len(clouds[0]) != len(clouds[2]) or not np.array_equal(clouds[0], clouds[2])


@pytest.mark.parametrize(("name", "right", "left"), [("mini", 0.0, 0.0), ("ex13", -20.0, 45.0)])
def test_who_stands_a_metre_and_a_half_from_the_tracks_is_seen(
    name: str, right: float, left: float
) -> None:
    """All around and whatever the swing, except where cab and arm may hide them [deg]."""
    machine = load_machine(name)
    x = 0.5 * machine.tracks.length + 1.5
    y = 0.5 * (machine.tracks.gauge + machine.tracks.shoe) + 1.5
    for k, bearing in enumerate(np.arange(0.0, 2.0 * math.pi, math.pi / 8)):
        c, s = math.cos(bearing), math.sin(bearing)
        far = min(x / max(abs(c), 1e-9), y / max(abs(s), 1e-9))
        swing = (k % 5) * 1.3
        off = math.degrees(math.remainder(bearing - swing, 2.0 * math.pi))
        for away in (0.0, 3.0, 6.0):
            place = [E + (far + away) * c, N + (far + away) * s]
            site = yard(person=[{"name": "ann", "path": [place]}])
            seen = turn(site, swung(machine, swing))
            of = (seen.hit >= len(machine.bodies)).sum()
            assert of >= 10 or right < off < left, (off, away, of)


def test_the_people_scene_s_people_are_detected_where_they_are() -> None:
    site = load_site("people")
    start = site.machine("left").start
    assert start is not None
    base = make(from_attitude(*start.attitude), site.frame.from_projected(np.array(start.position)))
    own = swung(MINI, math.radians(-70.0), base)
    bodies = body_boxes(MINI, link_poses(MINI, own.q, base))
    errors = []
    for t in np.arange(0.0, 60.0, 6.0):
        (seen,) = scan_at(site, float(t), own, (), np.random.default_rng(int(t)))
        found = detect(apply(seen.T_site_sensor, seen.points), seen.T_site_sensor[:3, 3], bodies)
        for person in people_at(site, float(t)):
            off = np.linalg.norm(found.objects.center[:, :2] - person.place, axis=1)
            errors.append(off.min())
    assert np.median(errors) < 0.12
    assert np.mean(np.array(errors) < 0.3) > 0.9
