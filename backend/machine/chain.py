"""Links before they are a Machine: poses and ancestry, for the few places that build one."""

from __future__ import annotations

import numpy as np

from backend.machine.model import Link
from backend.spatial import rotation, transform
from backend.spatial.types import Array


def root_poses(links: tuple[Link, ...], q: Array) -> list[Array]:
    """T_root_link (..., 4, 4) of every link, for joint values q (..., n) [rad].

    `kinematics.link_poses` does the same fast for a finished Machine.
    """
    T_root: list[Array] = []
    for link in links:
        T = link.T_parent_joint
        if link.joint >= 0:
            R = rotation.about_axis(link.axis, q[..., link.joint])
            T = T @ transform.make(R, np.zeros(3))
        T_root.append(T if link.parent < 0 else T_root[link.parent] @ T)
    return T_root


def joints_between(links: tuple[Link, ...], some: list[int]) -> list[int]:
    """The actuated joints that move the links `some` against each other, in joint order."""
    paths: list[set[int]] = []
    for i in some:
        path: set[int] = set()
        while i >= 0:
            if links[i].joint >= 0:
                path.add(links[i].joint)
            i = links[i].parent
        paths.append(path)
    everywhere = {k for k in paths[0] if all(k in path for path in paths)}
    return sorted({k for path in paths for k in path} - everywhere)
