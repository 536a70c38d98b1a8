"""Stone Soup's tracker of the same detections: JPDA and unscented Kalman filters."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.dataassociator.probability import JPDA, JPDAwithEHM2
from stonesoup.deleter.error import CovarianceBasedDeleter
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.hypothesiser.probability import PDAHypothesiser
from stonesoup.initiator.simple import MultiMeasurementInitiator
from stonesoup.measures import Mahalanobis
from stonesoup.models.measurement.linear import LinearGaussian
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
)
from stonesoup.predictor.kalman import UnscentedKalmanPredictor
from stonesoup.tracker.simple import MultiTargetMixtureTracker
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.types.track import Track
from stonesoup.types.update import Update
from stonesoup.updater.kalman import UnscentedKalmanUpdater

from backend.tracking.records import Detections

EPOCH = datetime(2021, 1, 1)
COAST = 3.0
"""How long a track is kept unseen [s], as ours."""


class Seen(NamedTuple):
    """ids: (n,); places: (n, 2) where tracks are, ahead: (n, 2) in a second [m]."""

    ids: np.ndarray
    places: np.ndarray
    ahead: np.ndarray


class _Unseen(CovarianceBasedDeleter):
    """Who has not been seen for COAST."""

    def check_for_deletion(
        self, track: Track, timestamp: datetime | None = None, **_: object
    ) -> bool:
        updates = [state for state in track[-40:] if isinstance(state, Update)]
        if not updates:
            return True
        return bool((track.timestamp - updates[-1].timestamp).total_seconds() > COAST)


def measurement(sigma: float) -> LinearGaussian:
    return LinearGaussian(4, (0, 2), np.diag([sigma**2, sigma**2]))


def motion(density: float) -> CombinedLinearGaussianTransitionModel:
    return CombinedLinearGaussianTransitionModel([ConstantVelocity(density)] * 2)


def hypothesiser(density: float, detected: float, clutter: float, gate: float) -> PDAHypothesiser:
    return PDAHypothesiser(
        UnscentedKalmanPredictor(motion(density)),
        UnscentedKalmanUpdater(None),
        clutter_spatial_density=clutter,
        prob_detect=detected,
        prob_gate=gate,
    )


def followed(
    scans: Iterable[Detections],
    sigma: float = 0.06,
    density: float = 0.5,
    detected: float = 0.95,
    clutter: float = 1e-3,
) -> list[Seen]:
    """Tracks after each scan, of the same settings as ours. Only x and y are used."""
    model = measurement(sigma)
    predictor, updater = UnscentedKalmanPredictor(motion(density)), UnscentedKalmanUpdater(None)
    nearest = GNNWith2DAssignment(
        DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=4.3)
    )
    deleter = _Unseen(covar_trace_thresh=1e9)
    initiator = MultiMeasurementInitiator(
        GaussianState([[0.0]] * 4, np.diag([0.0, 1.5**2, 0.0, 1.5**2])),
        CovarianceBasedDeleter(covar_trace_thresh=4.0),
        nearest,
        updater,
        measurement_model=model,
        min_points=3,
    )
    given = [(at(scan.time), detections(scan, model)) for scan in scans]
    joint = JPDAwithEHM2(hypothesiser(density, detected, clutter, 0.9999))
    tracker = MultiTargetMixtureTracker(initiator, deleter, given, joint, updater)
    numbers: dict[str, int] = {}
    found = []
    for _, tracks in tracker:
        rows = []
        for one in sorted(tracks, key=lambda t: t.id):
            x = np.asarray(one.state_vector, dtype=float).ravel()
            rows.append([numbers.setdefault(one.id, len(numbers) + 1), x[0], x[2], x[1], x[3]])
        table = np.array(rows).reshape(-1, 5)
        found.append(Seen(table[:, 0].astype(int), table[:, 1:3], table[:, 1:3] + table[:, 3:]))
    return found


def detections(scan: Detections, model: LinearGaussian) -> set[Detection]:
    places = scan.values[:, :2]
    return {Detection([[x], [y]], at(scan.time), measurement_model=model) for x, y in places}


def at(time: float) -> datetime:
    return EPOCH + timedelta(seconds=time)


def shares(
    places: np.ndarray, speeds: np.ndarray, seen: np.ndarray, detected: float = 0.9
) -> tuple[np.ndarray, np.ndarray]:
    """Of tracks (n, 2), (n, 2) and detections (k, 2) a tenth of a second later: each pair's ratio
    as `associate` takes it, (n, k), and Stone Soup's JPDA probabilities, (n, k).
    """
    model = measurement(0.1)
    cov = np.diag([0.04, 0.5, 0.04, 0.5])
    tracks = [
        Track([GaussianState([[p[0]], [v[0]], [p[1]], [v[1]]], cov, at(0.0))])
        for p, v in zip(places, speeds, strict=True)
    ]
    given = [Detection([[x], [y]], at(0.1), measurement_model=model) for x, y in seen]
    judge = hypothesiser(0.5, detected, 0.01, 0.999)
    judge.normalise = False
    ratio, share = np.zeros((len(tracks), len(seen))), np.zeros((len(tracks), len(seen)))
    associated = JPDA(judge).associate(tracks, given, at(0.1))
    for i, one in enumerate(tracks):
        single = judge.hypothesise(one, given, at(0.1))
        missed = next(float(h.probability) for h in single if not h)
        for hypotheses, out, least in ((single, ratio, missed), (associated[one], share, 1.0)):
            for h in hypotheses:
                if h:
                    j = next(k for k, d in enumerate(given) if d is h.measurement)
                    out[i, j] = float(h.probability) / least
    return ratio, share
