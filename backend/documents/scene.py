"""A state document's machines, placed: what `assess` and `cspace` work on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.documents.state import (
    MachineStateDocument,
    StateDocument,
    joint_vector,
    velocity_vector,
)
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.fusion.inflation import spread
from backend.fusion.pose import FusedPose, Validity
from backend.fusion.samples import Fix
from backend.machine.model import Machine
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import Body3D
from backend.pipeline.surroundings import Surroundings, surroundings
from backend.site.gauge_in_force import left_out, own_tracks
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array


@dataclass(frozen=True)
class Scene:
    """origin: (3,) of the frame in which all of it stands, in the document's frame [m]; site: what
    does not move.
    """

    machines: dict[str, Machine]
    poses: dict[str, FusedPose]
    placed: dict[str, Body3D]
    origin: Array
    site: SiteBodies

    def around(self, own: str) -> Surroundings:
        """All that the machine `own` can touch, in its root frame, but the track it stands on."""
        others = {n: (self.machines[n], body) for n, body in self.placed.items() if n != own}
        pose = self.poses[own]
        site = left_out(self.site, own_tracks(self.site, pose.position, pose.yaw))
        return surroundings(self.machines[own], self.placed[own], others, site)

    def eta(self, own: str) -> float:
        """3 sigma of the bodies of `own` and of the least certain other machine together [m]."""
        wrong = {name: spread(self.machines[name], pose) for name, pose in self.poses.items()}
        others = [value for name, value in wrong.items() if name != own]
        return wrong[own] + max(others, default=0.0)

    def slack(self, own: str) -> Array:
        """(n,) 3 sigma of the joints of `own` [rad]."""
        return np.asarray(3.0 * self.poses[own].joint_sigmas)


def make_scene(
    state: StateDocument,
    machines: dict[str, Machine],
    frame: SiteFrame | None,
    where: str,
    site: SiteBodies = NO_SITE_BODIES,
) -> Scene:
    """machines: the description of every machine of the document; site: what stands on the site
    besides the document's obstacles, in the site frame of `frame`. Raises InputError.
    """
    origin = _origin(state, frame)
    poses = {
        name: _pose(name, document, machines[name], state.time, origin, where)
        for name, document in state.machines.items()
    }
    placed = {
        name: place(machines[name], pose.joints, base_transform(pose))
        for name, pose in poses.items()
    }
    n = len(state.obstacles)
    obstacles = Boxes(
        np.array([o.center for o in state.obstacles]).reshape(n, 3) - origin,
        np.array([o.rotation for o in state.obstacles]).reshape(n, 3, 3),
        np.array([o.half_extents for o in state.obstacles]).reshape(n, 3),
    )
    bodies = replace(
        site,
        boxes=concatenated([site.boxes, obstacles]),
        names=(*site.names, *(o.name for o in state.obstacles)),
    )
    return Scene(machines, poses, placed, origin, bodies)


def _origin(state: StateDocument, frame: SiteFrame | None) -> Array:
    """What is subtracted from the document's positions, so that arithmetic is on small numbers."""
    if state.frame == "site":
        return np.zeros(3)
    if frame is not None:
        return np.array(frame.origin)
    first = next(iter(state.machines.values()))
    return np.array([np.floor(first.position[0]), np.floor(first.position[1]), 0.0])


def _pose(
    name: str,
    document: MachineStateDocument,
    machine: Machine,
    time: float,
    origin: Array,
    where: str,
) -> FusedPose:
    field = f"{where}: machines.{name}"
    position = np.array(document.position) - origin
    if float(np.abs(position).max()) > 1e6:
        raise InputError(
            f"{field}.position is {list(document.position)}; allowed is within 1000 km of the "
            "site's origin, in the site's projected CRS (or give the frame as site)."
        )
    return FusedPose(
        machine=name,
        time=time,
        validity=Validity.VALID,
        reasons=(),
        position=position,
        yaw=document.yaw,
        pitch=document.pitch,
        roll=document.roll,
        joints=joint_vector(machine, document.joints, f"{field}.joints"),
        joint_velocities=velocity_vector(
            machine, document.joint_velocities, f"{field}.joint_velocities"
        ),
        base_velocity=np.zeros(3),
        sigma_position=document.sigma.position,
        sigma_yaw=document.sigma.yaw,
        sigma_joints=document.sigma.joints,
        fix=Fix.RTK_FIXED,
        streams={},
        clock_offset=None,
    )
