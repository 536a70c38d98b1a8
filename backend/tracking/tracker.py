"""One scan: tracks and detections to the next tracks.

    predict every model → gate, associate, update → confirm, coast, give up → begin new tracks

Nobody disappears silently: a confirmed track that is given up is told as `Lost`, with its place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array, BoolArray, IntArray
from backend.tracking.association import associate
from backend.tracking.imm import STEPS_AHEAD, Modes, ahead, born, foretold, mixture
from backend.tracking.motion import MODELS, Noise
from backend.tracking.records import (
    PX,
    PY,
    PZ,
    STATE,
    Detections,
    Lost,
    Settings,
    Status,
    Tracks,
)
from backend.tracking.update import ratios, sight, updated

_SEEN = 0.5  # probability above which a track counts as detected, or a detection as somebody's
_SAME = 0.15  # tracks whose means are nearer than this are one [m]
_LONGEST = 0.25  # [s] of one prediction
_NONE = np.zeros(0, np.int64)
_TENTATIVE, _CONFIRMED, _COASTING = (int(status) for status in Status)


class Tracked(NamedTuple):
    """tracks after a scan; next_id: of the next new one; lost: given up in this scan; share: (n, k)
    probability by track, as they were before births and losses, that a detection was its.
    """

    tracks: Tracks
    next_id: int
    lost: tuple[Lost, ...]
    share: Array


def nothing(time: float = -math.inf) -> Tracks:
    """No tracks."""
    return Tracks(
        time,
        np.zeros((0, MODELS, STATE)),
        np.zeros((0, MODELS, STATE, STATE)),
        np.zeros((0, MODELS)),
        id=_NONE,
        status=_NONE,
        scans=_NONE,
        seen=_NONE,
        last_seen=np.zeros(0),
    )


def track(
    tracks: Tracks,
    seen: Detections,
    next_id: int = 1,
    settings: Settings | None = None,
    noise: Noise | None = None,
) -> Tracked:
    """The tracks after one scan. Raises InputError when its time is before the last one's."""
    settings, noise = settings or Settings(), noise or Noise()
    if seen.time < tracks.time:
        raise InputError(
            f"tracking: a scan at {seen.time:.3f} s comes after one at {tracks.time:.3f} s; "
            "scans must be in the order of their times."
        )
    modes = predict(tracks, seen.time, noise)
    k = len(seen.values)
    share = np.zeros((len(tracks), k))
    if len(tracks) and k:
        found = sight(modes, seen, settings)
        share = associate(ratios(modes, found, seen, settings)).share
        modes = updated(modes, found, share)
    hit = share.sum(axis=1) > _SEEN
    after = _aged(tracks, seen.time, modes, hit, settings)
    kept, lost = _kept(after, settings)
    free = np.flatnonzero(share.sum(axis=0) < _SEEN)
    all_tracks = _joined(_taken(after, kept), _begun(seen, free, next_id, settings))
    return Tracked(all_tracks, next_id + len(free), lost, share)


def predict(tracks: Tracks, time: float, noise: Noise | None = None) -> Modes:
    """The modes at a later time [s]."""
    noise = noise or Noise()
    modes = Modes(tracks.mean, tracks.cov, tracks.mode)
    if not len(tracks):
        return modes
    dt = time - tracks.time
    steps = math.ceil(dt / _LONGEST)
    return foretold(modes, dt / steps, noise, steps) if steps else modes


def now(tracks: Tracks) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) mean and covariance of each track."""
    return mixture(Modes(tracks.mean, tracks.cov, tracks.mode))


def later(tracks: Tracks, horizon: float, noise: Noise | None = None) -> tuple[Array, Array]:
    """(n, 11), (n, 11, 11) where the tracks will be after `horizon` [s] (Rasul 2021: 1 s).

    Who was seen once has no speed yet, and is foretold in one step: models that begin alike need
    not change on the way.
    """
    noise = noise or Noise()
    modes = Modes(tracks.mean, tracks.cov, tracks.mode)
    if not len(tracks):
        return mixture(modes)
    once = tracks.seen < 2
    if not once.any():
        return ahead(modes, horizon, noise)
    mean, cov = np.empty((len(tracks), STATE)), np.empty((len(tracks), STATE, STATE))
    for which, steps in ((once, 1), (~once, STEPS_AHEAD)):
        some = np.flatnonzero(which)
        if len(some):
            picked = Modes(*(values[some] for values in modes))
            mean[some], cov[some] = ahead(picked, horizon, noise, steps)
    return mean, cov


def _aged(tracks: Tracks, time: float, modes: Modes, hit: BoolArray, settings: Settings) -> Tracks:
    scans, seen = tracks.scans + 1, tracks.seen + hit
    sure = (tracks.status != _TENTATIVE) | (seen >= settings.confirm)
    status = np.where(sure, np.where(hit, _CONFIRMED, _COASTING), _TENTATIVE)
    last = np.where(hit, time, tracks.last_seen)
    return Tracks(
        time, modes.mean, modes.cov, modes.mode, tracks.id, status, scans, seen, last,
    )  # fmt: skip


def _kept(tracks: Tracks, settings: Settings) -> tuple[IntArray, tuple[Lost, ...]]:
    """Indices of the tracks that go on, and the confirmed ones that do not."""
    if not len(tracks):
        return np.zeros(0, np.int64), ()
    mean, cov = now(tracks)
    tentative = tracks.status == _TENTATIVE
    unseen = tracks.time - tracks.last_seen
    too_long = unseen > np.where(tentative, settings.coast_tentative, settings.coast) + 1e-9
    unsure = tentative & (tracks.scans >= settings.confirm_of)
    vague = np.sqrt(np.maximum(cov[:, PX, PX], cov[:, PY, PY])) > settings.spread
    twice = _twice(tracks, mean)
    gone = too_long | unsure | vague | twice
    lost = tuple(
        Lost(int(tracks.id[i]), mean[i, [PX, PY, PZ]], float(tracks.last_seen[i]), tracks.time)
        for i in np.flatnonzero(gone & ~tentative & ~twice)
    )
    return np.flatnonzero(~gone), lost


def _twice(tracks: Tracks, mean: Array) -> BoolArray:
    """(n,) tracks that follow what an older one follows."""
    x, y = mean[:, PX], mean[:, PY]
    near = np.hypot(x[:, None] - x, y[:, None] - y) < _SAME
    younger = tracks.id[:, None] > tracks.id
    return np.asarray((near & younger).any(axis=1) & (tracks.status == _TENTATIVE))


def _begun(seen: Detections, free: IntArray, next_id: int, settings: Settings) -> Tracks:
    modes = born(seen.values[free], seen.measured, seen.noise, settings.born_speed)
    k = len(free)
    status = _CONFIRMED if settings.confirm == 1 else _TENTATIVE
    return Tracks(
        seen.time,
        *modes,
        next_id + np.arange(k),
        np.full(k, status, np.int64),
        np.ones(k, np.int64),
        np.ones(k, np.int64),
        np.full(k, seen.time),
    )


def _taken(tracks: Tracks, index: IntArray) -> Tracks:
    if len(index) == len(tracks):
        return tracks
    return Tracks(tracks.time, *(getattr(tracks, name)[index] for name in _FIELDS))


def _joined(first: Tracks, second: Tracks) -> Tracks:
    if not len(second):
        return first
    return Tracks(
        second.time,
        *(np.concatenate([getattr(first, name), getattr(second, name)]) for name in _FIELDS),
    )


_FIELDS = ("mean", "cov", "mode", "id", "status", "scans", "seen", "last_seen")
