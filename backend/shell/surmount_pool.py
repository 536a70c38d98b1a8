"""Halves of manoeuvres simulated side by side, in processes of their own, and kept in a file."""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from backend.errors import InputError
from backend.machine.model import Machine
from backend.surmount.halves import simulated
from backend.surmount.machine import Climber
from backend.surmount.records import Demands, Step
from backend.surmount.run import world_of
from backend.surmount.search import Job, Simulate, Simulated

_here: dict[str, Any] = {}


@dataclass
class Kept:
    """What was simulated, in a file of JSON lines: an interrupted search goes on from there.

    path: None keeps nothing beyond this process. Raises InputError for a file that is none.
    """

    path: Path | None = None
    found: dict[str, Simulated] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.path is None or not self.path.exists():
            return
        try:
            text = self.path.read_text(encoding="utf-8")
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read ({error.strerror}).") from error
        except UnicodeDecodeError as error:
            raise InputError(f"{self.path}: is no text; allowed are files of --keep.") from error
        lines = text.split("\n")
        # After the last line's end there is nothing, or what was cut while it was written.
        whole, cut = lines[:-1], lines[-1]
        for number, line in enumerate(whole, 1):
            try:
                key, energy, why = json.loads(line)
                value = math.inf if energy is None else float(energy)
                self.found[str(key)] = Simulated(value, str(why))
            except (ValueError, TypeError) as error:
                raise InputError(
                    f"{self.path}: line {number} holds no simulation; allowed are files that "
                    f"--keep wrote."
                ) from error
        if cut:
            self._write("".join(f"{line}\n" for line in whole), "w")

    def add(self, rows: list[tuple[str, Simulated]]) -> None:
        """Kept from now on."""
        self.found.update(rows)
        if self.path is None or not rows:
            return
        told = [
            (key, one.energy if math.isfinite(one.energy) else None, one.why) for key, one in rows
        ]
        self._write("".join(f"{json.dumps(row)}\n" for row in told), "a")

    def _write(self, text: str, mode: Literal["a", "w"]) -> None:
        assert self.path is not None
        try:
            with self.path.open(mode, encoding="utf-8") as file:
                file.write(text)
        except OSError as error:
            raise InputError(f"{self.path}: cannot be written ({error.strerror}).") from error


@dataclass
class Pool:
    """Opens what simulates; see `backend.surmount.plan.Open`. workers: processes."""

    kept: Kept = field(default_factory=Kept)
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)

    @contextmanager
    def __call__(self, climber: Climber, step: Step) -> Iterator[Simulate]:
        name = fingerprint(climber.machine, climber.demands, step)
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(self.workers, context, _begin, (climber, step))

        def simulate(jobs: Sequence[Job]) -> list[Simulated]:
            keys = [f"{name} {job.half} {list(job.key)}" for job in jobs]
            new = [k for k, key in enumerate(keys) if key not in self.kept.found]
            made = pool.map(_simulated, [jobs[k] for k in new])
            self.kept.add(list(zip([keys[k] for k in new], made, strict=True)))
            return [self.kept.found[key] for key in keys]

        try:
            yield simulate
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def fingerprint(machine: Machine, demands: Demands, step: Step) -> str:
    """Of all that a simulation depends on beside its parameters."""
    digest = hashlib.sha256()
    inertias = [link.inertia for link in machine.links if link.inertia is not None]
    arrays = [machine.link_matrices, machine.bodies.centers, machine.bodies.half_extents]
    arrays += [machine.max_velocity, machine.max_acceleration]
    arrays += [np.array([machine.tracks.max_speed])]
    arrays += [np.concatenate([[i.mass], i.com, i.tensor.ravel()]) for i in inertias]
    for array in arrays:
        digest.update(np.round(array, 9).tobytes())
    numbers = (step.height, step.depth, step.before, step.beyond)
    asked = (demands.payload, demands.friction, demands.pace, demands.facing, demands.attitude)
    digest.update(repr((numbers, asked)).encode())
    return digest.hexdigest()[:16]


def _begin(climber: Climber, step: Step) -> None:
    _here.update(climber=climber, step=step, world=world_of(climber, step))


def _simulated(job: Job) -> Simulated:
    return simulated(_here["climber"], _here["step"], _here["world"], job)
