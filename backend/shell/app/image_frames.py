"""Images as frames of the page's websocket."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from backend.cspace.cells import LAYER_BITS
from backend.cspace.reach_image import ReachImage, ReachState
from backend.documents.sun import sun_state_document
from backend.pipeline.exact import ARM, OwnImage, Slice
from backend.pipeline.images import PairImage, frame_arrays
from backend.pipeline.regions import RegionsImage
from backend.pipeline.zones import ZoneImage
from backend.shell.app.wire import encode
from backend.shell.kinds import ALONG, EXACT, REGIONS, SUN, ZONE
from backend.spatial.types import AnyArray

if TYPE_CHECKING:
    from backend.pipeline.along import AlongImage

NEAR_LIMIT, BEYOND_LIMIT, OUT_OF_REACH, PEOPLE_IN_REACH, TIPPING_REACH = 8, 16, 32, 64, 128
"""Bits of a reach cell, which is not certified, beside the layers' own."""

_REACH_BITS = {**LAYER_BITS, "people": PEOPLE_IN_REACH, "tip-over": TIPPING_REACH}


def sun_frame(image: PairImage) -> bytes:
    sun = image.sun
    header = {
        "type": SUN,
        "key": image.key,
        "own": image.own,
        "partner": image.partner,
        "state_time": image.state_time,
        "eta": sun.eta,
        "m": sun.m,
        "n": sun.n,
        "max_reach": sun.b_max_reach,
        "current": sun_state_document(sun.current),
    }
    return encode(header, frame_arrays(image))


def exact_frame(image: OwnImage, regions: RegionsImage | None = None) -> bytes:
    """regions: the machine's newest.

    Arrays slice0.., patch0.., bar0.. and reach: uint8 cells; see backend.cspace.cells. tip_over:
    whether cells tell where the resting machine tips, and why they do not, null where nobody asks.
    """
    arrays: dict[str, AnyArray] = {}
    for k, part in enumerate(image.slices):
        arrays[f"slice{k}"] = part.cells
        if part.patch is not None:
            arrays[f"patch{k}"] = part.patch.cells
    for k, bar in enumerate(image.bars):
        arrays[f"bar{k}"] = bar.cells
    arrays["reach"] = reach_cells(image.reach)
    reach = image.reach
    header = {
        "type": EXACT,
        "key": image.key,
        "own": image.own,
        "partners": list(image.partners),
        "state_time": image.state_time,
        "eta": image.eta,
        "q": {role: float(image.q[k]) for k, role in enumerate(ARM)},
        "slices": [
            {
                "across": part.across,
                "up": part.up,
                **_rectangle(part),
                "patch": None if part.patch is None else _rectangle(part.patch),
            }
            for part in image.slices
        ],
        "bars": [{"joint": bar.joint, "edges": bar.edges.tolist()} for bar in image.bars],
        "volume": {
            "joints": list(ARM[1:]),
            "edges": image.volume_edges.tolist(),
            "swing": float(image.q[0]),
        },
        "reach": {
            "swing": [float(reach.swing_edges[0]), float(reach.swing_edges[-1])],
            "reach": [float(reach.reach_edges[0]), float(reach.reach_edges[-1])],
            "height": reach.height,
            "picked": image.tip_height is not None,
            "attitude": reach.attitude,
            "elbow": reach.elbow,
        },
        "stopping": {
            role: {"now": float(image.stopping[k, 0]), "full": float(image.stopping[k, 1])}
            for k, role in enumerate(ARM)
        },
        "tip_over": {"judged": image.tip_over == "", "reason": image.tip_over},
        "regions": None if regions is None else vars(regions),
    }
    return encode(header, arrays)


def reach_cells(reach: ReachImage) -> AnyArray:
    """(swing, reach) uint8: the layers' bits where it collides, and the bits above."""
    cells = np.zeros(reach.state.shape, dtype=np.uint8)
    for name, hit in reach.layers.items():
        cells[hit] |= _REACH_BITS[name]
    cells[reach.near_limit] |= NEAR_LIMIT
    cells[reach.state == ReachState.BEYOND_LIMIT] = BEYOND_LIMIT
    cells[reach.state == ReachState.OUT_OF_REACH] = OUT_OF_REACH
    return cells


def zone_frame(image: ZoneImage) -> bytes:
    """Per variant an array of vertices (k, 2), and `.._rings` (r, 2): vertices of each ring, and
    1 for an exterior, 0 for a hole of the exterior before it. `layer` says what must not be
    touched: "partner", "people" or "site", of which `partner` is null; there are no variants while
    `reason` says why nothing is known; nothing beyond `view` [m] (null: all) of the base is looked
    at, and a signed distance of `view` means that far or farther.
    """
    arrays: dict[str, AnyArray] = {}
    variants: dict[str, Any] = {}
    for name, zone in image.zones.items():
        arrays[name], arrays[f"{name}_rings"] = rings(zone)
        way = image.exits[name]
        variants[name] = {
            "signed_distance": _known(way.signed_distance),
            "empty": zone.is_empty,
            "exit": None
            if way.length <= 0.0
            else {"direction": way.direction.tolist(), "length": way.length},
        }
    header = {
        "type": ZONE,
        "key": image.key,
        "own": image.own,
        "partner": image.partner,
        "state_time": image.state_time,
        "eta": _known(image.eta),
        "base": image.base.tolist(),
        "variants": variants,
        "layer": image.layer,
        "view": _known(image.view),
        "reason": image.reason,
    }
    return encode(header, arrays)


def along_frame(image: AlongImage) -> bytes:
    """Arrays `edges` (k, 2) float32 stations [m], `clearance` and `at_least` (k,) float32 [m], NaN
    where there is none.
    """
    # A site without tracks loads nothing of this.
    from backend.documents.along import bands, limit_of, part_of

    place, items = image.place, image.stretches
    header = {
        "type": ALONG,
        "key": image.key,
        "own": image.own,
        "track": image.track,
        "state_time": image.state_time,
        "length": image.length,
        "station": None if place is None else place.station,
        "eta": image.eta,
        "cap": image.cap,
        "seconds": image.seconds,
        "postures": image.postures,
        "reason": image.reason,
        "bands": [band.model_dump() for band in bands(items)],
        "closest": [f"{part_of(i.body)} ↔ {limit_of(i.limit)}" if i.body else "" for i in items],
    }
    arrays: dict[str, AnyArray] = {
        "edges": np.array([(i.start, i.end) for i in items], dtype=np.float32).reshape(-1, 2),
        "clearance": np.array([_finite(i.clearance) for i in items], dtype=np.float32),
        "at_least": np.array([i.at_least for i in items], dtype=np.float32),
    }
    return encode(header, arrays)


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.nan


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def rings(zone: BaseGeometry) -> tuple[AnyArray, AnyArray]:
    """(k, 2) float32 vertices of all rings of (multi)polygons, (r, 2) int32 sizes and kinds."""
    vertices, sizes = [], []
    for polygon in () if zone.is_empty else shapely.get_parts(zone):
        for k, ring in enumerate([polygon.exterior, *polygon.interiors]):
            points = shapely.get_coordinates(ring)[:-1]
            vertices.append(points)
            sizes.append((len(points), 1 if k == 0 else 0))
    xy = np.concatenate(vertices) if vertices else np.zeros((0, 2))
    return xy.astype(np.float32), np.array(sizes, dtype=np.int32).reshape(-1, 2)


def frame_of(kind: str, image: Any, images: Mapping[tuple[str, str], Any]) -> bytes | None:
    """The frame of one image. images: the newest of all kinds; None for what pages are not sent."""
    if kind == SUN:
        return sun_frame(image)
    if kind == EXACT:
        return exact_frame(image, images.get((REGIONS, image.key)))
    if kind == ALONG:
        return along_frame(image)
    return zone_frame(image) if kind == ZONE else None


def _rectangle(part: Slice) -> dict[str, Any]:
    return {"x": part.x.tolist(), "y": part.y.tolist()}
