"""500 random tasks among random obstacles: how many are solved, how fast, and what the judge says.

Not in `make test`; `make campaign` prints the table. A sample is in tests/planning.
"""

from __future__ import annotations

import os
import time
from collections import Counter

import numpy as np
import pytest
from plan_tasks import judged

from backend.documents.plan import proven
from backend.machine.load import load_machine
from backend.planning.trajectory.plan import plan, rehearse
from backend.planning.trajectory.records import Refusal
from cockpit.bench_tasks import random_task

TASKS = int(os.environ.get("PLAN_TASKS", "250"))
"""Of each machine."""


@pytest.mark.timeout(7_200)
def test_random_tasks() -> None:
    violations = []
    for name in ("mini", "ex13"):
        machine = load_machine(name)
        rehearse(machine)
        kinds: Counter[str] = Counter()
        seconds, proofs, unsolved = [], [], []
        for seed in range(TASKS):
            task, obstacles = random_task(machine, seed)
            start = time.perf_counter()
            made = plan(machine, task, obstacles)
            seconds.append(time.perf_counter() - start)
            if isinstance(made, Refusal):
                start = time.perf_counter()
                made = proven(machine, task, obstacles, made)
                proofs.append(time.perf_counter() - start)
                kinds[f"{made.kind}, proven" if made.proven else made.kind] += 1
                unsolved.append((seed, made.why))
                continue
            kinds["solved by a search" if "search" in made.way else "solved by a move"] += 1
            found = judged(machine, task, obstacles, made)
            if found.contact or found.tipped or found.beyond > 1.001 or found.missed > 1e-3:
                violations.append((name, seed, found))
        p50, p95, most = np.percentile(seconds, [50, 95, 100])
        print(f"\n{name}: {TASKS} tasks: {dict(kinds)}")
        print(f"  plan p50 {p50:.3f} s, p95 {p95:.3f} s, longest {most:.2f} s")
        if proofs:
            print(f"  proof p50 {np.median(proofs):.2f} s")
        for seed, why in unsolved:
            print(f"  {seed}: {why}")
        solved = sum(count for kind, count in kinds.items() if kind.startswith("solved"))
        assert solved >= 0.9 * TASKS
    assert not violations
