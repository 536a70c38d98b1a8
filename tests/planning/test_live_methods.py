"""The three ways on an operator's levers: each rule, and random sticks beside boxes."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from backend.machine.kinematics import body_boxes
from backend.machine.load import load_machine
from backend.planning import live
from backend.planning.constrained import damper_bounds
from backend.planning.live import Around, shape
from backend.planning.proximity import Limits, Sight, gradients, near_points, posed
from backend.planning.records import Method, Settings, Thresholds, damper_rate
from backend.safety.limiter import Wish, limit, open_latch
from backend.safety.limits import Delay
from backend.safety.record import Concern, Level
from backend.spatial.boxes import NO_BOXES, Boxes

MINI = load_machine("mini")
N = len(MINI.joints)
Q = np.radians([0.0, 30.0, -80.0, -40.0])
METHODS: tuple[Method, ...] = get_args(Method)
THRESHOLDS = Thresholds()
TRACKS = np.array([0.3, -0.2])
SWING, BOOM, STICK, BUCKET = np.eye(N) * MINI.max_velocity
HALF = np.array([2.0, 0.3, 2.5])
NOWHERE = Limits((), NO_BOXES)


def around(limits: Limits, q: np.ndarray = Q, doubt: float | list[float] = 0.0) -> Around:
    doubts = np.broadcast_to(np.asarray(doubt, dtype=float), len(limits.names))
    return Around(q, posed(MINI, q), limits, doubts)


def nearest(limits: Limits, q: np.ndarray = Q) -> float:
    seen = near_points(MINI, posed(MINI, q), limits, Sight.everywhere(MINI, 50.0), own=False)
    return float(seen.distance.min(initial=50.0))


def beside(gap: float, half: np.ndarray = HALF) -> Limits:
    """A box `gap` [m] to the left of the arm's outer half, parallel to the arm's plane."""
    boxes = body_boxes(MINI, posed(MINI, Q))
    bucket = boxes.take(np.array([MINI.part_of_body(k) == "bucket" for k in range(len(boxes))]))
    corners = bucket.corners().reshape(-1, 3)
    center = [corners[:, 0].max(), corners[:, 1].max() + gap + 0.3, corners[:, 2].mean()]
    limits = Limits(("site:box",), Boxes([center], [np.eye(3)], [half]))
    assert nearest(limits) == pytest.approx(gap, abs=1e-6)
    return limits


def left() -> np.ndarray:
    """The swing towards `beside`, at full speed."""
    near = near_points(MINI, posed(MINI, Q), beside(0.3), Sight.everywhere(MINI, 0.5), own=False)
    towards = -np.sign(gradients(MINI, posed(MINI, Q), near)[0, 0])
    return np.asarray(towards * SWING)


LEFT = left()


def shaped(
    method: Method, joints: np.ndarray, limits: Limits, doubt: float | list[float] = 0.0
) -> live.Shaped:
    return shape(method, MINI, around(limits, doubt=doubt), Wish(joints, TRACKS), THRESHOLDS)


def boxes_about(random: np.random.Generator, q: np.ndarray, gap: float) -> Limits:
    """A turned box about `gap` [m] from some body of the machine at q, and one anywhere near."""
    mine = body_boxes(MINI, posed(MINI, q))
    u, R = random.normal(size=3), np.linalg.qr(random.normal(size=(2, 3, 3)))[0]
    R *= np.linalg.det(R)[:, None, None]
    start = mine.centers[random.integers(len(mine))]
    half = random.uniform(0.2, 1.0, (2, 3))
    way, step = 0.0, u / np.linalg.norm(u)
    while True:
        boxes = Boxes([start + way * step, start + (way + 2.5) * step], R, half)
        found = Limits(("site:one", "site:other"), boxes)
        if nearest(found, q) >= gap:
            return found
        way += 0.1


def posture(random: np.random.Generator) -> np.ndarray:
    return random.uniform(np.maximum(MINI.lower, -1.5), np.minimum(MINI.upper, 1.5))


# Direct levers


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("gap", [0.05, 0.3])
def test_a_joint_whose_stick_is_in_neutral_stands(method: Method, gap: float) -> None:
    found = shaped(method, BOOM, beside(gap)).wish.joints
    assert found[[0, 2, 3]].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("method", METHODS)
def test_no_joint_is_turned_back_or_made_faster(method: Method) -> None:
    random = np.random.default_rng(2)
    cut = 0
    for _ in range(40):
        q, joints = posture(random), random.uniform(-1.0, 1.0, N) * MINI.max_velocity
        limits = boxes_about(random, q, random.uniform(-0.3, 0.5))
        found = shape(method, MINI, around(limits, q), Wish(joints, TRACKS), THRESHOLDS)
        share = found.wish.joints / joints
        assert (share >= 0.0).all()
        assert (share <= 1.0).all()
        assert found.scale == pytest.approx(share.min())
        assert bool(found.why) == (found.scale < 1.0)
        cut += found.scale < 1.0
    assert cut > 10


@pytest.mark.parametrize("method", METHODS)
def test_tracks_pass_unchanged(method: Method) -> None:
    found = shaped(method, LEFT, beside(0.1))
    assert abs(found.wish.joints[0]) < abs(LEFT[0])
    assert found.wish.tracks is TRACKS


@pytest.mark.parametrize("method", METHODS)
def test_what_is_free_passes(method: Method) -> None:
    """Own bodies hold nothing back: the boom's foot is 0.3 m from the tracks here."""
    wish = LEFT + BOOM - STICK
    far = Boxes([[0.0, 25.0, 0.0]], [np.eye(3)], [HALF])
    for limits in (NOWHERE, Limits(("site:far",), far)):
        found = shaped(method, wish, limits)
        np.testing.assert_array_equal(found.wish.joints, wish)
        assert (found.scale, found.why) == (1.0, ())


@pytest.mark.parametrize("method", METHODS)
def test_moving_away_is_free_even_within_the_lower_threshold(method: Method) -> None:
    found = shaped(method, -LEFT, beside(0.1, np.array([0.6, 0.3, 0.6])))  # far from the tail
    np.testing.assert_array_equal(found.wish.joints, -LEFT)
    assert found.scale == 1.0


@pytest.mark.parametrize("method", ["scaling", "constrained"])
def test_within_the_lower_threshold_what_approaches_stands(method: Method) -> None:
    """C would ask for retreat there; levers are never turned back."""
    found = shaped(method, LEFT, beside(0.15))
    assert found.wish.joints.tolist() == [0.0] * N
    assert found.scale == 0.0


@pytest.mark.parametrize("method", METHODS)
def test_what_is_no_number_is_no_wish(method: Method) -> None:
    odd = np.array([np.nan, np.inf, 99.0, 0.0])
    assert shaped(method, odd, NOWHERE).wish.joints.tolist() == [0.0, 0.0, STICK[2], 0.0]


# Doubt


@pytest.mark.parametrize(("gap", "doubt"), [(0.6, 0.0), (0.6, 0.2), (1.1, 0.4), (0.5, 0.4)])
def test_scaling_counts_distances_less_their_doubt(gap: float, doubt: float) -> None:
    slow = 1e-4 * LEFT  # so that the next step is as near as this one
    found = shaped("scaling", slow, beside(gap), doubt)
    want = np.clip((gap - doubt - 0.2) / 0.6, 0.0, 1.0)
    assert found.scale == pytest.approx(want, abs=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_doubt_slows_only_beside_what_is_in_doubt(method: Method) -> None:
    centers = [[0.0, 0.0, 12.0], *beside(0.35).boxes.centers]
    two = Limits(("site:high", "site:box"), Boxes(centers, [np.eye(3)] * 2, [HALF] * 2))
    sure, other = shaped(method, LEFT, two), shaped(method, LEFT, two, [0.25, 0.0])
    doubted = shaped(method, LEFT, two, [0.0, 0.25])
    np.testing.assert_array_equal(other.wish.joints, sure.wish.joints)
    assert doubted.scale < sure.scale
    # What is told is where the bodies are.
    assert doubted.why[0] == "bucket to site:box 0.35 m"


# What is not certain, and what fails


@pytest.mark.parametrize("method", METHODS)
def test_a_pose_that_is_not_certain_is_left_to_the_limiter(method: Method) -> None:
    wish = Wish(LEFT, TRACKS)
    unknown = replace(around(beside(0.1)), unknown="RIGHT position is 0.6 s old")
    found = shape(method, MINI, unknown, wish, THRESHOLDS)
    assert found.wish is wish
    assert found.why == (f"{method} is left out: RIGHT position is 0.6 s old",)


@pytest.mark.parametrize("method", METHODS)
def test_a_method_that_fails_stops_the_joints_and_says_so(method: Method) -> None:
    broken = replace(around(beside(0.5)), T_site_links=np.zeros((0, 4, 4)))
    found = shape(method, MINI, broken, Wish(LEFT, TRACKS), THRESHOLDS)
    assert found.wish.joints.tolist() == [0.0] * N
    assert found.wish.tracks is TRACKS
    assert found.scale == 0.0
    assert found.why[0].startswith(f"STOP: {method} failed: ")


def test_rates_that_are_no_numbers_stop_the_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    real = live.act

    def broken(*given: object) -> object:
        return real(*given)._replace(rates=np.full(N, np.nan))  # type: ignore[arg-type]

    monkeypatch.setattr(live, "act", broken)
    found = shaped("constrained", LEFT, NOWHERE)
    assert found.wish.joints.tolist() == [0.0] * N
    assert "STOP" in found.why[0]


def test_only_what_is_near_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, ...]] = []
    real = live.near_points

    def noted(*given: object) -> object:
        seen.append(given[2].names)  # type: ignore[attr-defined]
        return real(*given, own=False)  # type: ignore[arg-type]

    monkeypatch.setattr(live, "near_points", lambda *given, own: noted(*given))
    near = beside(0.5)
    centers = np.concatenate([near.boxes.centers, [[60.0, 0.0, 0.0], [0.0, -90.0, 0.0]]])
    far = Boxes(centers, [np.eye(3)] * 3, [HALF] * 3)
    shaped("constrained", LEFT, Limits(("site:box", "site:a", "site:b"), far))
    assert seen == [("site:box",)]


# C beside others


def test_constrained_slides_along_a_wall() -> None:
    """The boom's motion is along the box: it is free while the swing is almost stopped."""
    found = shaped("constrained", LEFT + BOOM, beside(0.22))
    assert found.wish.joints[1] == pytest.approx(BOOM[1])
    assert abs(found.wish.joints[0]) < 0.1 * abs(LEFT[0])
    assert "site:box" in found.why[0]


def test_constrained_counts_on_no_joint_that_the_limiter_may_slow() -> None:
    """Any share of each joint keeps every damper that the whole wish was given."""
    random = np.random.default_rng(5)
    settings, bound = Settings(THRESHOLDS, retreat=0.0), 0
    for _ in range(60):
        q, joints = posture(random), random.uniform(-1.0, 1.0, N) * MINI.max_velocity
        limits = boxes_about(random, q, random.uniform(0.0, 0.5))
        found = shape("constrained", MINI, around(limits, q), Wish(joints, TRACKS), THRESHOLDS)
        T = posed(MINI, q)
        near = near_points(MINI, T, limits, Sight.everywhere(MINI, 2.0), corners=True, own=False)
        least = damper_bounds(near.distance, settings, damper_rate(MINI))
        J = gradients(MINI, T, near)
        assert (J @ found.wish.joints >= least - 1e-6).all()
        for share in random.integers(0, 2, (8, N)):
            assert (J @ (share * found.wish.joints) >= least - 1e-6).all()
        bound += found.scale < 1.0
    assert bound > 30


# Driven, the limiter after it


def driven(method: Method | None, seed: int) -> float:
    """Least distance [m] in five seconds of random sticks beside boxes that stand 0.3 m away.

    The limiter is told of nothing near: what is kept is kept by the method. Joints follow at once.
    """
    random = np.random.default_rng(seed)
    q = posture(random)
    limits = boxes_about(random, q, 0.3)
    latch, least, joints = open_latch(MINI), np.inf, np.zeros(N)
    for cycle in range(250):
        now = cycle * live.STEP
        if cycle % 50 == 0:
            joints = random.uniform(-1.0, 1.0, N) * MINI.max_velocity
        wish = sticks = Wish(joints, np.zeros(2))
        if method is not None:
            wish = shape(method, MINI, around(limits, q), sticks, THRESHOLDS).wish
        clear = Concern(
            "site", "left", Level.CLEAR, "nothing near", np.ones((N, 2)), np.ones(2), None, now
        )
        delay = Delay(0.05, 0.1)
        found = limit(
            *("left", MINI, q, wish, (clear,), delay, latch, now), override=None, sticks=sticks
        )
        latch = found.latch
        q = np.clip(q + found.joints * live.STEP, MINI.lower, MINI.upper)
        least = min(least, nearest(limits, q))
    return least


@pytest.mark.parametrize("method", ["scaling", "constrained"])
def test_the_lower_threshold_is_kept_beside_what_stands(method: Method) -> None:
    assert min(driven(method, seed) for seed in range(6)) >= THRESHOLDS.lower - 1e-3


def test_without_a_method_the_same_sticks_lead_nearer() -> None:
    assert min(driven(None, seed) for seed in range(6)) < 0.0
