"""A made-up manoeuvre, smooth and of the right shape, for what only shows, offers and watches them.

It obeys no mechanics: what does is tested where it is made.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from backend.documents.surmount_document import SurmountDocument, SurmountParameters
from backend.documents.surmount_live import LiveSurmount
from backend.errors import InputError
from backend.machine.kinematics import end_point
from backend.machine.model import Machine
from backend.spatial.rotation import from_attitude, to_attitude
from backend.spatial.types import Array

PHASES = (
    *(("reach", 0.0, 4.0), ("sequence 1", 4.0, 10.0), ("turn", 10.0, 16.0)),
    *(("sequence 2-1", 16.0, 22.0), ("sequence 2-2", 22.0, 28.0), ("stow", 28.0, 31.0)),
)
LEAN = 0.24
ENERGIES = (4100.0, 3650.0, 3900.0, 4400.0)
CHOSEN = 1
IMPOSSIBLE = 1.0
"""Steps from this height on are refused [m]."""


def share(t: Array, start: float, end: float) -> Array:
    """From 0 to 1, at rest at both ends."""
    u = np.clip((t - start) / (end - start), 0.0, 1.0)
    return np.asarray(u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3))


def base_of(t: Array, T_site_root: Array, height: float, distance: float) -> Array:
    """(m, 6) x, y, z, yaw, pitch, roll."""
    yaw = float(to_attitude(T_site_root[:3, :3])[0])
    first, second, third = (share(t, *PHASES[k][1:]) for k in (1, 3, 4))
    along = (distance - 0.6) * first + 0.3 * second + 1.2 * third
    up = 0.5 * height * (first + second)
    pitch = LEAN * (first - second)
    p = T_site_root[:3, 3]
    nothing = np.zeros(len(t))
    x, y = p[0] + along * math.cos(yaw), p[1] + along * math.sin(yaw)
    return np.column_stack([x, y, p[2] + up, nothing + yaw, pitch, nothing])


def joints_of(t: Array, q: Array, roles: list[str]) -> Array:
    """(m, n) from q on."""
    out = np.tile(q, (len(t), 1))
    named = {role: k for k, role in enumerate(roles)}
    out[:, named["swing"]] += math.pi * share(t, 10.0, 16.0)
    for role, amount in (("boom", -0.25), ("stick", 0.3), ("bucket", -0.2)):
        there = share(t, 0.0, 4.0) - share(t, 28.0, 31.0)
        waves = 0.2 * (share(t, 4.0, 10.0) - share(t, 10.0, 16.0) + 0.5 * share(t, 16.0, 22.0))
        out[:, named[role]] += amount * (there + waves)
    return out


def parameters(k: int) -> SurmountParameters:
    return SurmountParameters(p1=1.4 + 0.03 * k, p2=0.9, p3=1.5, p4=1.1, alpha_f=LEAN - 0.01 * k)


def document(
    machine: Machine, name: str, T_site_root: Array, q: Array, height: float, distance: float
) -> SurmountDocument:
    t = np.linspace(0.0, PHASES[-1][2], 311)
    roles = [joint.role for joint in machine.joints]
    joints, base = joints_of(t, q, roles), base_of(t, T_site_root, height, distance)
    rates = np.gradient(joints, t, axis=0)
    T = np.tile(np.eye(4), (len(t), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = from_attitude(base[:, 3], base[:, 4], base[:, 5]), base[:, :3]
    along = np.hypot(*(base[:, :2] - base[0, :2]).T)
    speed = np.gradient(along, t)
    torque = 4000.0 + 3000.0 * np.sin(t / 3.0)[:, None] * np.array([0.0, 1.0, 0.6, 0.3])
    torque[:, 0] = 0.0
    energy = np.cumsum(np.abs(np.gradient(joints, axis=0) * torque).sum(axis=1))
    starts = np.array([start for _, start, _ in PHASES])
    index = np.clip(np.searchsorted(starts, t, side="right") - 1, 0, None)
    com = np.column_stack(
        [along - distance + 0.1 * np.cos(joints[:, 0]), base[:, 2] - base[0, 2] + 0.7]
    )
    return SurmountDocument.model_validate(
        {
            "ok": True, "machine": name, "method": "search", "duration": float(t[-1]),
            "time": t.tolist(), "roles": roles, "joints": joints.tolist(),
            "joint_velocities": rates.tolist(), "tracks": np.column_stack([speed, speed]).tolist(),
            "base": base.tolist(), "end_point": end_point(machine, joints, T).tolist(),
            "phases": [
                {"name": n, "start": a, "end": b, "energy": 500.0, "min_stability_margin": 0.31}
                for n, a, b in PHASES
            ],
            "energy": ENERGIES[CHOSEN], "energy_moves": 900.0, "energy_quasi_static": 3100.0,
            "energy_potential": 2600.0, "parameters": parameters(CHOSEN),
            "obstacle": {"name": "step", "height": height, "distance": distance},
            "candidates": [candidate(k) for k in range(len(ENERGIES))],
            "checks": {
                "min_clearance": 0.12, "min_stability_margin": 0.31, "max_penetration": 0.004,
                "max_slip": 0.01, "worst_torque": 0.64, "worst_rate": 0.9,
            },
            "figures": {
                "time": t[::2].tolist(), "joints": joints[::2].tolist(),
                "rates": rates[::2].tolist(), "torques": torque[::2].tolist(),
                "torque_limits": [None, 12000.0, 11000.0, 9000.0], "energy": energy[::2].tolist(),
                "com": com[::2].tolist(), "phase": index[::2].tolist(),
            },
            "assumptions": ["hard ground"], "notes": ["made up"],
        }
    )  # fmt: skip


def candidate(k: int) -> dict[str, Any]:
    return {
        "parameters": parameters(k), "energy": ENERGIES[k], "duration": 31.0 + k,
        "min_stability_margin": 0.31 - 0.02 * k, "worst_torque": 0.64 + 0.05 * k,
        "simulated": k < 2, "chosen": k == CHOSEN,
    }  # fmt: skip


def solve(
    live: LiveSurmount,
    wanted: SurmountParameters | None,
    machines: Mapping[str, Machine],
    told: Callable[[int, int, str], bool],
) -> SurmountDocument:
    """Six steps of a thirtieth of a second, or as long as it takes somebody to stop it where the
    search shall be thorough.
    """
    machine, step = machines[live.machine], live.step
    patience = 600 if live.asked.effort == "thorough" else 6
    for k in range(patience):
        if not told(k, patience, "simulated"):
            raise InputError("stopped.")
        time.sleep(1.0 / 30.0)
    if step.height >= IMPOSSIBLE:
        why = f"a step of {step.height:.2f} m is out of the arm's reach"
        return SurmountDocument(ok=False, why=why, kind="reach", machine=live.machine)
    made = document(machine, live.machine, live.T_site_root, live.q, step.height, step.distance)
    if wanted is None:
        return made
    return made.model_copy(update={"parameters": wanted, "candidates": [], "energy": 4444.0})
