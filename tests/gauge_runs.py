"""Runs of the road-rail machine near limits, and their judges, for tests and campaigns."""

from __future__ import annotations

import numpy as np
from engines import Coal, Fcl, judged_by

from backend.machine.load import load_machine
from backend.planning import rail_site
from backend.planning.careless import careless_drive
from backend.planning.proximity import Limits
from backend.planning.records import Method, Settings
from backend.planning.simulate import Run, follow_path, run

RAIL = load_machine("rail6")
FOLLOWING = {
    "scaling": Settings(),
    "potential": Settings(gain=1e-3),
    # xi / (d_i - d_s) = 1 m/s / 0.6 m; joint speeds follow at once, as for the other two.
    "constrained": Settings(rate=1.0 / 0.6),
}
DRIVING = Settings(accelerations=True)


def ballast(method: Method | None, settings: Settings, extra: float = 1.0) -> Run:
    return follow_path(
        method, RAIL, rail_site.ballast_limits(), rail_site.ballast_path(), settings, extra
    )


def between(q: np.ndarray, parts: int = 2) -> np.ndarray:
    """Postures with parts - 1 more between any two that follow each other."""
    steps = np.arange(parts)[:, None] / parts
    return np.concatenate([q[:-1, None] + steps * np.diff(q, axis=0)[:, None]]).reshape(
        -1, q.shape[1]
    )


def contacts(q: np.ndarray, limits: Limits) -> tuple[int, int]:
    """At how many of the postures something touches: by python-fcl, by coal."""
    found = [judged_by(make, RAIL, q, limits.boxes).any(axis=1).sum() for make in (Fcl, Coal)]
    return int(found[0]), int(found[1])


def drive(seed: int, method: Method | None, seconds: float) -> tuple[Run, Limits]:
    """A careless drive with the machine's real accelerations; with a method, guarded."""
    plan = careless_drive(RAIL, seed, seconds)
    done = run(
        *(method, RAIL, plan.limits, plan.q_start, plan.wish, DRIVING, seconds),
        guarded=method is not None,
    )
    return done, plan.limits
