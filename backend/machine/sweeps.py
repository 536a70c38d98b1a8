"""The sidecar's hydraulic cylinders as triangles on the links that carry their bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.machine.bodies import Progress
from backend.machine.chain import joints_between, root_poses
from backend.machine.cylinders import SAMPLES, Cylinder, swept_triangles
from backend.machine.cylinders_read import read_cylinder
from backend.machine.expand import find_mesh
from backend.machine.meshes import mesh_triangles
from backend.machine.model import Joint, Link
from backend.machine.sidecar import Sidecar
from backend.spatial.types import Array


def cylinders_of(
    links: tuple[Link, ...],
    joints: tuple[Joint, ...],
    side: Sidecar,
    robot_file: Path,
    side_file: str,
) -> tuple[tuple[Cylinder, int], ...]:
    """The sidecar's cylinders, each with the one joint that moves it. Raises InputError."""

    def load_mesh(uri: str) -> Array:
        return mesh_triangles(find_mesh(uri, robot_file.parent, side_file))

    found: list[tuple[Cylinder, int]] = []
    index = {link.name: i for i, link in enumerate(links)}
    for table in side.cylinder:
        cylinder = read_cylinder(table, load_mesh, side_file)
        for name in cylinder.links:
            if name not in index:
                raise InputError(
                    f"{side_file}: cylinder {cylinder.name}: link '{name}' is not a link of the "
                    f"robot; its links are {', '.join(index)}."
                )
        between = joints_between(links, [index[name] for name in cylinder.links])
        found.append((cylinder, _moved_by(cylinder, between, joints, side_file)))
    return tuple(found)


def swept_by_cylinders(
    links: tuple[Link, ...],
    joints: tuple[Joint, ...],
    cylinders: tuple[tuple[Cylinder, int], ...],
    side_file: str,
    progress: Progress | None,
) -> dict[int, Array]:
    """link index -> triangles (n, 3, 3) [m], in its frame, swept over the joints' whole ranges.

    cylinders: those of `cylinders_of`; the ones of which only the pins are stated sweep nothing.
    """
    swept: dict[int, list[Array]] = {}
    index = {link.name: i for i, link in enumerate(links)}
    for k, (cylinder, joint) in enumerate(cylinders):
        if progress is not None:
            progress("sweeping cylinders", k / len(cylinders))
        if not cylinder.has_bodies:
            continue
        q = np.zeros((SAMPLES, len(joints)))
        q[:, joint] = np.linspace(joints[joint].lower, joints[joint].upper, SAMPLES)
        T_root = root_poses(links, q)
        poses = {
            name: np.broadcast_to(T_root[index[name]], (SAMPLES, 4, 4)) for name in cylinder.links
        }
        try:
            triangles = swept_triangles(cylinder, poses)
        except ValueError as error:
            raise InputError(f"{side_file}: cylinder {cylinder.name}: {error}.") from None
        swept.setdefault(index[cylinder.carried_by], []).append(triangles)
    return {i: np.concatenate(parts) for i, parts in swept.items()}


def _moved_by(
    cylinder: Cylinder, between: list[int], joints: tuple[Joint, ...], side_file: str
) -> int:
    if len(between) != 1 or joints[between[0]].continuous:
        names = ", ".join(joints[k].name for k in between) or "none"
        raise InputError(
            f"{side_file}: cylinder {cylinder.name}: one joint with limits must lie between "
            f"{', '.join(cylinder.links)}; found {names}."
        )
    return between[0]
