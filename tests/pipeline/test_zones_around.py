"""Driving zones against people and the site, held against separating axes at random places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from oracles import collides_at
from test_people import seen
from test_step import config, inputs, run
from test_working_gauge import AHEAD, RAILS

from backend.documents.zone import ZoneFrameHeader
from backend.pipeline import zones_around
from backend.pipeline.config import Config
from backend.pipeline.people import PeopleState, everybody, following, present
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import GaugeInForce, Snapshot
from backend.pipeline.zones import ZoneImage
from backend.pipeline.zones_around import in_view, people_zone, site_zone
from backend.safety.people import Watch
from backend.shell.app.image_frames import frame_of
from backend.shell.app.wire import decode
from backend.shell.kinds import AROUND, ZONE, Recipe, Wishes, make_images
from backend.site.gauge_choice import GaugeChoice
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

__all__ = ["config", "inputs"]

VARIANTS = ("as_is", "any_swing", "any_posture")
SLOPES = [(0.0, 0.0), (0.004, -0.003), (0.06, -0.03)]
CROWD = tuple(
    (k, *place)
    for k, place in enumerate(
        [
            (2.5, 1.0, 0.5, 0.0), (3.5, -2.0, 0.0, 0.0), (-3.0, 2.5, 0.3, 1.0),
            (0.5, 5.5, 0.0, -1.2), (6.0, 2.0, 1.0, 0.0), (-5.0, -4.0, 0.0, 0.0),
        ],
        1,
    )
)  # fmt: skip


def scattered(n: int, rng: np.random.Generator, apart: float = 9.0) -> SiteBodies:
    """Posts, slabs and beams all about, some over the machine, some askew."""
    place = np.column_stack([rng.uniform(-apart, apart, (n, 2)), rng.uniform(-0.5, 3.5, n)])
    turned = [rotation.from_attitude(*a) for a in rng.uniform(-0.5, 0.5, (n, 3))]
    boxes = Boxes(place, np.array(turned), rng.uniform(0.05, 0.6, (n, 3)))
    return SiteBodies(boxes, tuple(f"body{k}" for k in range(n)))


def tilted(snapshot: Snapshot, config: Config, pitch: float, roll: float) -> Snapshot:
    """With machine a on a slope."""
    state = snapshot.machines["a"]
    pose = replace(state.pose, pitch=pitch, roll=roll)
    body = place(config.machines["a"], pose.joints, base_transform(pose))
    return replace(
        snapshot, machines={**snapshot.machines, "a": replace(state, pose=pose, body=body)}
    )


def among(
    snapshot: Snapshot, crowd: tuple[tuple[int, float, float, float, float], ...]
) -> Snapshot:
    state = following(PeopleState(), seen(99.9, *crowd), snapshot.machines, 100.0)
    return replace(snapshot, people=present(state, Watch(), 100.0))


@pytest.fixture(scope="module")
def snapshot(config: Config) -> Snapshot:
    return run(config, 0.4, q={"a": (0.35, 0.5, -1.0, 0.5), "b": (0.0, 0.5, -1.0, 0.5)})[-1]


def own_at(snapshot: Snapshot, config: Config, q: np.ndarray, heading: float = 0.0) -> Boxes:
    T = base_transform(snapshot.machines["a"].pose)
    base = transform.make(np.eye(3), T[:3, 3])
    turn = base @ transform.make(rotation.rz(heading), np.zeros(3)) @ transform.inverse(base)
    return place(config.machines["a"], q, turn @ T).boxes


def spread(image: ZoneImage, name: str, rng: np.random.Generator, n: int) -> np.ndarray:
    """Places (2 n, 2) all over the zone and close to its edge."""
    zone = image.zones[name]
    low, high = np.array(zone.bounds).reshape(2, 2)
    along = rng.uniform(0.0, zone.boundary.length, n)
    edge = shapely.get_coordinates(shapely.line_interpolate_point(zone.boundary, along))
    return np.concatenate([rng.uniform(low, high, (n, 2)), edge + rng.normal(0, 0.02, (n, 2))])


def postures(
    name: str, q: np.ndarray, config: Config, rng: np.random.Generator, n: int
) -> list[np.ndarray]:
    machine = config.machines["a"]
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    drawn = rng.uniform(low, high, (n, len(q)))
    if name == "any_swing":
        drawn[:, 1:] = q[1:]
    return [q, *drawn]


def assert_safe(
    image: ZoneImage, snapshot: Snapshot, config: Config, boxes: Boxes, rng: np.random.Generator
) -> None:
    """At thousands of places, in every variant, no contact outside the zone; and as the machine
    stands, contact with boxes grown by little more everywhere inside.
    """
    state = snapshot.machines["a"]
    q, grown = state.pose.joints, boxes.inflated(state.eta)
    points = spread(image, "as_is", rng, 1500)
    own = own_at(snapshot, config, q)
    inside = shapely.intersects_xy(image.zones["as_is"], points)
    hit = collides_at(grown, own, points - image.base)
    assert 0.1 < hit.mean() < 0.9
    assert not (hit & ~inside).any()
    wider = collides_at(
        boxes.inflated(2.0 * image.eta - state.eta + 0.01), own, points - image.base
    )
    assert wider[inside].all()
    for name in VARIANTS[1:]:
        points, found = spread(image, name, rng, 1000), 0
        inside = shapely.intersects_xy(image.zones[name], points)
        for one in postures(name, q, config, rng, 24):
            hit = collides_at(grown, own_at(snapshot, config, one), points - image.base)
            assert not (hit & ~inside).any()
            found += int(hit.sum())
        assert found > 2000


@pytest.mark.parametrize(("pitch", "roll"), SLOPES)
def test_no_place_outside_the_zones_touches_people(
    snapshot: Snapshot, config: Config, pitch: float, roll: float
) -> None:
    rng = np.random.default_rng(1)
    here = tilted(among(snapshot, CROWD), config, pitch, roll)
    image = people_zone(here, config, "a")
    assert (image.key, image.layer, image.reason) == ("a<-layer:people", "people", "")
    assert here.people is not None
    boxes, names = everybody(here.people)
    assert len(names) == len(CROWD)
    assert_safe(image, here, config, boxes, rng)
    points = spread(image, "turning", rng, 500)
    inside = shapely.intersects_xy(image.zones["turning"], points)
    q, grown = here.machines["a"].pose.joints, boxes.inflated(here.machines["a"].eta)
    for heading in rng.uniform(-np.pi, np.pi, 24):
        turned = own_at(here, config, q, heading)
        assert not (collides_at(grown, turned, points - image.base) & ~inside).any()


@pytest.mark.parametrize(("pitch", "roll"), SLOPES)
def test_no_place_outside_the_zones_touches_the_site(
    snapshot: Snapshot, config: Config, pitch: float, roll: float
) -> None:
    rng = np.random.default_rng(2)
    built = replace(config, site=scattered(24, rng))
    here = tilted(snapshot, built, pitch, roll)
    image = site_zone(here, built, "a")
    assert (image.key, image.layer) == ("a<-layer:site", "site")
    assert_safe(image, here, built, built.site.boxes, rng)


def test_rounding_the_pose_is_never_less_safe(snapshot: Snapshot, config: Config) -> None:
    """A pose in the middle between two that zones of the site are made for."""
    rng = np.random.default_rng(3)
    built = replace(config, site=scattered(24, rng))
    state = snapshot.machines["a"]
    pose = replace(
        state.pose,
        position=np.array([0.93, -0.97, 0.0099]),
        yaw=0.30099,
        joints=np.array([0.35099, 0.50099, -1.00101, 0.50099]),
    )
    body = place(built.machines["a"], pose.joints, base_transform(pose))
    moved = replace(state, pose=pose, body=body)
    here = replace(snapshot, machines={**snapshot.machines, "a": moved})
    image = site_zone(here, built, "a")
    assert_safe(image, here, built, built.site.boxes, rng)


def test_a_site_zone_is_kept_while_driving_level_and_made_anew_with_the_arm(
    snapshot: Snapshot, config: Config
) -> None:
    built = replace(config, site=scattered(12, np.random.default_rng(4)))

    def moved(position: tuple[float, float, float], swing: float, boom: float = 0.5) -> Snapshot:
        state = snapshot.machines["a"]
        q = np.array([swing, boom, -1.0, 0.5])
        pose = replace(state.pose, position=np.array(position), joints=q)
        return replace(snapshot, machines={**snapshot.machines, "a": replace(state, pose=pose)})

    first = site_zone(moved((0.0, 0.0, 0.0), 0.35), built, "a")
    driven = site_zone(moved((0.7, -0.4, 0.004), 0.3504), built, "a")
    swung = site_zone(moved((0.7, -0.4, 0.0), 0.6), built, "a")
    raised = site_zone(moved((0.7, -0.4, 0.0), 0.6, 0.6), built, "a")
    assert [driven.zones[name] is first.zones[name] for name in VARIANTS] == [True, True, True]
    assert [swung.zones[name] is first.zones[name] for name in VARIANTS] == [False, True, True]
    assert [raised.zones[name] is first.zones[name] for name in VARIANTS] == [False, False, True]
    assert driven.exits["as_is"].signed_distance != first.exits["as_is"].signed_distance


def test_a_crowded_site_shortens_the_view_and_says_so(
    snapshot: Snapshot, config: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(zones_around.MOST, "site", 20)
    rng = np.random.default_rng(5)
    built = replace(config, site=scattered(150, rng, 25.0))
    image = site_zone(snapshot, built, "a")
    assert zones_around.LEAST <= image.view < zones_around.VIEW
    own, grown = snapshot.machines["a"].body, built.site.boxes.inflated(snapshot.machines["a"].eta)
    assert own is not None
    angle, far = rng.uniform(-np.pi, np.pi, 2000), image.view * np.sqrt(rng.uniform(0, 1, 2000))
    shifts = np.column_stack([far * np.cos(angle), far * np.sin(angle)])
    hit = collides_at(grown, own.boxes, shifts)
    assert hit.sum() > 20
    assert shapely.intersects_xy(image.zones["as_is"], (shifts + image.base)[hit]).all()
    assert all(way.signed_distance <= image.view for way in image.exits.values())


def test_what_is_far_away_or_high_above_is_not_looked_at(config: Config) -> None:
    machine = config.machines["a"]
    place = np.array([[3.0, 0, 1], [15.0 + machine.max_reach, 0, 1], [40.0, 0, 1], [3.0, 0, 30]])
    posts = Boxes(place, np.tile(np.eye(3), (4, 1, 1)), np.full((4, 3), 0.2))
    near, view = in_view(machine, np.zeros(3), posts, 0.1, 10)
    assert near.tolist() == [True, True, False, False]
    assert view == zones_around.VIEW
    wall = Boxes(np.array([[0.0, 60.0, 1.0]]), np.eye(3)[None], np.array([[1.0, 50.0, 1.0]]))
    assert in_view(machine, np.zeros(3), wall, 0.1, 10)[0].all()


def test_people_who_are_not_known_are_no_free_ground(snapshot: Snapshot, config: Config) -> None:
    state = following(PeopleState(), seen(99.0, *CROWD), snapshot.machines, 100.0)
    blind = replace(snapshot, people=present(state, Watch(), 100.0))
    image = people_zone(blind, config, "a")
    assert "no LiDAR data" in image.reason
    assert image.zones == {}
    assert image.exits == {}
    frame = frame_of(ZONE, image, {})
    assert frame is not None
    header, arrays = decode(frame)
    ZoneFrameHeader.model_validate(header)
    assert (header["layer"], header["partner"], header["reason"]) == ("people", None, image.reason)
    assert header["variants"] == {}
    assert header["eta"] is None
    assert arrays == {}


def test_one_track_holds_for_the_other_machine_only(config: Config) -> None:
    railed = replace(config, site=RAILS)
    snapshot = run(railed, 0.4)[-1]
    assert all(zone.is_empty for zone in site_zone(snapshot, railed, "a").zones.values())
    beside = site_zone(snapshot, railed, "b")
    assert not beside.zones["as_is"].is_empty
    drawn = GaugeInForce(GaugeChoice((AHEAD,)), snapshot.gauge.own_tracks)
    ahead = site_zone(replace(snapshot, gauge=drawn), railed, "a")
    assert ahead.exits["any_posture"].signed_distance < 0.0


def test_every_own_machine_has_a_zone_per_layer(snapshot: Snapshot, config: Config) -> None:
    own = replace(config, own=("a",), site=scattered(3, np.random.default_rng(6)))
    recipe = Recipe(own, None, (ZONE, AROUND))  # type: ignore[arg-type]

    def made(of: Snapshot) -> dict[str, ZoneImage]:
        images = [one.image for one in make_images(recipe, of, Wishes({})) if one.kind == ZONE]
        return {image.key: image for image in images}  # type: ignore[misc]

    assert set(made(snapshot)) == {"a<-b", "a<-layer:site"}
    found = made(among(snapshot, CROWD))
    assert set(found) == {"a<-b", "a<-layer:people", "a<-layer:site"}
    for key, image in found.items():
        frame = frame_of(ZONE, image, {})
        assert frame is not None
        header, arrays = decode(frame)
        ZoneFrameHeader.model_validate({k: v for k, v in header.items() if k != "arrays"})
        assert (header["key"], header["layer"]) == (key, image.layer)
        for name, variant in header["variants"].items():
            assert arrays[f"{name}_rings"][:, 0].sum() == len(arrays[name])
            assert variant["signed_distance"] == image.exits[name].signed_distance
    assert found["a<-b"].partner == "b"
    assert "turning" in found["a<-layer:people"].zones
