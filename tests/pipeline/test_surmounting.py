"""A machine half up a step: what its plan says counts, and only while it says so."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from test_stability import _samples

from backend.documents.snapshot import snapshot_document
from backend.fusion.samples import ClockSample
from backend.machine import kinematics
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import initial, step
from backend.pipeline.surmounting import without
from backend.safety import words
from backend.safety.limiter import Wish, limit, open_latch
from backend.safety.limits import Delay
from backend.safety.partner import Limits
from backend.safety.record import Level
from backend.safety.surmounting import NAME, Surmounting
from backend.safety.tip_over import TipOver
from backend.shell.app.models import SnapshotModel
from backend.shell.app.wire import dumps
from backend.shell.session.recorded_snapshot import recorded_snapshot
from backend.shell.session.surmounting_message import surmounting_of
from backend.site.named_bodies import SiteBodies
from backend.site.site import load_site
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes

MINI = load_machine("mini")
HEIGHT = 0.30
PITCH = math.radians(15.0)
REAR = -0.5 * MINI.tracks.length
"""The tracks' rear corner stays on the ground: the root is as high as that needs."""
T_ROOT = transform.make(
    rotation.from_attitude(0.0, PITCH, 0.0), np.array([0.0, 0.0, -REAR * math.sin(PITCH)])
)
EDGE = REAR * math.cos(PITCH) + HEIGHT / math.tan(PITCH)
Q = np.array([0.0, 0.2, -0.9, -0.6])
TIP = kinematics.end_point(MINI, Q, T_ROOT)
HALF = 0.5 * (MINI.tracks.gauge + MINI.tracks.shoe)


@pytest.fixture(scope="module")
def config() -> Config:
    """A step that the tracks lean on, and a wall behind it, out of reach."""
    site = load_site("sun2020-simulation")
    boxes = Boxes(
        np.array([[EDGE + 3.0, 0.0, 0.5 * HEIGHT], [30.0, 0.0, 1.0]]),
        np.tile(np.eye(3), (2, 1, 1)),
        np.array([[3.0, 3.0, 0.5 * HEIGHT], [0.1, 3.0, 1.0]]),
    )
    return Config(
        frame=site.frame,
        machines={"a": MINI},
        labels={"a": "LEFT"},
        own=("a",),
        limits=Limits(0.8, 0.2),
        eta=0.1,
        mode="LIVE",
        margins=False,
        site=SiteBodies(boxes, ("step", "wall")),
        stability=TipOver(payload={"a": 0.0}),
    )


def given(now: float, **changes: object) -> Surmounting:
    x, y, z = T_ROOT[:3, 3].tolist()
    rear = REAR * math.cos(PITCH)
    whole = Surmounting(
        plan="a-1",
        time=now,
        obstacles=("step",),
        phase="sequence 1",
        touching=("tracks", "bucket"),
        position=(x, y, z),
        attitude=(0.0, PITCH, 0.0),
        tolerance=(0.10, math.radians(5.0)),
        support=(
            *((rear, side, 0.0) for side in (-HALF, HALF)),
            *((EDGE, side, HEIGHT) for side in (-HALF, HALF)),
            (float(TIP[0]), 0.2, HEIGHT),
            (float(TIP[0]), -0.2, HEIGHT),
        ),
        margin=0.5,
        clearance=0.05,
    )
    return replace(whole, **changes)  # type: ignore[arg-type]


def run(config: Config, told: bool = True, seconds: float = 0.5, **changes: object) -> Snapshot:
    state, found = initial(config), None
    for k in range(round(seconds / 0.02)):
        now = 100.0 + 0.02 * k
        samples: list[object] = [ClockSample("a", now - 0.02, now - 0.02, now - 0.02)]
        for stamp in (now - 0.02, now - 0.01):
            samples += at(config, stamp, now)
        climbing = {"a": given(now - 0.02, **changes)} if told else {}
        inputs = Inputs(tuple(samples), driven=("a",), surmounting=climbing)
        state, found = step(state, inputs, now, config)
    assert found is not None
    return found


def at(config: Config, stamp: float, now: float) -> list[object]:
    """What the sensors say of a machine on T_ROOT: those of `test_stability`, moved."""
    moved = replace(config, frame=_Moved(config.frame, T_ROOT[:3, 3]))  # type: ignore[arg-type]
    return list(_samples(moved, MINI, Q, np.zeros(4), PITCH, stamp, now, True))


class _Moved:
    """A frame in which everything is elsewhere by `by` (3,)."""

    def __init__(self, frame: object, by: np.ndarray) -> None:
        self._frame, self._by = frame, by

    def to_geodetic(self, p: np.ndarray) -> object:
        return self._frame.to_geodetic(p + self._by)  # type: ignore[attr-defined]


def of(snapshot: Snapshot, name: str) -> object:
    return next((c for c in snapshot.concerns if c.name == name), None)


def speeds(snapshot: Snapshot) -> tuple[np.ndarray, np.ndarray]:
    """What is left of the arm and the tracks at full speed, forwards and down."""
    wish = Wish(-0.2 * MINI.max_velocity, np.full(2, 0.5 * MINI.tracks.max_speed))
    delay = Delay(0.1, 0.2)
    found = limit(
        "a", MINI, Q, wish, snapshot.concerns, delay, open_latch(MINI), snapshot.time
    )  # fmt: skip
    return found.joints / wish.joints, found.tracks / wish.tracks


def test_the_pose_is_where_this_test_says(config: Config) -> None:
    pose = run(config).machines["a"].pose
    np.testing.assert_allclose(pose.position, T_ROOT[:3, 3], atol=0.01)
    assert pose.pitch == pytest.approx(PITCH, abs=1e-3)


def test_without_a_plan_the_step_is_an_obstacle_and_the_slope_a_slope(config: Config) -> None:
    snapshot = run(config, told=False)
    site = of(snapshot, "site")
    assert site.level is Level.STOP
    assert site.evidence.other == "site:step"
    _, tracks = speeds(snapshot)
    assert not tracks.any()
    assert of(snapshot, NAME) is None
    assert "surmounting" not in snapshot_document(snapshot, config)


def test_by_plan_the_tracks_may_touch_it_and_all_moves(config: Config) -> None:
    snapshot = run(config)
    assert of(snapshot, "site").level is Level.CLEAR
    concern = of(snapshot, NAME)
    margin = snapshot.stability["a"].margin
    assert concern.level is Level.SLOW
    assert concern.reason == f"LEFT on step · margin {margin:.2f} m · sequence 1"
    line = words.line(concern, config.labels)
    assert line == f"SLOW · LEFT on step · margin {margin:.2f} m · sequence 1"
    assert "dead-man" in words.detail(concern, MINI, config.labels)
    arm, tracks = speeds(snapshot)
    np.testing.assert_allclose(arm, 1.0)
    np.testing.assert_allclose(tracks, 1.0)
    assert [a.concern.name for a in snapshot.alarms if a.active] == [NAME]


def test_the_margin_is_the_centre_of_mass_to_the_edge_of_its_own_support(config: Config) -> None:
    found = run(config).stability["a"]
    masses = [(link.inertia, k) for k, link in enumerate(MINI.links) if link.inertia is not None]
    poses = kinematics.link_poses(MINI, Q, T_ROOT)
    weighed = [(i.mass, poses[k, :3, :3] @ i.com + poses[k, :3, 3]) for i, k in masses]
    total = sum(m for m, _ in weighed)
    com = sum(m * c for m, c in weighed) / total
    rear = REAR * math.cos(PITCH)
    # The machine stands between its rear wheels and the bucket: the sides or the rear are nearest.
    sides = [com[0] - rear, HALF - abs(com[1])]
    assert found.margin == pytest.approx(min(sides), abs=0.01)


def test_every_other_body_counts_as_always(config: Config) -> None:
    step, _ = config.site.boxes.centers
    near = replace(config.site.boxes, centers=np.array([step, [TIP[0] + 0.25, 0.0, 1.0]]))
    walled = replace(config, site=SiteBodies(near, config.site.names))
    site = of(run(walled), "site")
    assert site.level is not Level.CLEAR
    assert site.evidence.other == "site:wall"


def test_parts_that_are_not_to_touch_are_kept_off_what_is_climbed(config: Config) -> None:
    concern = of(run(config, touching=("bucket",)), NAME)
    assert concern.level is Level.STOP
    assert concern.evidence.own.startswith("a:tracks")
    assert concern.evidence.other == "site:step"
    assert concern.travel.tolist() == [1.0, 0.0]
    assert words.line(concern, config.labels).startswith("STOP · LEFT tracks ↔ step · 0.00 m")


def test_an_uncertain_pose_does_not_stop_what_is_as_planned(config: Config) -> None:
    """The arm 0.05 m above the top, by plan: there it may be, however the position is known."""
    arm = MINI.body_parts != "tracks"
    corners = kinematics.body_boxes(MINI, kinematics.link_poses(MINI, Q, T_ROOT)).corners()[arm]
    low = float(corners[corners[..., 0] > EDGE][:, 2].min())
    step, wall = config.site.boxes.centers
    half = np.array([[3.0, 3.0, 0.5 * (low - 0.05)], [0.1, 3.0, 1.0]])
    raised = replace(
        config.site.boxes,
        centers=np.array([[step[0], 0.0, half[0, 2]], wall]),
        half_extents=half,
    )
    higher = replace(config, site=SiteBodies(raised, config.site.names))
    found = run(higher, touching=("tracks",), clearance=0.05)
    assert found.machines["a"].eta - config.eta > 0.02
    assert of(found, NAME).level is Level.SLOW
    assert (of(found, NAME).allowed > 0.3).all()
    close = of(run(higher, touching=("tracks",), clearance=0.2), NAME)
    assert close.level is Level.STOP
    assert close.evidence.other == "site:step"


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"position": (0.15, 0.0, float(T_ROOT[2, 3]))}, "its base is 0.15 m off"),
        ({"attitude": (0.0, PITCH + math.radians(8.0), 0.0)}, "its pitch is 8° off"),
        ({"attitude": (math.radians(7.0), PITCH, 0.0)}, "its yaw is 7° off"),
    ],
)
def test_beside_its_plan_everything_stops(
    config: Config, changes: dict[str, object], why: str
) -> None:
    snapshot = run(config, **changes)
    concern = of(snapshot, NAME)
    assert concern.level is Level.STOP
    assert concern.reason == f"LEFT sequence 1: {why}"
    arm, tracks = speeds(snapshot)
    assert not arm.any()
    assert not tracks.any()
    assert any(a.concern is concern and a.active for a in snapshot.alarms)


def test_tipping_over_its_own_support_stops_everything(config: Config) -> None:
    """Without the bucket on the step it stands on less than its centre of mass needs."""
    behind = tuple((x - 0.9, y, z) for x, y, z in given(0.0).support[:4])
    snapshot = run(config, support=behind)
    concern = of(snapshot, "tip-over")
    assert concern.level is Level.STOP
    assert "LEFT tips over front · margin" in concern.reason
    arm, tracks = speeds(snapshot)
    assert not arm.any()
    assert not tracks.any()


def test_what_it_stands_on_unknown_is_unknown(config: Config) -> None:
    concern = of(run(config, support=()), "tip-over")
    assert concern.level is Level.UNKNOWN
    assert not speeds(run(config, support=()))[0].any()
    loose = replace(config, machines={"a": replace(MINI, masses_trusted=False)})
    assert of(run(loose), "tip-over").level is Level.UNKNOWN
    none = replace(config, stability=None)
    assert of(run(none), "tip-over").level in (Level.CLEAR, Level.SLOW)
    assert of(run(none, support=()), "tip-over").level is Level.UNKNOWN


def test_what_was_told_a_while_ago_holds_no_more(config: Config) -> None:
    snapshot = run(config, time=99.0)
    assert of(snapshot, NAME) is None
    assert of(snapshot, "site").level is Level.STOP


def test_a_pose_that_is_unknown_is_unknown(config: Config) -> None:
    _, snapshot = step(initial(config), Inputs(surmounting={"a": given(100.0)}), 100.0, config)
    assert of(snapshot, NAME).level is Level.UNKNOWN
    assert of(snapshot, "tip-over").level is Level.UNKNOWN


def test_it_comes_back_from_recordings_bit_by_bit(config: Config) -> None:
    told = given(1.0 / 3.0)
    assert surmounting_of(json.loads(json.dumps(asdict(told)))) == told
    for field in asdict(told):
        with pytest.raises((KeyError, ValueError, TypeError)):
            surmounting_of({k: v for k, v in asdict(told).items() if k != field})
    snapshot = run(config)
    document = json.loads(dumps(snapshot_document(snapshot, config)))
    shown = SnapshotModel.model_validate(document).surmounting["a"]
    assert shown.model_dump() == document["surmounting"]["a"]
    again = recorded_snapshot(json.loads(dumps(snapshot_document(snapshot, config))), config)
    assert again.surmounting == snapshot.surmounting
    assert [c.reason for c in again.concerns] == [c.reason for c in snapshot.concerns]


def test_the_site_without_what_is_climbed_is_the_same_object_each_time(config: Config) -> None:
    left = without(config.site, given(0.0))
    assert left.names == ("wall",)
    assert without(config.site, given(5.0)) is left
    assert without(config.site, None) is config.site
