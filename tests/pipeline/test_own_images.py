"""Exact images, zones, regions, margins and what-if of a snapshot, and how pages get them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from test_step import config, inputs, run

from backend.collision.closest import closest_pairs
from backend.cspace.cells import COLLIDING, FREE, PARTNER, SITE
from backend.pipeline.config import Config
from backend.pipeline.exact import Cells, own_image, own_machines
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import Snapshot
from backend.pipeline.regions import regions_image
from backend.pipeline.surroundings import surroundings_of
from backend.pipeline.whatif import what_if
from backend.pipeline.zones import zone_image
from backend.shell.app.image_frames import exact_frame, frame_of, rings, zone_frame
from backend.shell.app.wire import decode
from backend.site.named_bodies import SiteBodies
from backend.spatial import transform
from backend.spatial.boxes import Boxes

__all__ = ["config", "inputs"]

SMALL = Cells(slice=24, bar=48, volume=12, reach=(36, 24))
WALL = SiteBodies(Boxes(np.array([[0.0, 3.0, 1.0]]), np.eye(3)[None], [[3.0, 0.1, 1.0]]), ("wall",))


@pytest.fixture(scope="module")
def walled(config: Config) -> Config:
    return replace(config, site=WALL)


@pytest.fixture(scope="module")
def snapshot(walled: Config) -> Snapshot:
    q = {"a": (0.35, 0.5, -1.0, 0.5), "b": (0.0, 0.5, -1.0, 0.5)}
    return run(walled, 0.4, b_position=(6.5, 0.3), q=q)[-1]


def distance_at(snapshot: Snapshot, config: Config, q: np.ndarray) -> tuple[float, float]:
    """Direct distances of A at joint values q to B and to the wall [m]."""
    T = base_transform(snapshot.machines["a"].pose)
    bodies = place(config.machines["a"], q, T).boxes
    partner = snapshot.machines["b"].body
    assert partner is not None
    found = (closest_pairs(bodies, other) for other in (partner.boxes, config.site.boxes))
    to_partner, to_site = (float(pairs.distance[0]) for pairs in found)
    return to_partner, to_site


def test_surroundings_keep_distances_and_names(snapshot: Snapshot, walled: Config) -> None:
    around = surroundings_of("a", snapshot.machines, walled)
    assert "site:wall" in around.names
    assert any(name.startswith("b:bucket/") for name in around.names)
    T = base_transform(snapshot.machines["a"].pose)
    placed = around.boxes.moved(T)
    k = around.names.index("site:wall")
    np.testing.assert_allclose(placed.centers[k], WALL.boxes.centers[0], atol=1e-9)
    assert transform.inverse(T).shape == (4, 4)


def test_cells_agree_with_direct_distances(snapshot: Snapshot, walled: Config) -> None:
    image = own_image(snapshot, walled, "a", SMALL)
    roles = ("swing", "boom", "stick", "bucket")
    checked = {PARTNER: 0, SITE: 0, FREE: 0, COLLIDING: 0}
    for bar in image.bars:
        k = roles.index(bar.joint)
        centers = np.linspace(*bar.edges, len(bar.cells) + 1)
        centers = 0.5 * (centers[1:] + centers[:-1])
        for value, cell in zip(centers, bar.cells, strict=True):
            q = image.q.copy()
            q[k] = value
            partner, site = distance_at(snapshot, walled, q)
            for bit, distance in ((PARTNER, partner), (SITE, site)):
                if abs(distance) > 1e-6:
                    assert bool(cell & bit) == (distance < 0.0)
                checked[bit] += bool(cell & bit)
            if cell & FREE:
                assert min(partner, site) > image.eta - 1e-6
            if cell & COLLIDING:
                assert cell & 7
            checked[FREE] += bool(cell & FREE)
            checked[COLLIDING] += bool(cell & COLLIDING)
    assert min(checked.values()) > 0


def test_slices_hold_the_present_configuration_and_refine_near_it(
    snapshot: Snapshot, walled: Config
) -> None:
    image = own_image(snapshot, walled, "a", SMALL)
    assert [(s.across, s.up) for s in image.slices] == [
        ("boom", "stick"), ("boom", "bucket"), ("stick", "bucket")
    ]  # fmt: skip
    for part in image.slices:
        assert part.cells.shape == (SMALL.slice, SMALL.slice)
        if part.patch is not None:
            width = np.ptp(part.x) / SMALL.slice
            assert np.ptp(part.patch.x) / len(part.patch.cells) == pytest.approx(width / 4)
    assert image.volume.shape == (12, 12, 12)
    assert (image.stopping[:, 1] > 0.0).all()


def test_margins_of_a_snapshot_end_at_first_contact(snapshot: Snapshot, walled: Config) -> None:
    margins = snapshot.margins["a"]
    assert margins.reason == ""
    q0 = snapshot.machines["a"].pose.joints
    met = set()
    for k, both in enumerate(margins.joints):
        for sign, freedom in zip((-1.0, 1.0), both, strict=True):
            for share in np.linspace(0.0, 0.999, 12):
                q = q0.copy()
                q[k] += sign * share * freedom.free
                assert min(distance_at(snapshot, walled, q)) > margins.eta - 1e-6
            if freedom.hits:
                met.add(freedom.hits.split("/")[0])
            assert freedom.time_full > 0.0
    assert "site:wall" in met
    assert margins.motion is None  # it stands still


def test_nothing_is_certain_beside_a_silent_machine(walled: Config) -> None:
    snapshot = run(walled, 0.4, silent=("b",))[-1]
    assert own_machines(snapshot, walled) == []
    assert "b" not in own_machines(snapshot, walled)
    margins = snapshot.margins["a"]
    assert margins.joints == ()
    assert margins.reason
    assert math.isnan(margins.eta)
    verdict = what_if(snapshot, walled, "a", np.zeros(4))
    assert (verdict.verdict, verdict.hits) == ("UNKNOWN", ())
    assert verdict.reason


def test_zones_contain_the_direct_check(snapshot: Snapshot, walled: Config) -> None:
    image = zone_image(snapshot, walled, "a", "b")
    assert image.key == "a<-b"
    as_is, any_swing, any_posture = (
        image.zones[name] for name in ("as_is", "any_swing", "any_posture")
    )
    assert any_swing.buffer(2e-3).covers(as_is)
    assert any_posture.buffer(2e-3).covers(any_swing)
    assert image.zones["turning"].buffer(2e-3).covers(as_is)
    body, partner = snapshot.machines["a"].body, snapshot.machines["b"].body
    assert body is not None
    assert partner is not None
    rng = np.random.default_rng(2)
    for point in rng.uniform(-3.0, 9.0, (60, 2)):
        shift = np.array([*(point - image.base), 0.0])
        moved = Boxes(body.boxes.centers + shift, body.boxes.rotations, body.boxes.half_extents)
        if closest_pairs(moved, partner.boxes).distance[0] < image.eta - 1e-6:
            assert as_is.covers(shapely.Point(point))


def test_regions_share_the_joint_space(snapshot: Snapshot, walled: Config) -> None:
    image = regions_image(snapshot, walled, "a", (16, 10, 10, 10))
    assert image.present
    assert 0.0 < image.share <= image.free < 1.0
    assert image.cut_off_share == pytest.approx(image.free - image.share)


def test_what_if_names_what_touches(snapshot: Snapshot, walled: Config) -> None:
    here = what_if(snapshot, walled, "a", snapshot.machines["a"].pose.joints)
    assert here.verdict == "FREE"
    assert here.closest is not None
    assert 0.0 < here.distance < 3.0
    into_wall = snapshot.machines["a"].pose.joints.copy()
    into_wall[0] = math.pi / 2
    there = what_if(snapshot, walled, "a", into_wall)
    assert there.verdict == "COLLIDING"
    assert {hit.other for hit in there.hits} == {"site:wall"}
    assert {hit.layer for hit in there.hits} == {"site"}
    assert there.distance == 0.0


def test_frames_carry_what_the_images_hold(snapshot: Snapshot, walled: Config) -> None:
    image = own_image(snapshot, walled, "a", SMALL, tip_height=0.5)
    header, arrays = decode(exact_frame(image))
    assert (header["type"], header["key"]) == ("exact", "a")
    assert header["reach"]["picked"] is True
    assert header["reach"]["height"] == 0.5
    for k, part in enumerate(image.slices):
        np.testing.assert_array_equal(arrays[f"slice{k}"], part.cells)
        assert header["slices"][k]["x"] == part.x.tolist()
    assert arrays["reach"].shape == SMALL.reach
    zone = zone_image(snapshot, walled, "a", "b")
    header, arrays = decode(zone_frame(zone))
    assert set(header["variants"]) == {"as_is", "any_swing", "any_posture", "turning"}
    assert arrays["as_is_rings"][:, 0].sum() == len(arrays["as_is"])
    regions = regions_image(snapshot, walled, "a", (8, 6, 6, 6))
    header, _ = decode(exact_frame(image, regions))
    assert header["regions"]["share"] == regions.share
    assert frame_of("regions", regions, {}) is None


def test_rings_tell_holes_from_exteriors() -> None:
    square = shapely.box(0, 0, 4, 4).difference(shapely.box(1, 1, 2, 2))
    xy, sizes = rings(shapely.MultiPolygon([square, shapely.box(9, 9, 10, 10)]))
    assert sizes.tolist() == [[4, 1], [4, 0], [4, 1]]
    assert len(xy) == 12
    xy, sizes = rings(shapely.Polygon())
    assert (xy.shape, sizes.shape) == ((0, 2), (0, 2))
