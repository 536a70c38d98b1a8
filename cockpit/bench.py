"""`cockpit bench`: speed and memory, with peers measured in the same run."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from backend.collision import box_distance
from backend.collision.closest import closest_pairs, fcl_box, fcl_distance
from backend.documents.bench import BenchDocument, BenchMachine, BenchRow
from backend.errors import InputError
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.images import SunParameters, ordered_pairs, pair_image
from backend.pipeline.place import place
from backend.pipeline.records import Snapshot
from backend.pipeline.step import initial, step
from backend.site.site import Site, load_site
from backend.spatial import rotation, transform
from cockpit.bench_collision import collision_rows
from cockpit.bench_cspace import cspace_rows
from cockpit.bench_input import cycles
from cockpit.bench_live import crowded_rows, live_rows
from cockpit.bench_people import people_rows
from cockpit.bench_plan import plan_rows
from cockpit.bench_recording import recording_rows
from cockpit.bench_rows import percentile_rows
from cockpit.bench_session import session_rows
from cockpit.bench_surmount import surmount_rows
from cockpit.desk import load_models, make_config

CYCLES = 500


def run_bench(as_json: bool, seconds: float, only: str = "") -> None:
    """Measure everything; print a table, or the document of `cockpit schema bench`.

    only: measure just the parts with this in their names. Raises InputError when there is none.
    """
    site = load_site("demo")
    models = load_models(site)
    config = make_config(site, models, (), "LIVE")
    rows: list[BenchRow] = []
    parts: list[tuple[str, Callable[[], list[BenchRow]]]] = [
        ("fast loop and images", lambda: pipeline_rows(site, config)),
        ("distances", lambda: distance_rows(next(iter(models.values())))),
        ("collision server", collision_rows),
        ("joint images", cspace_rows),
        ("planning trajectories", plan_rows),
        ("surmounting", surmount_rows),
        ("people", people_rows),
        ("recording", lambda: recording_rows(site, config, seconds)),
        ("a session of an hour", lambda: session_rows(site, config, seconds)),
        ("live, over Zenoh", lambda: live_rows(seconds)),
        ("live, on a crowded site", lambda: crowded_rows(seconds)),
    ]
    known = ", ".join(name for name, _ in parts)
    parts = [(name, measure) for name, measure in parts if only in name]
    if not parts:
        raise InputError(f"--only {only}: no part is called so; there are: {known}.")
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("bench", total=len(parts))
        for name, measure in parts:
            bar.update(task, description=name)
            rows += measure()
            bar.advance(task)
    document = BenchDocument(machine=BenchMachine(cpu=_cpu(), cores=os.cpu_count() or 1), rows=rows)
    if as_json:
        print(document.model_dump_json(indent=2))
    else:
        _print(document)


def pipeline_rows(site: Site, config: Config) -> list[BenchRow]:
    """The pure step on input at the paper's rates, and Sun's images for both machines."""
    state, snapshot = initial(config), None
    durations = []
    for now, inputs in cycles(site, config, CYCLES + 100):
        start = time.perf_counter()
        state, snapshot = step(state, inputs, now, config)
        durations.append(time.perf_counter() - start)
    assert snapshot is not None
    images = []
    parameters = SunParameters(site.sun.m, site.sun.n, site.sun.eta)
    for _ in range(100):
        start = time.perf_counter()
        count = _all_images(snapshot, config, parameters)
        images.append(time.perf_counter() - start)
    return [
        *percentile_rows("pipeline.step, 2 machines", durations[100:], 10.0),
        *percentile_rows(f"Sun's images, {count} ordered pairs", images, 50.0),
    ]


def _all_images(snapshot: Snapshot, config: Config, parameters: SunParameters) -> int:
    pairs = ordered_pairs(snapshot, config)
    for own, partner in pairs:
        pair_image(snapshot, config, own, partner, parameters)
    return len(pairs)


def distance_rows(machine: Machine) -> list[BenchRow]:
    """Closest bodies of two machines against python-fcl on every pair."""
    rng = np.random.default_rng(0)
    low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
    high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
    ours, peer, exact, worst = [], [], [], 0.0
    for _ in range(200):
        boxes = [
            place(
                machine,
                rng.uniform(low, high),
                transform.make(
                    rotation.rz(rng.uniform(-np.pi, np.pi)), np.array([6.0 * side, 0.0, 0.0])
                ),
            ).boxes
            for side in (0, 1)
        ]
        start = time.perf_counter()
        found = closest_pairs(*boxes)
        ours.append(time.perf_counter() - start)
        start = time.perf_counter()
        objects = [
            [fcl_box(b.centers[k], b.rotations[k], b.half_extents[k]) for k in range(len(b))]
            for b in boxes
        ]
        smallest = min(fcl_distance(a, b) for a in objects[0] for b in objects[1])
        peer.append(time.perf_counter() - start)
        start = time.perf_counter()
        i, j = (g.ravel() for g in np.meshgrid(range(len(boxes[0])), range(len(boxes[1]))))
        truth, _ = box_distance.pair_distances(*boxes, i, j)
        exact.append(time.perf_counter() - start)
        if truth.min() > 0:
            worst = max(worst, abs(float(found.distance[0]) - float(truth.min())))
        del smallest
    ms, peer_ms = 1e3 * np.asarray(ours), 1e3 * np.asarray(peer)
    value, peer_value = float(np.median(ms)), float(np.median(peer_ms))
    n = len(machine.bodies)
    return [
        BenchRow(
            name=f"closest bodies, {n} x {n}, checked",
            value=value,
            unit="ms",
            spread=tuple(np.percentile(ms, [5, 95])),
            peer="python-fcl, every pair",
            peer_value=peer_value,
            ratio=peer_value / value,
        ),
        BenchRow(
            name="closest bodies, worst error against enumeration of all pairs",
            value=worst * 1e3,
            unit="mm",
            spread=(0.0, worst * 1e3),
            target=1e-3,
        ),
    ]


def _cpu() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _print(document: BenchDocument) -> None:
    table = Table(title=f"{document.machine.cpu}, {document.machine.cores} cores")
    for column in ("what", "value", "5–95 %", "below", "peer", "ratio"):
        table.add_column(column, justify="left" if column in ("what", "peer") else "right")
    for row in document.rows:
        table.add_row(
            row.name,
            f"{row.value:.3g} {row.unit}",
            f"{row.spread[0]:.3g}–{row.spread[1]:.3g}",
            ""
            if row.target is None
            else f"{row.target:g} {'✓' if row.value < row.target else '✗'}",
            "" if row.peer is None else f"{row.peer}: {row.peer_value:.3g} {row.unit}",
            "" if row.ratio is None else f"{row.ratio:.1f}x",
        )
    Console().print(table)
