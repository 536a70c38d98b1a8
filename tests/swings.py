"""Swings and objects at random, and when they meet, step by step."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from backend.safety.swing_risk import Swing

END, DT = 8.0, 1e-3


def integrated(swing: Swing, place: np.ndarray, velocity: np.ndarray, clearance: float) -> float:
    """When the swing's line first comes within the clearance, by steps of DT; inf after END."""
    t = np.arange(0.0, END, DT)
    rate = swing.rate + swing.acceleration * t
    if swing.acceleration > 0.0:
        rate = np.minimum(rate, max(swing.fastest, swing.rate))
    elif swing.acceleration < 0.0:
        rate = np.maximum(rate, min(-swing.fastest, swing.rate))
    middle = 0.5 * (rate[1:] + rate[:-1])
    angle = swing.angle + np.concatenate([[0.0], np.cumsum(middle) * DT])
    far = np.hypot(*place)
    turning = (place[0] * velocity[1] - place[1] * velocity[0]) / far**2
    away = np.arctan2(place[1], place[0]) + turning * t - angle
    close = np.abs((away + np.pi) % (2 * np.pi) - np.pi) <= clearance / far
    return float(t[np.argmax(close)]) if close.any() else np.inf


def cases(count: int, seed: int) -> Iterator[tuple[Swing, np.ndarray, np.ndarray, float]]:
    rng = np.random.default_rng(seed)
    for _ in range(count):
        fastest = rng.uniform(0.3, 1.5)
        swing = Swing(
            rng.uniform(-np.pi, np.pi),
            rng.uniform(-fastest, fastest),
            rng.choice([0.0, rng.uniform(-1.0, 1.0)]),
            fastest,
            rng.uniform(0.3, 2.0),
        )
        far, at = rng.uniform(1.0, 9.0), rng.uniform(-np.pi, np.pi)
        place = far * np.array([np.cos(at), np.sin(at)])
        yield swing, place, rng.uniform(-2.0, 2.0, 2), rng.uniform(0.2, 1.0)


def grazes(swing: Swing, place: np.ndarray, velocity: np.ndarray, clearance: float) -> bool:
    """Whether a hair less or more of clearance decides."""
    both = [integrated(swing, place, velocity, clearance + off) for off in (-2e-3, 2e-3)]
    return abs(both[0] - both[1]) > 10 * DT or np.isinf(both[0]) != np.isinf(both[1])
