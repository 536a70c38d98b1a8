"""How firmly machines stand, as a snapshot's document has it under the key `stability`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field

from backend.documents.state import MachineStateDocument, velocity_vector
from backend.fusion.pose import FusedPose
from backend.machine.model import Machine
from backend.pipeline.records import Body3D
from backend.stability.masses import why_unknown
from backend.stability.polygon import polygon, support_polygon
from backend.stability.records import Stability

Number = Annotated[float | None, Field(description="null when not known")]


class StabilityModel(BaseModel):
    """One machine. With a reason nothing else is known. Lengths in its root frame: x along the
    tracks, y to the left, on the ground [m].
    """

    reason: str = Field(description="why it is UNKNOWN, else empty")
    payload: Number = Field(description="counted with, at the end point [kg]")
    percent: Number = Field(
        description="of the way from the middle to an edge: 100 there, 0 on the edge, never below"
    )
    share: Number = Field(description="the same, negative outside: 1 in the middle, 0 on the edge")
    margin: Number = Field(description="of the zero-moment point to the edge, negative outside [m]")
    sigma: Number = Field(description="of the margin, from the noise of rates and accelerations")
    edge: str = Field(description="that it would tip over, such as front-left")
    zmp: list[Number] | None = Field(description="x, y; null without one")
    polygon: list[list[float]] | None = Field(description="support polygon, counter-clockwise")
    edges: list[str] | None = Field(description="names of its edges, from each corner to the next")
    critical_lift: Number = Field(description="a_cz of two masses [m/s^2]; null without a limit")
    critical_swing: Number = Field(description="Omega_c of two masses [rad/s]; null without one")
    holds: list[Number] = Field(
        default_factory=list,
        description="how far from the swing axis the payload may be held, by direction in the root"
        " frame evenly from -pi; null where nowhere [m]",
    )


class AssessedStability(StabilityModel):
    """The same of a state document, whose motion is exact: sigma is 0."""

    lift_capacity: Number = Field(
        None,
        description="at rest, until an edge bears no more [kg]; null without a limit",
    )


def assessed_stability(
    machine: Machine,
    document: MachineStateDocument,
    pose: FusedPose,
    body: Body3D,
    where: str,
) -> dict[str, Any]:
    """Of one machine of a state document. Raises InputError naming `where`."""
    accelerations = velocity_vector(
        machine, document.joint_accelerations, f"{where}.joint_accelerations"
    )
    why = why_unknown(machine)
    if why:
        return stability_document(Stability(why)) | {"lift_capacity": math.nan}
    # Loaded only here: a page of playback shows what was judged, and need not wait for kernels.
    from backend.stability.capacity import lift_capacity
    from backend.stability.state import stability

    exact, T = np.zeros(len(machine.joints)), body.link_poses[0]
    motion = pose.joints, pose.joint_velocities, accelerations
    found = stability(machine, document.payload, *motion, (exact, exact), T)
    capacity = lift_capacity(machine, support_polygon(machine), pose.joints, T)
    return stability_document(found) | {"lift_capacity": float(capacity)}


def stability_document(found: Stability) -> dict[str, Any]:
    """Plain numbers; NaN and infinity where a value does not exist."""
    support = found.support
    return {
        "reason": found.reason,
        "payload": found.payload,
        "percent": 100.0 * max(found.share, 0.0) if math.isfinite(found.share) else math.nan,
        "share": found.share,
        "margin": found.margin,
        "sigma": found.sigma,
        "edge": found.edge,
        "zmp": None if np.isnan(found.zmp).any() else found.zmp.tolist(),
        "polygon": None if support is None else support.vertices.tolist(),
        "edges": None if support is None else list(support.names),
        "critical_lift": found.critical_lift,
        "critical_swing": found.critical_swing,
        "holds": np.round(found.holds, 3).tolist(),
    }


def read_stability(one: Mapping[str, Any]) -> Stability:
    """What a recorded document says; InputError, KeyError or TypeError where it says nothing."""
    if one["reason"]:
        return Stability(str(one["reason"]))
    zmp = one["zmp"]
    return Stability(
        reason="",
        payload=_number(one["payload"]),
        support=polygon(np.array(one["polygon"], dtype=float), tuple(map(str, one["edges"]))),
        zmp=np.full(2, np.nan) if zmp is None else np.array(zmp, dtype=float),
        margin=_number(one["margin"], -math.inf),
        sigma=_number(one["sigma"]),
        share=_number(one["share"], -math.inf),
        edge=str(one["edge"]),
        critical_lift=_number(one["critical_lift"], math.inf),
        critical_swing=_number(one["critical_swing"], math.inf),
        holds=np.array([_number(reach) for reach in one.get("holds", ())]),
    )


def _number(value: Any, otherwise: float = math.nan) -> float:
    return otherwise if value is None else float(value)
