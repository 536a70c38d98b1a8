"""Everything that limits the timing of a curve, as linear rows in u = s'' and x = s'^2."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backend.machine.model import Machine
from backend.planning.trajectory.carry import cylinder
from backend.planning.trajectory.curve import Curve
from backend.planning.trajectory.records import Task
from backend.spatial.types import Array
from backend.stability.masses import MassModel
from backend.stability.polygon import Polygon
from backend.stability.zmp import edge_moment_terms

_STILL = 1e-9


class Rows(NamedTuple):
    """At grid points s (N + 1,): a u + b x <= c, each (N + 1, m), and x <= most (N + 1,)."""

    s: Array
    a: Array
    b: Array
    c: Array
    most: Array


def limit_rows(
    machine: Machine,
    task: Task,
    curve: Curve,
    intervals: int,
    masses: MassModel | None,
    support: Polygon,
) -> Rows:
    """Joint speeds and accelerations, those along theta, r, z, and moments about the edges of
    `support` (Yamashita and Kikuuwe 2025, Eq. (1)-(3), of the whole machine) not below zero.

    Accelerations also hold at the far end of each interval with the acceleration that led there.
    """
    s = np.linspace(0.0, curve.length, intervals + 1)
    q, first, second = (curve.at(s, order) for order in range(3))
    fastest, hardest = task.max_velocity(machine), task.max_acceleration(machine)
    most = ((fastest / np.maximum(np.abs(first), _STILL)) ** 2).min(axis=1)
    a, b = [first, -first], [second, -second]
    c = [np.broadcast_to(hardest, first.shape)] * 2
    limits = task.cylindrical
    if np.isfinite(limits.speed).any() or np.isfinite(limits.acceleration).any():
        one, two = _cylindrical(machine, curve, s)
        speed = (limits.speed / np.maximum(np.abs(one), _STILL)) ** 2
        most = np.minimum(most, speed.min(axis=1))
        kept = np.isfinite(limits.acceleration)
        a += [one[:, kept], -one[:, kept]]
        b += [two[:, kept], -two[:, kept]]
        c += [np.broadcast_to(limits.acceleration[kept], one[:, kept].shape)] * 2
    if masses is not None:
        by_u, by_x, rest = edge_moment_terms(masses, support, q, first, second, task.T_site_root)
        # Divided by the weight [N] these are metres, as well scaled as the other rows.
        weight = 9.81 * masses.total
        a.append(-by_u / weight)
        b.append(-by_x / weight)
        c.append(rest / weight)
    A, B, C = (np.concatenate(part, axis=1) for part in (a, b, c))
    return _both_ends(Rows(s, A, B, C, most))


def _both_ends(rows: Rows) -> Rows:
    """x at the end of an interval is x + 2 u ds, so that its rows are rows of the start, too."""
    ds = np.diff(rows.s)[:, None]
    a, b, c = rows.a, rows.b, rows.c
    a2 = np.concatenate([a[1:] + 2.0 * ds * b[1:], a[-1:]])
    b2, c2 = np.concatenate([b[1:], b[-1:]]), np.concatenate([c[1:], c[-1:]])
    return Rows(
        rows.s,
        np.concatenate([a, a2], axis=1),
        np.concatenate([b, b2], axis=1),
        np.concatenate([c, c2], axis=1),
        rows.most,
    )


def _cylindrical(machine: Machine, curve: Curve, s: Array) -> tuple[Array, Array]:
    """(N + 1, 3) first and second derivatives of theta, r, z by s, by central differences."""
    h = 1e-4 * curve.length
    middle = np.clip(s, h, curve.length - h)
    near = [cylinder(machine, curve.at(middle + k * h)) for k in (-1, 0, 1)]
    for p in (near[0], near[2]):
        p[:, 0] += 2.0 * np.pi * np.round((near[1][:, 0] - p[:, 0]) / (2.0 * np.pi))
    one = (near[2] - near[0]) / (2.0 * h)
    two = (near[2] - 2.0 * near[1] + near[0]) / h**2
    return one, two
