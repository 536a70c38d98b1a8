"""What bears the machine, and how far its zero-moment point is from where it tips.

Two lines across the way bear it, each with a width: a rear wheel's, the step's edge, the crawler's
last line on the top, or the bucket's edge. Seen from above they span a quadrilateral. The lines may
lie at different heights; the zero-moment point is taken in the plane through both.
"""

from __future__ import annotations

import numpy as np

from backend.spatial.types import Array
from backend.stability.masses import GRAVITY


def margin(points: Array, lines: Array) -> Array:
    """(m,) signed distance of points (m, 2) to the edge of what two lines span, positive inside
    [m]. lines: (m, 2, 3): x, y of the middle, half width, the rear one first.
    """
    rear, front = lines[:, 0], lines[:, 1]
    corners = np.stack(
        [
            np.stack([rear[:, 0], rear[:, 1] - rear[:, 2]], axis=1),
            np.stack([front[:, 0], front[:, 1] - front[:, 2]], axis=1),
            np.stack([front[:, 0], front[:, 1] + front[:, 2]], axis=1),
            np.stack([rear[:, 0], rear[:, 1] + rear[:, 2]], axis=1),
        ],
        axis=1,
    )
    along = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(along, axis=-1)
    normal = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = ((points[:, None] - corners) * normal).sum(axis=-1) / length
    return np.asarray(np.where(length > 1e-9, left, np.inf).min(axis=1))


def zero_moment_points(centre: Array, acceleration: Array, lines_z: Array, lines_x: Array) -> Array:
    """(m, 2) x, y [m] of a mass at centre (m, 3) with acceleration (m, 3) [m/s^2]: where its wrench
    pierces the plane through the two lines that bear it. lines_z, lines_x: (m, 2) of these.
    """
    pull = np.array([0.0, 0.0, -GRAVITY]) - acceleration
    slope = (lines_z[:, 1] - lines_z[:, 0]) / (lines_x[:, 1] - lines_x[:, 0])
    # z = z_0 + slope (x - x_0) met by centre + t pull.
    over = centre[:, 2] - lines_z[:, 0] - slope * (centre[:, 0] - lines_x[:, 0])
    t = over / (slope * pull[:, 0] - pull[:, 2])
    return np.asarray(centre[:, :2] + t[:, None] * pull[:, :2])
