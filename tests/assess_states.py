"""Random state documents, and their results held against an independent solver."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from oracles import coal_closest

from backend.machine.load import load_machine

ROLES = ("swing", "boom", "stick", "bucket")


def random_states(models: list[str], count: int, seed: int) -> list[dict[str, Any]]:
    """Two machines near each other on slopes, joints anywhere within their limits."""
    rng = np.random.default_rng(seed)
    machines = {model: load_machine(model) for model in models}
    states = []
    for _ in range(count):
        pair = rng.choice(models, 2)
        reach = max(machines[m].max_reach for m in pair)
        apart = rng.uniform(0.6, 2.0) * reach
        bearing = rng.uniform(-np.pi, np.pi)
        document: dict[str, Any] = {"time": 0.0, "machines": {}}
        for name, model, sign in (("left", pair[0], -0.5), ("right", pair[1], 0.5)):
            machine = machines[model]
            low = np.where(np.isfinite(machine.lower), machine.lower, -np.pi)
            high = np.where(np.isfinite(machine.upper), machine.upper, np.pi)
            q = rng.uniform(low, high)
            document["machines"][name] = {
                "model": str(model),
                "position": [
                    308611.05 + sign * apart * float(np.cos(bearing)),
                    4129957.348 + sign * apart * float(np.sin(bearing)),
                    float(rng.uniform(-0.5, 0.5)),
                ],
                "yaw": float(rng.uniform(-np.pi, np.pi)),
                "pitch": float(rng.uniform(-0.25, 0.25)),
                "roll": float(rng.uniform(-0.25, 0.25)),
                "joints": {j.role: float(v) for j, v in zip(machine.joints, q, strict=True)},
            }
        states.append(document)
    return states


def assess_lines(states: list[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    """The program's results, run as anyone would run it."""
    path = folder / "states.jsonl"
    path.write_text("".join(json.dumps(state) + "\n" for state in states))
    command = [sys.executable, "-m", "cockpit.cli", "assess", "--state", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


def disagreements(results: list[dict[str, Any]]) -> dict[str, float]:
    """Largest over- and under-estimate of the closest distance against coal, and what was seen."""
    over = under = 0.0
    apart = wrong_sign = 0
    for result in results:
        ours = result["closest"][0]["distance"]
        truth = coal_closest(
            result["machines"]["left"]["bodies"], result["machines"]["right"]["bodies"]
        )
        if truth > 1e-6:
            apart += 1
            over = max(over, ours - truth)
            under = max(under, truth - ours)
        elif ours > 1e-6:
            wrong_sign += 1
    return {
        "states": len(results),
        "apart": apart,
        "over": over,
        "under": under,
        "overlaps called free": wrong_sign,
    }
