"""Tracks over scans: beginning, crossing, hiding, ending; never silently."""

from __future__ import annotations

import numpy as np
import pytest

from backend.errors import InputError
from backend.tracking.imm import Modes
from backend.tracking.motion import MODELS
from backend.tracking.records import (
    MEASURED,
    PX,
    PY,
    STATE,
    VX,
    VY,
    YAW,
    Detections,
    Lost,
    Settings,
    Status,
)
from backend.tracking.tracker import Tracked, later, nothing, now, track
from backend.tracking.update import sight, updated

PLACES = (PX, PY)
SIGMA = np.array([0.05, 0.05])


def scan(time: float, *places: tuple[float, float]) -> Detections:
    return Detections(time, np.array(places, dtype=float).reshape(-1, 2), PLACES, SIGMA)


def followed(
    scans: list[Detections], settings: Settings | None = None
) -> tuple[Tracked, list[Lost]]:
    result, lost = Tracked(nothing(), 1, (), np.zeros((0, 0))), []
    for one in scans:
        result = track(result.tracks, one, result.next_id, settings)
        lost += result.lost
    return result, lost


def walk(seconds: float, *starts_and_speeds: tuple[float, float, float, float]):
    rng = np.random.default_rng(1)
    for t in np.arange(0.0, seconds, 0.1):
        yield scan(
            t,
            *(
                (x + vx * t + rng.normal(scale=0.03), y + vy * t + rng.normal(scale=0.03))
                for x, y, vx, vy in starts_and_speeds
            ),
        )


def test_one_walker_is_confirmed_at_the_third_sight_and_foretold() -> None:
    scans = list(walk(4.0, (0.0, 0.0, 1.2, -0.4)))
    second, _ = followed(scans[:2])
    assert list(second.tracks.status) == [Status.TENTATIVE]
    third, _ = followed(scans[:3])
    assert list(third.tracks.status) == [Status.CONFIRMED]
    end, lost = followed(scans)
    assert (len(end.tracks), end.tracks.id[0], lost) == (1, 1, [])
    mean, cov = now(end.tracks)
    np.testing.assert_allclose(mean[0, [VX, VY]], [1.2, -0.4], atol=0.15)
    there, spread = later(end.tracks, 1.0)
    np.testing.assert_allclose(there[0, [PX, PY]], [1.2 * 4.9, -0.4 * 4.9], atol=0.3)
    assert spread[0, PX, PX] > cov[0, PX, PX]


def test_clutter_is_not_confirmed() -> None:
    rng = np.random.default_rng(2)
    scans = [scan(0.1 * k, *rng.uniform(-20.0, 20.0, (3, 2))) for k in range(100)]
    result, lost = followed(scans)
    assert lost == []
    assert (result.tracks.status == Status.TENTATIVE).all()


def test_crossing_walkers_keep_their_names() -> None:
    result, _ = followed(list(walk(8.0, (0.0, 0.0, 1.0, 0.5), (0.0, 4.0, 1.0, -0.5))))
    mean, _ = now(result.tracks)
    by_name = dict(zip(result.tracks.id.tolist(), mean[:, PY], strict=True))
    assert set(by_name) == {1, 2}
    assert by_name[1] > 3.5
    assert by_name[2] < 0.5


def test_who_is_hidden_coasts_with_growing_doubt_and_is_taken_up_again() -> None:
    scans = list(walk(6.0, (0.0, 0.0, 1.0, 0.0)))
    hidden = [scan(s.time) if 2.0 < s.time < 3.5 else s for s in scans]
    before, _ = followed(hidden[:20])
    during, lost = followed(hidden[:34])
    assert list(during.tracks.status) == [Status.COASTING]
    assert lost == []
    assert now(during.tracks)[1][0, PX, PX] > 4.0 * now(before.tracks)[1][0, PX, PX]
    after, _ = followed(hidden)
    assert (list(after.tracks.id), list(after.tracks.status)) == ([1], [Status.CONFIRMED])


def test_who_stays_away_is_told_as_lost_where_last_seen() -> None:
    scans = list(walk(2.0, (0.0, 0.0, 1.0, 0.0))) + [scan(2.0 + 0.1 * k) for k in range(40)]
    result, lost = followed(scans)
    assert len(result.tracks) == 0
    assert [one.id for one in lost] == [1]
    assert lost[0].last_seen == pytest.approx(1.9)
    assert lost[0].ended - lost[0].last_seen == pytest.approx(Settings().coast, abs=0.5)


def test_a_scan_from_before_is_refused() -> None:
    result, _ = followed(list(walk(1.0, (0.0, 0.0, 1.0, 0.0))))
    with pytest.raises(InputError, match="order of their times"):
        track(result.tracks, scan(0.2))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_is_refused(bad: float) -> None:
    with pytest.raises(InputError, match="finite"):
        scan(0.0, (bad, 0.0))


def test_columns_that_cannot_be_measured_are_refused() -> None:
    with pytest.raises(InputError, match="x and y come first"):
        Detections(0.0, np.zeros((1, 2)), (PX, VX), SIGMA)


def certain(rng: np.random.Generator) -> Modes:
    root = rng.normal(scale=0.2, size=(1, MODELS, STATE, STATE))
    cov = root @ np.swapaxes(root, 2, 3) + 0.02 * np.eye(STATE)
    return Modes(rng.normal(size=(1, MODELS, STATE)), cov, np.full((1, MODELS), 1.0 / MODELS))


def test_one_certain_detection_is_a_kalman_update_of_every_model() -> None:
    rng = np.random.default_rng(3)
    modes = certain(rng)
    value = modes.mean[0, 0, list(MEASURED)][None] + 0.05
    seen = Detections(0.0, value)
    found = updated(modes, sight(modes, seen, Settings()), np.ones((1, 1)))
    H = np.eye(STATE)[list(MEASURED)]
    for r in range(MODELS):
        P, x = modes.cov[0, r], modes.mean[0, r]
        S = H @ P @ H.T + np.diag(seen.noise**2)
        K = P @ H.T @ np.linalg.inv(S)
        off = value[0] - H @ x
        off[3] = (off[3] + np.pi / 2) % np.pi - np.pi / 2
        np.testing.assert_allclose(found.mean[0, r], x + K @ off, atol=1e-9)
        np.testing.assert_allclose(found.cov[0, r], P - K @ S @ K.T, atol=1e-9)


def test_not_seen_changes_nothing_and_a_doubtful_sight_little() -> None:
    rng = np.random.default_rng(4)
    modes = certain(rng)
    seen = Detections(0.0, modes.mean[0, 0, list(MEASURED)][None] + 0.05)
    found = sight(modes, seen, Settings())
    none = updated(modes, found, np.zeros((1, 1)))
    np.testing.assert_allclose(none.mean, modes.mean)
    np.testing.assert_allclose(none.cov, modes.cov)
    np.testing.assert_allclose(none.mode, modes.mode)
    half = updated(modes, found, np.full((1, 1), 0.5))
    sure = updated(modes, found, np.ones((1, 1)))
    assert (np.linalg.eigvalsh(half.cov) > 0.0).all()
    assert np.trace(half.cov[0, 0]) > np.trace(sure.cov[0, 0])


def test_a_box_turned_by_half_is_the_same_box() -> None:
    modes = certain(np.random.default_rng(5))
    value = modes.mean[0, 0, list(MEASURED)][None]
    turned = value.copy()
    turned[0, MEASURED.index(YAW)] += np.pi
    one, two = (sight(modes, Detections(0.0, v), Settings()) for v in (value, turned))
    np.testing.assert_allclose(one.likelihood, two.likelihood)


def test_a_crowd_of_twenty_is_followed() -> None:
    rng = np.random.default_rng(6)
    # 20 people on 2 square metres.
    places = 0.32 * np.stack(np.meshgrid(np.arange(5), np.arange(4)), axis=-1).reshape(-1, 2)
    result = Tracked(nothing(), 1, (), np.zeros((0, 0)))
    for k in range(15):
        seen = places + rng.normal(scale=0.03, size=places.shape)
        result = track(result.tracks, scan(0.1 * k, *seen), result.next_id)
    confirmed = result.tracks.status != Status.TENTATIVE
    assert 18 <= confirmed.sum() <= 20
    assert np.isfinite(now(result.tracks)[0]).all()
