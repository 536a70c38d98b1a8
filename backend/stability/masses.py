"""What moves together and how heavy it is: the machine as the few rigid bodies its joints leave.

Nothing is concluded from masses that nobody vouches for: `why_unknown` says so in words.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.spatial.types import Array, BoolArray, IntArray, frozen

GRAVITY = 9.81
"""[m/s^2]."""


@dataclass(frozen=True)
class MassModel:
    """B rigid bodies, parents first: body 0 stands on the ground, each other is moved by one joint.

    parents, joints: (B,) of each body, -1 for body 0; T_parent_joint: (B, 4, 4) of its frame in its
    parent's at joint value 0 (body 0: in the root frame); axes: (B, 3) unit, in its own frame;
    masses: (B,) [kg]; coms: (B, 3) [m]; tensors: (B, 3, 3) about the com [kg m^2], in its frame.
    payload: the point mass among them [kg].
    """

    parents: IntArray
    joints: IntArray
    T_parent_joint: Array
    axes: Array
    masses: Array
    coms: Array
    tensors: Array
    payload: float

    @cached_property
    def tree(self) -> tuple[IntArray, IntArray]:
        """(B,) parents and joints, as kernels take them."""
        return self.parents, self.joints

    @cached_property
    def frames(self) -> tuple[Array, Array, Array]:
        """(B, 3, 3) and (B, 3) of each body in its parent's at joint value 0, and (B, 3) axes."""
        T = self.T_parent_joint
        return np.ascontiguousarray(T[:, :3, :3]), np.ascontiguousarray(T[:, :3, 3]), self.axes

    @cached_property
    def carried(self) -> BoolArray:
        """(B,) whether a joint beyond the swing moves the body."""
        moved = np.zeros(len(self.masses), dtype=bool)
        for b, above in enumerate(self.parents.tolist()):  # parents come first
            moved[b] = self.joints[b] > 0 or (above >= 0 and moved[above])
        return moved

    @property
    def total(self) -> float:
        """Mass of everything [kg]."""
        return float(self.masses.sum())


def why_unknown(machine: Machine) -> str:
    """Why the masses of `machine` say nothing, in words; empty when they are known."""
    if not machine.masses_trusted:
        return f"the masses of {machine.name} are not trusted"
    shown = set(machine.body_links)
    for i, link in enumerate(machine.links):
        if link.inertia is None and (i in shown or link.visuals):
            return f"link '{link.name}' of {machine.name} has a body but no mass"
        if link.inertia is not None and not _plausible(link.inertia.mass, link.inertia.tensor):
            return f"link '{link.name}' of {machine.name} has no positive mass"
    return ""


def mass_model(machine: Machine, payload: float = 0.0, at: Array | None = None) -> MassModel:
    """The rigid bodies of `machine` that carries `payload` [kg] as a point mass.

    at: (3,) where it hangs, in the frame of links[end_link] [m]; the end point when None, than
    which no load in the bucket lies farther out. Raises InputError when the masses are not known
    or the payload is no mass.
    """
    why = why_unknown(machine)
    if why:
        raise InputError(f"{why}; tipping over cannot be judged, only with masses_trusted = true.")
    if not (np.isfinite(payload) and payload >= 0.0):
        raise InputError(f"payload = {payload} kg: a finite number, 0 or more, is allowed.")
    group, T_group_link = rigid_groups(machine)
    heads = [0, *(i for i, link in enumerate(machine.links) if link.joint >= 0)]
    count = len(heads)
    masses = np.zeros(count)
    moments = np.zeros((count, 3))
    about_origin = np.zeros((count, 3, 3))

    def add(b: int, mass: float, com: Array, tensor: Array) -> None:
        masses[b] += mass
        moments[b] += mass * com
        about_origin[b] += tensor + mass * _parallel(com)

    for i, link in enumerate(machine.links):
        if link.inertia is not None:
            R, p = T_group_link[i, :3, :3], T_group_link[i, :3, 3]
            add(
                group[i],
                link.inertia.mass,
                R @ link.inertia.com + p,
                R @ link.inertia.tensor @ R.T,
            )
    end = machine.end_link
    point = machine.end_point if at is None else frozen(at, (3,), "at")
    add(
        group[end],
        float(payload),
        T_group_link[end, :3, :3] @ point + T_group_link[end, :3, 3],
        np.zeros((3, 3)),
    )
    coms = moments / np.maximum(masses, 1e-300)[:, None]
    tensors = about_origin - masses[:, None, None] * np.stack([_parallel(com) for com in coms])
    links = machine.links
    above = [links[i].parent for i in heads]
    return MassModel(
        parents=np.array([group[p] if p >= 0 else -1 for p in above], dtype=np.int64),
        joints=np.array([links[i].joint for i in heads], dtype=np.int64),
        T_parent_joint=np.stack(
            [
                (np.eye(4) if p < 0 else T_group_link[p]) @ links[i].T_parent_joint
                for i, p in zip(heads, above, strict=True)
            ]
        ),
        axes=np.stack([links[i].axis / np.linalg.norm(links[i].axis) for i in heads]),
        masses=masses,
        coms=coms,
        tensors=tensors,
        payload=float(payload),
    )


def rigid_groups(machine: Machine) -> tuple[list[int], Array]:
    """By link: the body it belongs to, and T_body_link (L, 4, 4)."""
    group: list[int] = []
    T = np.zeros((len(machine.links), 4, 4))
    count = 0
    for i, link in enumerate(machine.links):
        if link.parent < 0 or link.joint >= 0:
            group.append(count)
            T[i] = np.eye(4)
            count += 1
        else:
            group.append(group[link.parent])
            T[i] = T[link.parent] @ link.T_parent_joint
    return group, T


def _parallel(offset: Array) -> Array:
    """(3, 3) of Steiner's theorem per unit of mass."""
    return np.asarray(float(offset @ offset) * np.eye(3) - np.outer(offset, offset))


def _plausible(mass: float, tensor: Array) -> bool:
    return bool(np.isfinite(mass) and mass > 0.0 and np.isfinite(tensor).all())
