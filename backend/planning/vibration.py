"""How much a velocity signal vibrates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.spatial.types import Array


class Vibration(NamedTuple):
    """reversals: sign changes of the joints' accelerations beyond the dead band, all joints.
    sign_changes: of the joints' speeds beyond theirs. energy: sum over the joints of the speeds'
    energy above the cut-off frequency [rad^2/s].
    """

    sign_changes: int
    reversals: int
    energy: float


def vibration(rates: Array, dt: float, cut_off: float = 2.0, dead_band: float = 2e-3) -> Vibration:
    """Of joint rates (m, n) [rad/s], one row every dt [s].

    cut_off [Hz]: what is slower belongs to the motion. dead_band [rad/s]: speeds, and changes of
    speed from step to step, below it count as none.
    """
    spectrum = np.fft.rfft(rates - rates.mean(axis=0), axis=0)
    high = np.fft.rfftfreq(len(rates), dt) > cut_off
    # Parseval: each one-sided bin stands for two.
    energy = 2.0 * float((np.abs(spectrum[high]) ** 2).sum()) * dt / len(rates)
    return Vibration(
        _changes(rates, dead_band), _changes(np.diff(rates, axis=0), dead_band), energy
    )


def _changes(values: Array, dead_band: float) -> int:
    count = 0
    for column in values.T:
        signs = np.sign(column[np.abs(column) > dead_band])
        count += int((signs[1:] != signs[:-1]).sum())
    return count
