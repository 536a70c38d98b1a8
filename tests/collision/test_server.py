"""The collision server against enumeration of all pairs, coal, python-fcl and a k-d tree."""

from __future__ import annotations

from itertools import pairwise

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from backend.collision import box_distance, server
from backend.collision.closest import all_pairs
from backend.collision.peer import FclScene
from backend.collision.scene import Scene, Surface, moving, scene
from backend.errors import InputError
from backend.spatial import rotation
from backend.spatial.boxes import NO_BOXES, Boxes, concatenated


def random_boxes(rng: np.random.Generator, n: int, spread: float = 2.0) -> Boxes:
    """Blocks, and a third of them slabs, poles and plates without thickness."""
    half = rng.uniform(0.05, 0.6, (n, 3))
    thin = rng.integers(0, 9, n)
    half[thin == 0, 0] = 0.005
    half[thin == 1, :2] = 0.01
    half[thin == 2, 2] = 0.0
    turns = rotation.from_quaternion(rng.normal(size=(n, 4)))
    turns[rng.random(n) < 0.3] = np.eye(3)
    return Boxes(rng.uniform(-spread, spread, (n, 3)), turns, half)


def names(n: int) -> tuple[str, ...]:
    return tuple(f"body {k}" for k in range(n))


def table(a: Boxes, b: Boxes) -> np.ndarray:
    return all_pairs(a, b).distance.reshape(len(a), len(b))


def as_surface(boxes: Boxes, k: int) -> Surface:
    """Box k as a triangle mesh."""
    mesh = trimesh.creation.box(2.0 * boxes.half_extents[k])
    return Surface(f"s{k}", mesh.vertices @ boxes.rotations[k].T + boxes.centers[k], mesh.faces)


def outside(boxes: Boxes, k: int, points: np.ndarray) -> np.ndarray:
    """How far points (r, 3) are from a box [m]."""
    local = np.abs((points - boxes.centers[k]) @ boxes.rotations[k]) - boxes.half_extents[k]
    return np.linalg.norm(np.maximum(local, 0.0), axis=1)


def check_points(found: server.Closest, links: Boxes) -> None:
    """Witness points lie on the link, and as far apart as the distance says."""
    apart = ~found.touching
    lengths = np.linalg.norm(found.points[:, 0] - found.points[:, 1], axis=1)
    np.testing.assert_allclose(lengths[apart], found.distance[apart], atol=1e-9)
    for link in np.unique(found.link[apart]):
        rows = apart & (found.link == link)
        assert outside(links, link, found.points[rows, 0]).max() < 1e-9


@pytest.mark.parametrize("seed", range(12))
def test_the_k_closest_boxes_are_those_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k, reach = int(rng.integers(1, 150)), int(rng.integers(1, 6)), 1.5
    walls = Boxes(
        np.array([[0.0, 9.0, 0.0], [0.0, 0.0, -4.0]]),
        np.stack([rotation.rz(0.1), rotation.from_attitude(0.0, 0.02, 0.0)]),
        np.array([[10.0, 0.005, 10.0], [10.0, 10.0, 0.005]]),
    )
    boxes = concatenated([random_boxes(rng, n, 4.0), walls])
    links = random_boxes(rng, 8, 4.0)
    found = server.closest(scene(boxes, names(n + 2)), links, reach, k)
    distance = table(links, boxes)
    check_points(found, links)
    for link in range(len(links)):
        rows = found.link == link
        ranked = np.argsort(distance[link])
        wanted = [j for j in ranked[:k] if distance[link, j] <= reach]
        overlapping = (distance[link] <= 0.0).sum()
        if overlapping < k:
            assert set(found.body[rows].tolist()) == set(wanted)
        for j in np.unique(found.body[rows]):
            one = rows & (found.body == j)
            exact = max(distance[link, j], 0.0)
            assert found.distance[one].min() == pytest.approx(exact, abs=1e-9)
            assert found.depth[one].max() == pytest.approx(max(-distance[link, j], 0.0), abs=1e-9)
            assert found.touching[one].any() == (distance[link, j] <= 0.0)
            assert outside(boxes, j, found.points[one & ~found.touching, 1]).max(initial=0) < 1e-9
        assert (np.diff(found.distance[rows]) >= 0.0).all()


def test_coal_agrees_and_python_fcl_never_knows_better() -> None:
    rng = np.random.default_rng(1)
    boxes, links = random_boxes(rng, 60, 3.0), random_boxes(rng, 40, 5.0)
    least = server.closest(scene(boxes, names(60)), links, 20.0, 1).least(40)
    theirs = np.array([[coal_distance(links, i, boxes, j) for j in range(60)] for i in range(40)])
    apart = least > 0.0
    assert 10 < apart.sum() < 40
    np.testing.assert_allclose(least[apart], theirs.min(axis=1)[apart], atol=1e-6)
    fcl = FclScene(boxes)
    assert (least[apart] <= fcl.all_pairs(links)[apart] + 1e-6).all()
    np.testing.assert_allclose(fcl.by_manager(links)[apart], least[apart], atol=0.02)


def coal_distance(a: Boxes, i: int, b: Boxes, j: int) -> float:
    shapes = []
    for boxes, k in ((a, i), (b, j)):
        T = coal.Transform3s(np.array(boxes.rotations[k]), np.array(boxes.centers[k]))
        shapes += [coal.Box(*(2.0 * boxes.half_extents[k])), T]
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-9
    return float(coal.distance(*shapes, request, coal.DistanceResult()))


def test_thin_wall_that_misleads_gjk() -> None:
    rng = np.random.default_rng(5)
    wall = Boxes(np.zeros((1, 3)), np.eye(3)[None], np.array([[10.0, 10.0, 0.005]]))
    links = random_boxes(rng, 2000, 4.0)
    exact = np.maximum(table(links, wall)[:, 0], 0.0)
    for place in (scene(wall, ("wall",)), scene(meshes=(as_surface(wall, 0),))):
        np.testing.assert_allclose(server.closest(place, links, 99.0).least(2000), exact, atol=1e-9)


def test_empty_and_far_scenes_have_no_rows() -> None:
    links = random_boxes(np.random.default_rng(0), 5)
    far = Boxes(np.array([[100.0, 0.0, 0.0]]), np.eye(3)[None], np.ones((1, 3)))
    for place in (
        scene(),
        scene(far, ("far",)),
        scene().with_cloud("lidar", np.zeros((0, 3)), 0.1),
    ):
        found = server.closest(place, links, 5.0)
        assert len(found) == 0
        assert np.isinf(found.least(5)).all()
    assert len(server.closest(scene(far, ("far",)), NO_BOXES, 5.0)) == 0


@pytest.mark.parametrize("seed", range(4))
def test_meshes_and_hulls_of_boxes_are_as_far_as_the_boxes(seed: int) -> None:
    rng = np.random.default_rng(seed + 20)
    boxes, links = random_boxes(rng, 25, 2.5), random_boxes(rng, 30, 4.0)
    solid = np.flatnonzero(boxes.half_extents.min(axis=1) > 0.0)
    boxes = boxes.take(solid)
    surfaces = tuple(as_surface(boxes, k) for k in range(len(boxes)))
    exact = np.maximum(table(links, boxes), 0.0)
    hulls = server.closest(scene(hulls=surfaces), links, 9.0, k=len(boxes))
    for link in range(len(links)):
        for j in range(len(boxes)):
            rows = (hulls.link == link) & (hulls.body == j)
            assert hulls.distance[rows].min() == pytest.approx(exact[link, j], abs=1e-9)
            assert hulls.touching[rows].any() == (exact[link, j] == 0.0)
    meshes = server.closest(scene(meshes=surfaces), links, 9.0, k=99)
    check_points(meshes, links)
    for link in np.flatnonzero((exact > 0.0).all(axis=1)):
        for j in range(len(boxes)):
            rows = (meshes.link == link) & (meshes.body == j)
            assert meshes.distance[rows].min() == pytest.approx(exact[link, j], abs=1e-9)


def test_analytic_distances_of_meshes() -> None:
    rng = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(4, 2.0)
    place = scene(meshes=(Surface("ball", ball.vertices, ball.faces),))
    directions = rng.normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turns = rotation.from_quaternion(rng.normal(size=(40, 4)))
    links = Boxes(4.0 * directions, turns, rng.uniform(0.1, 0.5, (40, 3)))
    # To a sphere of radius 2 a box is as far as its nearest point to the middle, less 2.
    wanted = np.array([outside(links, k, np.zeros((1, 3)))[0] for k in range(40)]) - 2.0
    found = server.closest(place, links, 9.0).least(40)
    sagitta = (
        2.0
        - ball.triangles_center @ np.ones(3) * 0.0
        - np.linalg.norm(ball.triangles_center, axis=1)
    )
    assert (found >= wanted - 1e-9).all()
    assert (found <= wanted + sagitta.max()).all()
    assert sagitta.max() < 0.01


def test_random_hulls_against_coal_and_links_inside_of_them() -> None:
    rng = np.random.default_rng(8)
    hulls, models = [], []
    for k in range(12):
        points = rng.normal(size=(30, 3)) * rng.uniform(0.2, 1.0, 3) + rng.uniform(-3, 3, 3)
        hull = trimesh.Trimesh(points, ConvexHull(points).simplices).convex_hull
        hulls.append(Surface(f"hull {k}", hull.vertices, hull.faces))
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(hull.faces), len(hull.vertices))
        model.addVertices(np.array(hull.vertices))
        model.addTriangles(np.array(hull.faces))
        model.endModel()
        models.append(model)
    place = scene(hulls=tuple(hulls))
    links = random_boxes(rng, 20, 4.0)
    found = server.closest(place, links, 20.0, k=12)
    for link in range(20):
        shape = coal.Box(*(2.0 * links.half_extents[link]))
        T = coal.Transform3s(np.array(links.rotations[link]), np.array(links.centers[link]))
        for j, model in enumerate(models):
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            theirs = coal.distance(shape, T, model, coal.Transform3s(), request, result)
            ours = found.distance[(found.link == link) & (found.body == j)].min()
            if ours > 0.0:
                assert ours == pytest.approx(theirs, abs=1e-5)
    middle = hulls[0].vertices.mean(axis=0)
    tiny = Boxes(middle[None], np.eye(3)[None], np.full((1, 3), 0.01))
    inside = server.closest(place, tiny, 9.0, k=1)
    assert inside.touching[inside.body == 0].any()


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_clouds_against_a_k_d_tree(radius: float) -> None:
    rng = np.random.default_rng(4)
    points = rng.uniform(-4, 4, (20_000, 3))
    points[:, 2] = 0.3 * np.sin(points[:, 0]) + rng.normal(0, 0.02, len(points))
    links = random_boxes(rng, 25, 3.0)
    place = scene().with_cloud("lidar", points, radius)
    found = server.closest(place, links, 9.0)
    check_points(found, links)
    tree = cKDTree(points)
    for link in range(25):
        near = tree.query_ball_point(links.centers[link], 5.0)
        wanted = max(outside(links, link, points[near]).min() - radius, 0.0)
        assert found.least(25)[link] == pytest.approx(wanted, abs=1e-9)
    # A new cloud replaces the old one, and points that are no numbers are left out.
    high = np.concatenate([points + np.array([0.0, 0.0, 50.0]), np.full((3, 3), np.nan)])
    moved = place.with_cloud("lidar", high, radius)
    assert moved.names == ("lidar",)
    assert len(server.closest(moved, links, 9.0)) == 0
    both = moved.with_cloud("other", points, radius)
    np.testing.assert_array_equal(server.closest(both, links, 9.0).least(25), found.least(25))


def test_a_mixed_scene_is_the_least_of_its_parts() -> None:
    rng = np.random.default_rng(6)
    boxes, links = random_boxes(rng, 40, 4.0), random_boxes(rng, 15, 4.0)
    ball = trimesh.creation.icosphere(3, 1.0)
    surface = Surface("ball", ball.vertices, ball.faces)
    points = rng.uniform(-4, 4, (500, 3))
    seen: list[tuple[str, float]] = []
    whole = scene(boxes, names(40), meshes=(surface,), progress=lambda *at: seen.append(at))
    assert [name for name, _ in seen] == ["boxes", "ball", "done"]
    assert [share for _, share in seen] == sorted(share for _, share in seen)
    whole = whole.with_cloud("lidar", points, 0.02)
    parts = [
        scene(boxes, names(40)), scene(meshes=(surface,)), scene().with_cloud("c", points, 0.02)
    ]  # fmt: skip
    least = np.min([server.closest(part, links, 9.0).least(15) for part in parts], axis=0)
    np.testing.assert_array_equal(server.closest(whole, links, 9.0).least(15), least)
    assert whole.names[-2:] == ("ball", "lidar")


def slid(place: Scene, along: np.ndarray, turn: float, steps: int) -> list[tuple]:
    """Rows of a link beside a wall, moved by `along` and rocked through parallel."""
    found = []
    for s in np.linspace(0.0, 1.0, steps):
        R = rotation.rz(turn * np.sin(12.0 * s))
        link = Boxes((np.array([-1.0, 0.5, 0.0]) + s * along)[None], R[None], [[0.8, 0.2, 0.15]])
        found.append((link, server.closest(place, link, 2.0)))
    return found


@pytest.mark.parametrize("kind", ["box", "hull", "mesh", "cloud"])
def test_no_jump_along_a_wall(kind: str) -> None:
    """A link that slides and rocks: the least distance follows the motion, and every feature that
    comes or goes does so at the edge of the band, or beside another one that is just as near.
    """
    wall = Boxes(np.array([[0.0, 1.2, 0.0]]), np.eye(3)[None], np.array([[3.0, 0.1, 1.0]]))
    x, z = np.meshgrid(np.arange(-3, 3.01, 0.1), np.arange(-1, 1.01, 0.1))
    points = np.stack([x.ravel(), np.full(x.size, 1.1), z.ravel()], axis=1)
    place = {
        "box": lambda: scene(wall, ("wall",)),
        "hull": lambda: scene(hulls=(as_surface(wall, 0),)),
        "mesh": lambda: scene(meshes=(as_surface(wall, 0),)),
        "cloud": lambda: scene().with_cloud("wall", points, 0.02),
    }[kind]()
    steps = slid(place, np.array([2.0, 0.05, 0.0]), 0.02, 400)
    covered = 0
    for (before, was), (after, now) in pairwise(steps):
        motion = np.linalg.norm(after.corners() - before.corners(), axis=2).max()
        least, then = was.distance.min(), now.distance.min()
        assert abs(then - least) <= motion + 1e-9
        one = dict(zip(was.feature.tolist(), was.distance, strict=True))
        two = dict(zip(now.feature.tolist(), now.distance, strict=True))
        corners = [f for f in {*one, *two} if f >= 0]
        for feature in corners:
            if feature in one and feature in two:
                assert abs(one[feature] - two[feature]) <= motion + 1e-9
            else:
                there = one.get(feature, two.get(feature, 0.0))
                assert there >= min(least, then) + server.BAND - 2.0 * motion - 1e-9
        covered += len([f for f in one if 0 <= f < 8]) >= 4
    assert covered > 300, "both ends of the face that is turned to the wall"


def test_self_pairs_within_reach() -> None:
    rng = np.random.default_rng(9)
    boxes = random_boxes(rng, 12, 1.5)
    index = np.array([(i, j) for i in range(12) for j in range(i + 2, 12)])
    found, distance, points = server.pairs(boxes, index, 0.5)
    exact, _ = box_distance.pair_distances(boxes, boxes, index[:, 0], index[:, 1])
    assert {tuple(p) for p in found} == {tuple(p) for p in index[exact <= 0.5]}
    np.testing.assert_allclose(distance, np.sort(exact[exact <= 0.5]), atol=1e-12)
    assert points.shape == (len(found), 2, 3)


def test_a_partner_where_it_is_now() -> None:
    rng = np.random.default_rng(10)
    a, b = random_boxes(rng, 20, 1.5), random_boxes(rng, 26, 1.5)
    b = Boxes(b.centers + np.array([4.0, 0.0, 0.0]), b.rotations, b.half_extents)
    found = server.closest(moving(b), a, 9.0, 1)
    np.testing.assert_allclose(found.least(20), np.maximum(table(a, b).min(axis=1), 0.0), atol=1e-9)


def test_bad_input_is_told_in_one_sentence() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0.0]])
    bent = Surface("dent", np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
                   np.array([[0, 1, 2], [0, 1, 3]]))  # fmt: skip
    for bad, match in (
        (lambda: scene(meshes=(Surface("m", square, np.array([[0, 1, 9]])),)), "faces name"),
        (lambda: scene(meshes=(Surface("m", square * np.nan, np.array([[0, 1, 2]])),)), "finite"),
        (lambda: scene(meshes=(Surface("m", square, np.zeros((0, 3), int)),)), "one or more"),
        (lambda: scene(hulls=(bent,)), "convex"),
        (lambda: scene().with_cloud("c", np.zeros((4, 2)), 0.1), "shape"),
        (lambda: scene().with_cloud("c", np.zeros((4, 3)), -0.1), "radius"),
    ):
        with pytest.raises(InputError, match=match):
            bad()
    with pytest.raises(ValueError, match="k must"):
        server.closest(scene(), NO_BOXES, 1.0, 0)
