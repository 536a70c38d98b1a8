"""One scan: tracks and detections to the next tracks.

    predict every model → gate, associate, update → confirm, coast, give up → begin new tracks

Nobody disappears silently: a confirmed track that is given up is told as `Lost`, with its place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from backend.errors import InputError
from backend.spatial.types import Array, IntArray
from backend.tracking.association import associate
from backend.tracking.imm import Modes, ahead_of, born, foretold, mixture
from backend.tracking.motion import MODELS, Noise
from backend.tracking.records import (
    STATE,
    Detections,
    Lost,
    Settings,
    Status,
    Tracks,
)
from backend.tracking.tracker_kernel import SEEN, age
from backend.tracking.update import ratios, sight, updated

_LONGEST = 0.25  # [s] of one prediction
_NONE = np.zeros(0, np.int64)


class Tracked(NamedTuple):
    """tracks after a scan; next_id: of the next new one; lost: given up in this scan; share: (n, k)
    probability by track, as they were before births and losses, that a detection was its.
    """

    tracks: Tracks
    next_id: int
    lost: tuple[Lost, ...]
    share: Array


class _Aged(NamedTuple):
    """All tracks after a scan, indices of those that go on, and the confirmed ones that do not."""

    tracks: Tracks
    kept: IntArray
    lost: tuple[Lost, ...]


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
    after, kept, lost = _aged(tracks, seen.time, modes, share, settings)
    free = np.flatnonzero(share.sum(axis=0) < SEEN)
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
    return ahead_of(modes, tracks.seen < 2, horizon, noise)


def _aged(tracks: Tracks, time: float, modes: Modes, share: Array, settings: Settings) -> _Aged:
    """After a scan in which detections were each track's with probability `share` (n, k)."""
    mean, cov, mode = (np.ascontiguousarray(values, dtype=float) for values in modes)
    status, scans, seen, last, kept, lost, places = age(
        (mean, cov, mode),
        (tracks.status, tracks.scans, tracks.seen, tracks.last_seen, tracks.id),
        np.ascontiguousarray(share),
        time,
        (settings.confirm, settings.confirm_of),
        (settings.coast, settings.coast_tentative, settings.spread),
    )
    after = Tracks(time, mean, cov, mode, tracks.id, status, scans, seen, last)
    gone = tuple(
        Lost(int(tracks.id[i]), places[i], float(last[i]), time) for i in np.flatnonzero(lost)
    )
    return _Aged(after, np.flatnonzero(kept), gone)


def _begun(seen: Detections, free: IntArray, next_id: int, settings: Settings) -> Tracks:
    modes = born(seen.values[free], seen.measured, seen.noise, settings.born_speed)
    k = len(free)
    status = Status.CONFIRMED if settings.confirm == 1 else Status.TENTATIVE
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
