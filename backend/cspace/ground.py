"""The ground as an obstacle: a thick slab below the plane on which the tracks stand."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Machine
from backend.spatial.boxes import Boxes

GROUND = "ground"
"""The name of its layer."""


def ground_under(machine: Machine) -> Boxes:
    """One box in the machine's root frame, its top at z = 0, wider than the machine reaches.

    The tracks stand on it: it counts for what moves with a joint only.
    """
    reach = machine.bounding_radius + float(np.linalg.norm(machine.arm.T_root_swing[:3, 3]))
    return Boxes(np.array([[0.0, 0.0, -reach]]), np.eye(3)[None], np.full((1, 3), reach))
