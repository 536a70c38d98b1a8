"""Exact and certified joint images: against writing their memory, and against python-fcl."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from backend.collision.manager import BoxManager
from backend.cspace.exact import (
    EXACT,
    INNER,
    OUTER,
    ArmModel,
    JointGrid,
    arm_model,
    blocked,
    joint_grid,
    unpacked,
)
from backend.documents.bench import BenchRow
from backend.machine.kinematics import body_boxes, link_poses
from backend.spatial.types import AnyArray
from cockpit.bench_scenes import BenchScene, arm_scene, mini_scene

SMALL = (72, 64, 64, 64)
LARGE = (180, 128, 128, 128)
FINE = (360, 128, 128, 128)
ETA = 0.15
"""Growth of the bodies whose undecided cells are counted apart [m]."""
_SAMPLE = 2000
"""Configurations for python-fcl."""


def cspace_rows() -> list[BenchRow]:
    """All images with nothing added to the bodies, but for the last row of each scene."""
    rows = []
    for scene in (arm_scene(), mini_scene()):
        model = arm_model(scene.machine)
        rows += _image_rows(scene, model, SMALL, 25.0, 25)
        rows += _image_rows(scene, model, LARGE, 12.0, 7)
        rows += _fcl_rows(scene, model)
        rows += _certified_rows(scene, model)
    return rows


def _image_rows(
    scene: BenchScene, model: ArmModel, shape: tuple[int, int, int, int], target: float, count: int
) -> list[BenchRow]:
    """The exact image's time as a multiple of filling the same memory, in turns.

    Three kinds of it: the same again and again, as much of it as fits in the processor's caches;
    known to the system, but in no cache, which takes turns among more than the caches hold; and
    new, which the system has to find first.
    """
    grid = joint_grid(scene.machine, shape)
    bits = blocked(model, grid, scene.partner)
    known = [np.zeros_like(bits) for _ in range(2 + 2 * last_cache() // bits.nbytes)]
    for memory in known:
        memory.fill(1)  # mapped from now on
    same, over, ours, again, cold, new = _in_turns(
        count,
        lambda _: blocked(model, grid, scene.partner, out=known[0]),
        lambda k: blocked(model, grid, scene.partner, out=known[k % len(known)]),
        lambda _: blocked(model, grid, scene.partner),
        lambda _: known[0].fill(0),
        lambda k: known[(k + len(known) // 2) % len(known)].fill(0),
        lambda _: np.empty_like(bits).fill(0),
    )
    name = f"exact image, {scene.name}, {_size(shape)}"
    rows = [
        BenchRow(
            name=name,
            value=float(np.median(1e3 * same)),
            unit="ms",
            spread=_spread(1e3 * same),
            peer="memset",
            peer_value=float(np.median(1e3 * again)),
        )
    ]
    for what, times, peer, limit in (
        ("of memset", same, again, target),
        ("written over known memory out of cache, of memset of such", over, cold, None),
        ("in new memory, of memset of such", ours, new, None),
    ):
        multiples = times / np.median(peer)
        rows.append(
            BenchRow(
                name=f"{name}, {what}",
                value=float(np.median(multiples)),
                unit="x",
                spread=_spread(multiples),
                target=limit,
                peer="memset",
                peer_value=float(np.median(1e3 * peer)),
            )
        )
    colliding = f"colliding cells, {scene.name}, {_size(shape)}"
    return [*rows, _share_row(colliding, _share(bits, grid))]


def last_cache() -> int:
    """Size of the largest cache of the first processor [bytes]; 64 MiB where it is not told."""
    sizes = []
    for path in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*/size"):
        number, unit = re.fullmatch(r"(\d+)([KMG]?)", path.read_text().strip()).groups()
        sizes.append(int(number) << {"": 0, "K": 10, "M": 20, "G": 30}[unit])
    return max(sizes, default=64 << 20)


def _fcl_rows(scene: BenchScene, model: ArmModel) -> list[BenchRow]:
    """Time for each cell against python-fcl's manager at a sample of configurations."""
    grid = joint_grid(scene.machine, SMALL)
    rng = np.random.default_rng(0)
    index = np.stack([rng.integers(0, n, _SAMPLE) for n in SMALL], axis=1)
    q = np.stack([grid.centers(k)[index[:, k]] for k in range(4)], axis=1)
    placed = [body_boxes(scene.machine, T) for T in link_poses(scene.machine, q)]
    ours, theirs = BoxManager(placed[0]), BoxManager(scene.partner)
    image, peer, found = [], [], np.zeros(_SAMPLE, dtype=bool)
    cells = float(np.prod(SMALL))
    for part in np.array_split(np.arange(_SAMPLE), 5):
        start = time.perf_counter()
        bits = blocked(model, grid, scene.partner)
        image.append(1e9 * (time.perf_counter() - start) / cells)
        start = time.perf_counter()
        for i in part:
            ours.move(placed[i].centers, placed[i].rotations)
            found[i] = ours.touches(theirs)
        peer.append(1e9 * (time.perf_counter() - start) / len(part))
    value, peer_value = float(np.median(image)), float(np.median(peer))
    agrees = unpacked(bits, SMALL[3])[tuple(index.T)] == found
    return [
        BenchRow(
            name=f"exact image, {scene.name}, each cell",
            value=value,
            unit="ns",
            spread=_spread(np.array(image)),
            target=peer_value / 20_000.0,
            peer="python-fcl, manager",
            peer_value=peer_value,
            ratio=peer_value / value,
        ),
        _share_row(
            f"cells of another opinion than python-fcl, {scene.name}", float(1.0 - agrees.mean())
        ),
    ]


def _certified_rows(scene: BenchScene, model: ArmModel) -> list[BenchRow]:
    grid = joint_grid(scene.machine, SMALL)
    grown = arm_model(scene.machine, inflation=ETA)
    ours, exact = _in_turns(
        9,
        lambda _: [blocked(model, grid, scene.partner, kind) for kind in (OUTER, INNER)],
        lambda _: blocked(model, grid, scene.partner, EXACT),
    )
    multiples = ours / np.median(exact)
    small, fine = (_undecided(scene, model, model, shape) for shape in (SMALL, FINE))
    band = _undecided(scene, grown, model, SMALL) - small
    return [
        BenchRow(
            name=f"certified image, {scene.name}, {_size(SMALL)}, of the exact one",
            value=float(np.median(multiples)),
            unit="x",
            spread=_spread(multiples),
            target=10.0,
        ),
        _share_row(f"undecided cells, {scene.name}, {_size(SMALL)}", small, 4.0),
        _share_row(f"undecided cells, {scene.name}, {_size(FINE)}", fine, 1.0),
        _share_row(f"undecided cells more with {ETA} m, {scene.name}, {_size(SMALL)}", band),
    ]


def _undecided(
    scene: BenchScene, outer: ArmModel, inner: ArmModel, shape: tuple[int, int, int, int]
) -> float:
    """Share of the cells that are neither certified free nor certified colliding."""
    grid = joint_grid(scene.machine, shape)
    bits = blocked(outer, grid, scene.partner, OUTER)
    bits &= ~blocked(inner, grid, scene.partner, INNER)
    return _share(bits, grid)


def _in_turns(count: int, *works: Callable[[int], object]) -> np.ndarray:
    """Durations (works, count) [s], after one run that does not count; each is told its turn."""
    times = np.empty((len(works), count + 1))
    for k in range(count + 1):
        for row, work in enumerate(works):
            start = time.perf_counter()
            work(k)
            times[row, k] = time.perf_counter() - start
    return times[:, 1:]


def _share(bits: AnyArray, grid: JointGrid) -> float:
    """Share of the cells that are set."""
    set_ = sum(int(np.unpackbits(part.view(np.uint8)).sum()) for part in bits)
    return set_ / float(np.prod(grid.shape))


def _share_row(name: str, share: float, target: float | None = None) -> BenchRow:
    percent = 100.0 * share
    return BenchRow(name=name, value=percent, unit="%", spread=(percent, percent), target=target)


def _spread(values: np.ndarray) -> tuple[float, float]:
    low, high = np.percentile(values, [5, 95])
    return float(low), float(high)


def _size(shape: tuple[int, int, int, int]) -> str:
    return f"{shape[0]}x{shape[1]}^3"
