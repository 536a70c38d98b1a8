"""People whose ways are hard to tell apart: they cross, walk side by side, crowd, hide each other.

Detections are drawn, not ray-cast: places with noise, of who is in sight with a given probability,
among false ones; so that every tracker is judged by association alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.tracking.records import PX, PY, Detections

PERIOD, SECONDS = 0.1, 20.0
SIGMA, DETECTED, CLUTTER = 0.06, 0.95, 1e-3  # [m], [-], false detections per square metre
AROUND = 12.0  # half the side of the square in which false ones are [m]
BODY = 0.4  # nearest that two people's middles come [m]
KINDS = ("crossing", "parallel", "crowded", "occluded")


class Ways(NamedTuple):
    """places: (t, n, 2) of n people by scan [m]; scans: what is detected of them."""

    places: np.ndarray
    scans: tuple[Detections, ...]


def ways(kind: str, seed: int) -> Ways:
    """crossing: four people meet in one point within half a second; parallel: two pairs side by
    side, 0.7 m apart; crowded: eight people wander within 6 x 6 m; occluded: two pass behind a
    third who stands near the sensor in the origin, for one to two seconds each.
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, SECONDS, PERIOD)
    places = {"crossing": _crossing, "parallel": _parallel, "crowded": _crowded}.get(
        kind, _occluded
    )(t, rng)
    scans = []
    for k, time in enumerate(t):
        there = places[k]
        in_sight = _in_sight(there) if kind == "occluded" else np.ones(len(there), dtype=bool)
        seen = there[in_sight & (rng.random(len(there)) < DETECTED)]
        seen = seen + rng.normal(scale=SIGMA, size=seen.shape)
        false = rng.uniform(-AROUND, AROUND, (rng.poisson(CLUTTER * (2 * AROUND) ** 2), 2))
        values = rng.permutation(np.concatenate([seen, false]))
        scans.append(Detections(float(time), values, (PX, PY), np.full(2, SIGMA)))
    return Ways(places, tuple(scans))


def _crossing(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    angles = rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, 0.7, 1.9, 3.0])
    speed = rng.uniform(0.8, 1.3, 4)
    when = 0.5 * SECONDS + rng.uniform(-0.25, 0.25, 4)
    along = (t[:, None] - when) * speed
    return np.stack([along * np.cos(angles), along * np.sin(angles)], axis=-1)


def _parallel(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    out = []
    for middle, speed in ((2.5, 0.9), (-2.5, -1.1)):
        phase = rng.uniform(0.0, 2.0 * np.pi)
        for side in (0.35, -0.35):
            y = middle + side + 0.2 * np.sin(0.5 * t + phase)
            out.append(np.stack([speed * (t - 0.5 * SECONDS), y], axis=-1))
    return np.stack(out, axis=1)


def _crowded(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Each about a place of its own, all places 1.6 m apart, by up to 1.2 m: they do meet, but none
    walks through another.
    """
    out: list[np.ndarray] = []
    while len(out) < 8:
        home = 1.6 * np.array([len(out) % 3 - 1, len(out) // 3 - 1])
        w, phase = rng.uniform(0.3, 0.9, 2), rng.uniform(0.0, 2.0 * np.pi, 2)
        way = home + 1.2 * np.sin(t[:, None] * w + phase)
        if all(np.linalg.norm(way - other, axis=1).min() > BODY for other in out):
            out.append(way)
    return np.stack(out, axis=1)


def _occluded(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    one = np.stack([1.0 * (t - 0.5 * SECONDS), np.full(len(t), 6.0)], axis=-1)
    other = np.stack([-0.8 * (t - 0.45 * SECONDS), np.full(len(t), 7.5)], axis=-1)
    still = np.tile([rng.uniform(-0.5, 0.5), 3.0], (len(t), 1))
    return np.stack([one, other, still], axis=1)


def _in_sight(places: np.ndarray, radius: float = 0.25) -> np.ndarray:
    """(n,) whom nobody nearer hides from the origin."""
    far = np.linalg.norm(places, axis=1)
    at = np.arctan2(places[:, 1], places[:, 0])
    wide = np.arcsin(np.minimum(radius / np.maximum(far, 1e-9), 1.0))
    off = np.abs((at[:, None] - at[None] + np.pi) % (2.0 * np.pi) - np.pi)
    hidden = (off < wide[None]) & (far[None] < far[:, None] - 0.1)
    return ~hidden.any(axis=1)
