"""A machine prepared for the kernels of the joint images."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from backend.cspace.exact_images import Itself, Standing
from backend.cspace.exact_kernel import Chain
from backend.cspace.planar_arm import PlanarArm, planar_arm
from backend.machine.kinematics import body_boxes, link_poses
from backend.machine.model import PARTS, Machine
from backend.spatial import transform
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.types import Array, BoolArray, IntArray


@dataclass(frozen=True)
class ArmModel:
    """A machine prepared for the kernels, its bodies grown by `inflation` [m] on every side.

    signs: (4,) +1 where a joint turns counter-clockwise about the swing axis, or raises; tracks,
    upper: grown bodies at joint values 0 (tilt and rotate as they are held); itself: what of the
    machine can touch itself.
    """

    machine: Machine
    inflation: float
    arm: PlanarArm
    signs: Array
    chain: Chain
    tracks: Standing
    upper: Standing
    itself: Itself


def arm_model(machine: Machine, rest: Array | None = None, inflation: float = 0.0) -> ArmModel:
    """Prepare `machine`. rest: (n,) joint values, of which tilt and rotate are held.

    Raises ValueError when the arm does not move in a plane, or inflation is not 0 or more.
    """
    if not (np.isfinite(inflation) and inflation >= 0.0):
        raise ValueError(f"inflation must be 0 or more metres, not {inflation}")
    q = np.zeros(len(machine.joints))
    if rest is not None:
        q[4:] = np.asarray(rest, dtype=float)[4:]
    arm = planar_arm(machine, rest, inflation)
    as_built = body_boxes(machine, link_poses(machine, q))
    part = np.array([PARTS.index(machine.part_of_body(b)) for b in range(len(machine.bodies))])
    pairs = np.zeros((len(part), len(part)), dtype=bool)
    for a, b in machine.self_pairs:
        pairs[a, b] = pairs[b, a] = True
    links = np.array([0.0, np.hypot(*arm.boom), np.hypot(*arm.boom) + np.hypot(*arm.stick)])
    far = [arm.outer.reach[arm.groups == k].max(initial=0.0) for k in range(3)]
    T_arm_root = transform.inverse(arm.T_root_arm)
    chain = Chain(
        np.ascontiguousarray(T_arm_root[:3]),
        np.stack([arm.pivot, arm.boom, arm.stick]),
        arm.pivots,
        links + far,
        arm.boxes.centers.copy(),
        arm.boxes.rotations.copy(),
        arm.boxes.half_extents.copy(),
        ~arm.aligned,
    )
    tracks, upper = (as_built.take(part == k).inflated(inflation).moved(T_arm_root) for k in (0, 1))
    return ArmModel(
        machine=machine,
        inflation=inflation,
        arm=arm,
        signs=np.array([arm.swing_sign, *arm.signs]),
        chain=chain,
        tracks=_standing(tracks),
        upper=_standing(upper),
        itself=_itself(arm, as_built, part, pairs),
    )


def _standing(boxes: Boxes) -> Standing:
    corners = boxes.corners()
    radius = np.hypot(corners[:, :, 0], corners[:, :, 1]).max(axis=1, initial=0.0)
    return Standing(boxes.centers.copy(), boxes.rotations.copy(), boxes.half_extents.copy(), radius)


def _itself(arm: PlanarArm, as_built: Boxes, part: IntArray, self_pairs: BoolArray) -> Itself:
    """part: (bodies,) number along the chain; self_pairs: (bodies, bodies)."""
    parts = list(_parts(arm, part, self_pairs))
    boxes = concatenated(as_built.take(others) for _, others, _ in parts)
    first = np.cumsum([0, *(len(others) for _, others, _ in parts)])
    pairs = [np.zeros((len(arm.bodies), 0), dtype=bool), *(pairs for _, _, pairs in parts)]
    return Itself(
        np.array([held for held, _, _ in parts], dtype=np.int64),
        first.astype(np.int64),
        boxes.centers.copy(),
        boxes.rotations.copy(),
        boxes.half_extents.copy(),
        np.concatenate(pairs, axis=1),
    )


def _parts(
    arm: PlanarArm, part: IntArray, self_pairs: BoolArray
) -> Iterator[tuple[int, IntArray, BoolArray]]:
    """(joints that are held, bodies, pairs): bodies that the first joints carry, and which of the
    arm's bodies (arm, bodies) count against them.
    """
    for held in range(5):
        others = np.flatnonzero(part == held if held < 4 else part >= 4)
        pairs = self_pairs[np.ix_(arm.bodies, others)]
        # Each pair once, seen from the body that is farther out.
        pairs = pairs & (arm.bodies[:, None] > others[None, :])
        used = pairs.any(axis=0)
        if used.any():
            yield held, others[used], pairs[:, used]
