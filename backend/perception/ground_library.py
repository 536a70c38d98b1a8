"""The ground plane by scikit-learn's RANSAC: an alternative to `ground`, to compare it with.

An optional extra of the project: pip install 'excavator-cockpit[ground]'.
"""

from __future__ import annotations

import numpy as np

from backend.errors import InputError
from backend.perception.ground import STEEPEST, Plane
from backend.spatial.types import Array

_LEAST = 50  # points on a ground


def find_ground_by_library(
    points: Array, tolerance: float = 0.1, seed: int = 0, where: str = "ground"
) -> Plane | None:
    """As `ground.find_ground`, with heights over the plan as what is fitted.

    points: (n, 3), z up [m]; where: named in errors. Raises InputError when scikit-learn is not
    installed.
    """
    try:
        from sklearn.linear_model import RANSACRegressor
    except ImportError:
        raise InputError(
            f"{where}: scikit-learn is not installed; "
            "pip install 'excavator-cockpit[ground]' adds it."
        ) from None
    if len(points) < _LEAST:
        return None
    steepest = np.tan(STEEPEST)
    search = RANSACRegressor(
        residual_threshold=tolerance,
        is_model_valid=lambda model, *_: bool(np.hypot(*model.coef_) <= steepest),
        max_trials=200,
        stop_probability=0.9999,
        random_state=seed,
    )
    try:
        search.fit(points[:, :2], points[:, 2])
    except ValueError:  # no plane that is level enough has any points
        return None
    a, b = (float(value) for value in search.estimator_.coef_)
    normal = np.array([-a, -b, 1.0]) / np.sqrt(a * a + b * b + 1.0)
    plane = Plane(normal, float(search.estimator_.intercept_) * normal[2], 0.0)
    on = np.abs(plane.heights(points)) <= tolerance
    if on.sum() < _LEAST or np.hypot(a, b) > steepest:
        return None
    return Plane(plane.normal, plane.offset, float(on.mean()))
