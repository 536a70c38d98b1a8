"""LiDARs on a machine: where the sidecar mounts them, and where that is."""

from __future__ import annotations

import numpy as np

from backend.errors import InputError
from backend.machine.model import LidarMount, Link, Machine
from backend.machine.sidecar import LidarTable
from backend.spatial import rotation, transform
from backend.spatial.types import Array, frozen


def mounts(
    links: tuple[Link, ...], stated: tuple[LidarTable, ...], file: str
) -> tuple[LidarMount, ...]:
    """The LiDARs of a sidecar, in its order. Raises InputError for two of one name."""
    names = [table.name for table in stated]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"{file}: lidar: two are called '{name}'; allowed is a name of its own for each."
            )
    upper = next(i for i, link in enumerate(links) if link.joint == 0)
    return tuple(_mount(table, {"base": 0, "upper": upper}[table.link]) for table in stated)


def _mount(table: LidarTable, link: int) -> LidarMount:
    roll, pitch, yaw = np.radians(table.rpy_deg)
    R = rotation.rz(yaw) @ rotation.ry(pitch) @ rotation.rx(roll)
    T = frozen(transform.make(R, np.array(table.xyz)), (4, 4), "T_link_sensor")
    return LidarMount(
        table.name, link, T, frozen(np.radians(table.elevations_deg), (None,), "elevations")
    )


def mount_called(machine: Machine, name: str) -> LidarMount | None:
    """The machine's LiDAR of that name, as clouds tell it; None when it has none."""
    return next((mount for mount in machine.lidars if mount.name == name), None)


def sensor_pose(machine: Machine, mount: LidarMount, T_site_links: Array) -> Array:
    """T_site_sensor (..., 4, 4). mount: one of machine.lidars; T_site_links: (..., L, 4, 4), the
    machine's link poses. Raises ValueError for the links of another machine.
    """
    if T_site_links.shape[-3:] != (len(machine.links), 4, 4):
        raise ValueError(f"{machine.name} has {len(machine.links)} links, not {T_site_links.shape}")
    return np.asarray(T_site_links[..., mount.link, :, :] @ mount.T_link_sensor)
