"""Made-up frames of exact images and zones, with every class of cell in them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from backend.shell.app.wire import encode

LIMITS = {"boom": (-0.5, 1.2), "stick": (-2.6, -0.3), "bucket": (-2.0, 0.9)}
Q = {"swing": math.radians(30), "boom": 0.5, "stick": -1.0, "bucket": 0.2}
PAIRS = (("boom", "stick"), ("boom", "bucket"), ("stick", "bucket"))
PARTNER, SITE, SELF, TIP_OVER, FREE, COLLIDING, TIPPING_REACH = 1, 2, 4, 16, 64, 128, 128
CELLS = 48
PATCH = (0.45, 0.65)  # of the joints' ranges


def certified(layers: np.ndarray) -> np.ndarray:
    """Layers at centres -> bytes: cells beside a boundary are undecided."""
    hit = layers > 0
    padded = np.pad(hit, 1, mode="edge")
    near_hit, near_free = hit.copy(), ~hit
    for axis in range(hit.ndim):
        for shift in (-1, 1):
            moved = np.roll(padded, shift, axis)[(slice(1, -1),) * hit.ndim]
            near_hit |= moved
            near_free |= ~moved
    out = layers.astype(np.uint8)
    out[~near_hit] |= FREE
    out[~near_free] |= COLLIDING
    return out


def slice_cells(x: tuple[float, float], y: tuple[float, float], n: int, seed: int) -> np.ndarray:
    """A disc of the partner, a band of the site, corners of the machine itself."""
    u = np.linspace(0, 1, 2 * n + 1)[1::2]
    a, b = np.meshgrid(x[0] + u * (x[1] - x[0]), y[0] + u * (y[1] - y[0]), indexing="ij")
    layers = np.zeros((n, n), np.uint8)
    layers[np.hypot(a - 0.8, b - 0.3) < 0.2 + 0.05 * seed] |= PARTNER
    layers[a + 0.4 * b < 0.22 + 0.05 * seed] |= SITE
    layers[(a - 0.1) ** 2 + (b - 0.95) ** 2 < 0.06] |= SELF
    layers[(a > 0.75) & (b < 0.2)] |= SELF
    return certified(layers)


def bar_cells(n: int, blocked: list[tuple[float, float, int]]) -> np.ndarray:
    u = (np.arange(n) + 0.5) / n
    layers = np.zeros(n, np.uint8)
    for low, high, layer in blocked:
        layers[(u > low) & (u < high)] |= layer
    return certified(layers)


def reach_cells(
    n: int, m: int, swing: tuple[float, float], reach: tuple[float, float]
) -> np.ndarray:
    """The partner from 2.8 m on between 55 and 100 degrees, a wall, limits, out of reach."""
    s = np.degrees(swing[0] + (np.arange(n) + 0.5) / n * (swing[1] - swing[0]))[:, None]
    d = (reach[0] + (np.arange(m) + 0.5) / m * (reach[1] - reach[0]))[None, :] + 0 * s
    out = np.zeros((n, m), np.uint8)
    out[(np.abs(s - 78) < 22) & (d > 2.8)] |= 1
    out[(s < -60) & (s > -110) & (d > 3.4)] |= 2
    out[d < 1.0] |= 4
    out[(d > 3.9)] |= 8
    out[(d < 1.2) & (d > 1.0)] |= 8
    out[d > 4.1] |= 16
    out[d > 4.3] = 32
    out[d < 0.4] = 32
    return out


def share(span: tuple[float, float], part: tuple[float, float]) -> list[float]:
    return [span[0] + p * (span[1] - span[0]) for p in part]


def exact(state_time: float, *, own: str = "left", tipping: bool = False, **changes: Any) -> bytes:
    """tipping: with postures that reach out too far."""
    arrays: dict[str, np.ndarray] = {}
    slices = []
    for i, (across, up) in enumerate(PAIRS):
        x, y = LIMITS[across], LIMITS[up]
        arrays[f"slice{i}"] = slice_cells((0, 1), (0, 1), CELLS, i)
        patch = None
        if i == 0:
            # The middle fifth of the rectangle, four times as fine.
            arrays["patch0"] = slice_cells(PATCH, PATCH, 40, 0)
            patch = {"x": share(x, PATCH), "y": share(y, PATCH)}
        slices.append({"across": across, "up": up, "x": list(x), "y": list(y), "patch": patch})
    edges = {"swing": (-math.pi, math.pi), **LIMITS}
    blocked: dict[str, list[tuple[float, float, int]]] = {
        "swing": [(0.66, 0.78, PARTNER), (0.2, 0.3, SITE)],
        "boom": [(0.0, 0.2, SITE), (0.85, 1.0, PARTNER)],
        "stick": [(0.8, 1.0, PARTNER), (0.0, 0.1, SELF)],
        "bucket": [(0.0, 0.15, SELF)],
    }
    for i, joint in enumerate(edges):
        arrays[f"bar{i}"] = bar_cells(360 if joint == "swing" else 128, blocked[joint])
    swing, reach = (-math.pi, math.pi), (0.0, 4.4)
    arrays["reach"] = reach_cells(180, 88, swing, reach)
    if tipping:
        for name in ("slice0", "slice1", "slice2"):
            cells = arrays[name]
            cells[3 * len(cells) // 4 :, : len(cells) // 2] |= TIP_OVER | COLLIDING
            cells[3 * len(cells) // 4 :, : len(cells) // 2] &= 255 - FREE
        arrays["reach"][20:40, 60:84] |= TIPPING_REACH
    header: dict[str, Any] = {
        "type": "exact",
        "key": own,
        "own": own,
        "partners": ["right" if own == "left" else "left"],
        "state_time": state_time,
        "eta": 0.17,
        "q": Q,
        "slices": slices,
        "bars": [{"joint": joint, "edges": list(e)} for joint, e in edges.items()],
        "volume": {
            "joints": ["boom", "stick", "bucket"],
            "edges": [list(e) for e in LIMITS.values()],
            "swing": Q["swing"],
        },
        "reach": {
            "swing": list(swing),
            "reach": list(reach),
            "height": 0.1,
            "picked": False,
            "attitude": -1.2,
            "elbow": 1,
        },
        "stopping": {
            "swing": {"now": 0.12, "full": 0.5},
            "boom": {"now": 0.1, "full": 0.2},
            "stick": {"now": -0.9, "full": 0.25},
            "bucket": {"now": 0.0, "full": 0.3},
        },
        "regions": {
            "state_time": state_time - 0.4,
            "shape": [36, 24, 24, 24],
            "free": 0.67,
            "share": 0.63,
            "present": True,
            "cut_off": 2,
            "cut_off_share": 0.04,
        },
    }
    return encode({**header, **changes}, arrays)


def ring(centre: tuple[float, float], radius: float, count: int = 40) -> np.ndarray:
    angle = np.linspace(0, 2 * math.pi, count, endpoint=False)
    return np.array(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def zone(state_time: float, *, base: tuple[float, float] = (0.0, 0.0), **variants: Any) -> bytes:
    """As is: two parts, the larger with a hole. Any swing and posture: discs."""
    far = math.hypot(base[0] - 7.0, base[1])
    shapes = {
        "as_is": [ring((7, 0), 3.2), ring((8, 1.6), 0.8)[::-1], ring((2.6, 3.4), 0.6)],
        "any_swing": [ring((7, 0), 4.6)],
        "any_posture": [ring((7, 0), 6.2)],
        "turning": [ring((7, 0), 5.2)],
    }
    radius = {"as_is": 3.2, "any_swing": 4.6, "any_posture": 6.2, "turning": 5.2}
    arrays: dict[str, np.ndarray] = {}
    given: dict[str, Any] = {}
    for name, rings in shapes.items():
        signed = far - radius[name]
        exit_ = {"direction": [-1.0, 0.0], "length": -signed} if signed < 0 else None
        given[name] = variants.get(name, {"signed_distance": signed, "exit": exit_})
        if given[name] is None:
            continue
        arrays[name] = np.concatenate(rings).astype(np.float32)
        kinds = [1, 0, 1] if name == "as_is" else [1]
        counts = [[len(r), kind] for r, kind in zip(rings, kinds, strict=True)]
        arrays[f"{name}_rings"] = np.array(counts, np.int32)
    names = {"key": "left<-right", "own": "left", "partner": "right", "base": list(base)}
    return encode({"type": "zone", **names, "state_time": state_time, "variants": given}, arrays)


def layer_zone(
    layer: str,
    state_time: float,
    centre: tuple[float, float],
    radius: float,
    *,
    base: tuple[float, float] = (0.0, 0.0),
    reason: str = "",
) -> bytes:
    """Zones of people or the site: discs about centre, no turning; none with a reason."""
    arrays: dict[str, np.ndarray] = {}
    given: dict[str, Any] = {}
    far = math.hypot(base[0] - centre[0], base[1] - centre[1])
    for k, name in enumerate(() if reason else ("as_is", "any_swing", "any_posture")):
        signed = far - radius - k
        way = [(b - c) / max(far, 1e-9) for b, c in zip(base, centre, strict=True)]
        exit_ = {"direction": way, "length": -signed} if signed < 0 else None
        given[name] = {"signed_distance": min(signed, 15.0), "empty": False, "exit": exit_}
        arrays[name] = ring(centre, radius + k).astype(np.float32)
        arrays[f"{name}_rings"] = np.array([[40, 1]], np.int32)
    header = {
        "type": "zone",
        "key": f"left<-layer:{layer}",
        "own": "left",
        "partner": None,
        "layer": layer,
        "state_time": state_time,
        "base": list(base),
        "variants": given,
        "view": 0.0 if reason else 15.0,
        "reason": reason,
    }
    return encode(header, arrays)


def way(
    free: float | None, hits: str | None, can_stop: bool = True, time_now: float | None = None
) -> dict[str, Any]:
    return {
        "free": free,
        "hits": hits,
        "own": "bucket/0" if hits else None,
        "time_now": time_now,
        "time_full": None if free is None else free / 0.5,
        "stop_now": 0.02,
        "stop_full": 0.2,
        "can_stop": can_stop,
    }


def margins() -> dict[str, Any]:
    joints = {
        "swing": {
            "negative": way(1.2, "site:wall"),
            "positive": way(0.31, "right:stick/0"),
        },
        "boom": {
            "negative": way(0.15, "site:ground", can_stop=False),
            "positive": way(0.12, "right:boom/1", can_stop=False, time_now=1.2),
        },
        "stick": {"negative": way(1.6, None), "positive": way(0.33, "right:stick/0")},
        "bucket": {"negative": way(1.1, "left:tracks/0"), "positive": way(None, None)},
    }
    motion = {"free": 1.3, "hits": "right:boom/1", "own": "bucket/0"}
    left = {"eta": 0.17, "reason": "", "joints": joints, "motion": motion}
    return {"left": left, "right": None}
