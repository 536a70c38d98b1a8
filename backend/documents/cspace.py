"""Any C-space image of a state document as arrays with axes and units, and what it is in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field

from backend.cspace.exact import JointGrid
from backend.cspace.ground import GROUND, ground_under
from backend.cspace.joint_image import certified3, certified4, joint3, joint4
from backend.cspace.reach_image import ReachState, reach_image
from backend.documents.scene import Scene
from backend.errors import InputError
from backend.spatial.boxes import Boxes
from backend.spatial.types import AnyArray

Kind = Literal["joint4", "joint3", "reach"]
KINDS: tuple[Kind, ...] = ("joint4", "joint3", "reach")
JOINTS = ("swing", "boom", "stick", "bucket")
DEFAULT_SHAPES = {"joint4": (72, 64, 64, 64), "joint3": (64, 64, 64), "reach": (180, 120)}
MOST_CELLS = 2**30


class AxisDocument(BaseModel):
    """Axis k: `axis_k` holds its cell centres, `edge_k` its cell edges."""

    name: str = Field(description="a joint's role, or reach")
    unit: str = Field(description="rad or m")
    low: float
    high: float
    cells: int


class CspaceDocument(BaseModel):
    """What `cockpit cspace` wrote."""

    file: str
    machine: str
    kind: str = Field(description="joint4, joint3 or reach")
    axes: list[AxisDocument]
    eta: float = Field(description="growth of the bodies for certified_free: 3 sigma [m]")
    layers: list[str] = Field(description="obstacles in the image, self included")
    arrays: dict[str, list[int]] = Field(description="shape of every array of the file")
    colliding: float = Field(description="share of all cells")
    certified_free: float | None = Field(None, description="share of all cells")
    certified_colliding: float | None = Field(None, description="share of all cells")
    undecided: float | None = Field(None, description="share of all cells")
    swing: float | None = Field(None, description="joint3: the swing it holds for [rad]")
    height: float | None = Field(
        None, description="reach: of the tip above the swing joint, along the swing axis [m]"
    )


@dataclass(frozen=True)
class Request:
    """shape: cells along each axis, None for the usual; height: see CspaceDocument."""

    kind: Kind
    shape: tuple[int, ...] | None
    certified: bool
    layers: bool
    ground: bool
    height: float | None = None


def cspace_arrays(
    scene: Scene, own: str, request: Request
) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    """The arrays of the file, and the fields of CspaceDocument but `file` and `arrays`.

    Raises InputError for a shape that does not fit.
    """
    shape = _shape(request)
    obstacles = dict(scene.around(own).layers)
    if request.ground:
        obstacles[GROUND] = ground_under(scene.machines[own])
    if request.kind == "reach":
        arrays, facts = _reach(scene, own, request, shape, obstacles)
    else:
        arrays, facts = _joint(scene, own, request, shape, obstacles)
    arrays["eta"] = np.array(scene.eta(own))
    facts |= {
        "machine": own,
        "kind": request.kind,
        "eta": scene.eta(own),
        "layers": [*obstacles, "self"],
        "colliding": float(arrays["colliding"].mean()),
    }
    for name in ("certified_free", "certified_colliding"):
        if name in arrays:
            facts[name] = float(arrays[name].mean())
    if request.certified and request.kind != "reach":
        facts["undecided"] = 1.0 - facts["certified_free"] - facts["certified_colliding"]
    return arrays, facts


def _shape(request: Request) -> tuple[int, ...]:
    usual = DEFAULT_SHAPES[request.kind]
    shape = usual if request.shape is None else request.shape
    if len(shape) != len(usual) or min(shape) < 1 or np.prod(shape, dtype=float) > MOST_CELLS:
        raise InputError(
            f"--shape {','.join(map(str, shape))} does not fit {request.kind}; allowed are "
            f"{len(usual)} whole numbers of at least 1, like {','.join(map(str, usual))}, with at "
            f"most {MOST_CELLS:,} cells."
        )
    if request.kind == "reach" and request.certified:
        raise InputError(
            "--certified does not go with --kind reach; allowed are joint4 and joint3, whose cells "
            "are boxes in joint space."
        )
    if request.height is not None and request.kind != "reach":
        raise InputError("--height goes with --kind reach only.")
    return shape


def _joint(
    scene: Scene, own: str, request: Request, shape: tuple[int, ...], obstacles: dict[str, Boxes]
) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    machine, q = scene.machines[own], scene.poses[own].joints
    eta, slack = scene.eta(own), scene.slack(own)
    facts: dict[str, Any] = {}
    if request.kind == "joint4":
        four = (shape[0], shape[1], shape[2], shape[3])
        image, first = joint4(machine, obstacles, four, q), 0
    else:
        three = (shape[0], shape[1], shape[2])
        image, first = joint3(machine, obstacles, q, three), 1
        facts["swing"] = float(q[0])

    def cells(array: AnyArray) -> AnyArray:
        return array if first == 0 else array[0]

    arrays, facts["axes"] = _axes(image.grid, first)
    arrays["colliding"] = cells(image.colliding()).astype(np.uint8)
    if request.layers:
        for name in image.layers:
            arrays[f"layer_{name}"] = cells(image.layer(name)).astype(np.uint8)
    if request.certified:
        certified = (
            certified4(machine, obstacles, eta, four, q, slack=slack)
            if request.kind == "joint4"
            else certified3(machine, obstacles, eta, q, three, slack)
        )
        arrays["certified_free"] = cells(certified.certified_free())
        arrays["certified_colliding"] = cells(certified.certified_colliding())
    return arrays, facts


def _axes(grid: JointGrid, first: int) -> tuple[dict[str, AnyArray], list[dict[str, Any]]]:
    arrays: dict[str, AnyArray] = {}
    axes = []
    for k in range(first, 4):
        edges = grid.edges(k)
        arrays[f"axis_{k - first}"], arrays[f"edge_{k - first}"] = grid.centers(k), edges
        axes.append(_axis(JOINTS[k], "rad", edges))
    return arrays, axes


def _axis(name: str, unit: str, edges: AnyArray) -> dict[str, Any]:
    return {
        "name": name,
        "unit": unit,
        "low": float(edges[0]),
        "high": float(edges[-1]),
        "cells": len(edges) - 1,
    }


def _reach(
    scene: Scene, own: str, request: Request, shape: tuple[int, ...], obstacles: dict[str, Boxes]
) -> tuple[dict[str, AnyArray], dict[str, Any]]:
    machine, q = scene.machines[own], scene.poses[own].joints
    image = reach_image(machine, q, obstacles, (shape[0], shape[1]), request.height)
    arrays: dict[str, AnyArray] = {
        "axis_0": image.swing,
        "axis_1": image.reach,
        "edge_0": image.swing_edges,
        "edge_1": image.reach_edges,
        "state": image.state,
        "near_limit": image.near_limit,
        "colliding": (image.state == ReachState.COLLIDING).astype(np.uint8),
    }
    if request.layers:
        for name, hit in image.layers.items():
            arrays[f"layer_{name}"] = hit.astype(np.uint8)
    axes = [_axis("swing", "rad", image.swing_edges), _axis("reach", "m", image.reach_edges)]
    return arrays, {"axes": axes, "height": image.height}
