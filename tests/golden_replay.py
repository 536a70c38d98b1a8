"""Golden results of the shipped sessions: what today's pipeline concludes of them, in short.

`make golden` writes them anew, on purpose; `tests/session/test_golden.py` compares.
"""

from __future__ import annotations

import json
import math
from itertools import groupby
from pathlib import Path
from typing import Any

from backend.pipeline.records import Snapshot
from backend.shell.session.cycles import Topics
from backend.shell.session.evaluate import evaluate
from backend.shell.session.reader import open_session
from backend.site.site import load_site
from cockpit.desk import load_models, make_config
from cockpit.playback import recorded_site

ROOT = Path(__file__).resolve().parents[1]
SESSIONS = ROOT / "scenes" / "sessions"
GOLDEN = ROOT / "tests" / "golden"
SITES: dict[str, str | None] = {
    "near-miss": "demo",
    "sun2020-experiment": "sun2020-experiment",
    "ballast": "ballast",
    "step": None,  # as it stands in the session, without RIGHT
}

DISTANCE, ANGLE = 1e-5, 1e-6
"""Tolerances [m], [rad]: rounding of another processor's arithmetic, nothing that is seen."""


def summary(name: str) -> dict[str, Any]:
    """The whole session, every cycle evaluated."""
    parts = SESSIONS / name
    session = open_session(parts if parts.is_dir() else SESSIONS / f"{name}.mcap")
    chosen = SITES[name]
    site = recorded_site(session) if chosen is None else load_site(chosen)
    config = make_config(site, load_models(site), (), "PLAYBACK")
    moments = [
        ((portion.time - session.begin) / 1e9, snapshot)
        for portion, snapshot in evaluate(session, Topics.of(site), config)
    ]
    return {
        "cycles": len(moments),
        "clearance": {
            f"{pair.a}|{pair.b}": [
                [round(t, 3), _or_none(snapshot.pairs[k].distance)] for t, snapshot in moments[::5]
            ]
            for k, pair in enumerate(moments[-1][1].pairs)
        },
        "levels": {machine: _levels(machine, moments) for machine in config.own},
        "alarms": _alarms(moments),
        "poses": [_poses(t, snapshot) for t, snapshot in moments[::50]],
        "margins": [_margins(t, snapshot) for t, snapshot in moments[::50]],
    }


def _or_none(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _levels(machine: str, moments: list[tuple[float, Snapshot]]) -> list[list[Any]]:
    """[from cycle, level] at every change."""
    worst = [
        max((c.level for c in s.concerns if c.machine == machine), default=None) for _, s in moments
    ]
    changes, at = [], 0
    for level, run in groupby(worst):
        changes.append([at, None if level is None else level.name])
        at += len(list(run))
    return changes


def _alarms(moments: list[tuple[float, Snapshot]]) -> list[list[Any]]:
    """[first cycle, machine, concern, level] of every alarm."""
    first: dict[tuple[str, str, str], int] = {}
    for k, (_, snapshot) in enumerate(moments):
        for alarm in snapshot.alarms:
            if alarm.active:
                concern = alarm.concern
                first.setdefault((concern.machine, concern.name, concern.level.name), k)
    return [[k, *key] for key, k in sorted(first.items(), key=lambda one: one[1])]


def _poses(t: float, snapshot: Snapshot) -> dict[str, Any]:
    machines = {}
    for name, state in snapshot.machines.items():
        pose = state.pose
        numbers = [*pose.position, pose.yaw, pose.pitch, pose.roll, *pose.joints, state.eta]
        machines[name] = {
            "validity": pose.validity.value,
            "numbers": [_or_none(float(v)) for v in numbers],
        }
    return {"time": round(t, 3), "machines": machines}


def _margins(t: float, snapshot: Snapshot) -> dict[str, Any]:
    free = {
        name: [[_or_none(one.free), one.hits] for both in margins.joints for one in both]
        for name, margins in snapshot.margins.items()
    }
    return {"time": round(t, 3), "free": free}


def main() -> None:
    for name in SITES:
        path = GOLDEN / f"{name}.json"
        path.write_text(json.dumps(summary(name), indent=1) + "\n", encoding="utf-8")
        print(f"{path.relative_to(ROOT)} written: look at its diff before committing it")


if __name__ == "__main__":
    main()
