"""What campaigns and small tests count: certificates, exact cells and margins against judges."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from engines import Coal, Fcl, by_configuration, fcl_touch, judged_by
from random_scenes import Scene, free_configurations
from separating_axes import (
    CHUNK,
    box_gaps,
    clearance,
    near_pairs,
    near_self_pairs,
    placed,
    touching,
)

from backend.cspace import margins as own_margins
from backend.cspace.exact import JointGrid
from backend.cspace.joint_image import SELF, certified4, joint4

CONTACT = 1e-9
"""Gaps and penetrations below this are contact, which rounding decides [m]."""

Shape = tuple[int, int, int, int]


def borders(state: np.ndarray) -> np.ndarray:
    """Cells with a neighbour along one joint whose state is another one."""
    out = np.zeros(state.shape, dtype=bool)
    for axis in range(state.ndim):
        a = tuple(slice(1, None) if k == axis else slice(None) for k in range(state.ndim))
        b = tuple(slice(None, -1) if k == axis else slice(None) for k in range(state.ndim))
        differs = state[a] != state[b]
        out[a] |= differs
        out[b] |= differs
    return out


def _cells(rng: np.random.Generator, among: np.ndarray, count: int) -> np.ndarray:
    """(count, 4) indices of cells drawn from a mask, any when it is empty."""
    flat = np.flatnonzero(among)
    chosen = rng.choice(flat, count) if len(flat) else rng.integers(0, among.size, count)
    return np.stack(np.unravel_index(chosen, among.shape), axis=1)


def _within(rng: np.random.Generator, grid: JointGrid, index: np.ndarray) -> np.ndarray:
    """(k, 4) a configuration in each cell; a quarter on its corners and edges."""
    share = rng.uniform(0.0, 1.0, index.shape)
    special = rng.random(len(index)) < 0.25
    share[special] = rng.choice([0.0, 0.5, 1.0], share[special].shape)
    return np.asarray(grid.lower + (index + share) * grid.steps)


def certificates(
    scene: Scene, shape: Shape, eta: float, samples: int, coal_samples: int, seed: int
) -> Counter[str]:
    """Configurations judged against their cells' certificates, at eta 0 and at `eta` [m].

    Half of them in certified cells beside cells of another state; the first `coal_samples` of those
    are judged by coal too, and as many for the distance from obstacles.
    """
    machine, obstacles = scene.machine, scene.obstacles
    rng = np.random.default_rng(seed)
    built = certified4(machine, scene.layers, 0.0, shape)
    grown = certified4(machine, scene.layers, eta, shape)
    free, free_grown = built.certified_free(), grown.certified_free()
    blocked = built.certified_colliding()
    border = [
        borders(f.astype(np.int8) - b) & (f | b)
        for f, b in ((free, blocked), (free_grown, grown.certified_colliding()))
    ]
    quarter = samples // 4
    index = np.concatenate(
        [
            _cells(rng, border[0] & free, quarter // 2),
            _cells(rng, border[0] & blocked, quarter // 2),
            _cells(rng, border[1] & free_grown, quarter // 2),
            _cells(rng, border[1] & grown.certified_colliding(), quarter // 2),
        ]
    )
    index = rng.permutation(index)
    near = len(index)
    index = np.concatenate([index, _cells(rng, np.ones(shape, bool), samples - near)])
    q = _within(rng, built.grid, index)
    at = tuple(index.T)
    is_free, is_free_grown = free[at], free_grown[at]
    is_blocked, is_blocked_grown = blocked[at], grown.certified_colliding()[at]

    out: Counter[str] = Counter()
    out["judged by SAT"] = len(q)
    out["beside a border"] = near
    out["in free cells"], out["in colliding cells"] = is_free.sum(), is_blocked.sum()
    out["in free cells, eta"] = is_free_grown.sum()
    out["free and colliding"] = (free & blocked).sum() + (free_grown & blocked).sum()
    out["colliding cells that eta changes"] = (is_blocked != is_blocked_grown).sum()
    by_sat = touching(machine, q, obstacles).any(axis=1)
    n = min(coal_samples, near)
    by_coal = judged_by(Coal, machine, q[:n], obstacles).any(axis=1)
    out["judged by coal"] = n
    out["coal against SAT"] = (by_coal != by_sat[:n]).sum()
    for judge, touched in (("SAT", by_sat), ("coal", by_coal)):
        k = len(touched)
        for name, wrong in (
            ("free, yet touches", is_free[:k] & touched),
            ("free at eta, yet touches", is_free_grown[:k] & touched),
            ("colliding, yet free", is_blocked[:k] & ~touched),
        ):
            found = np.flatnonzero(wrong)
            gaps = np.array([clearance(machine, q[f], obstacles) for f in found])
            out[f"{name}: {judge}"] = (np.abs(gaps) > CONTACT).sum()
            out["contact within 1e-9 m"] += (np.abs(gaps) <= CONTACT).sum()
    _displaced(scene, q[is_free_grown], eta, rng, out)
    _near(scene, q[:n][is_free_grown[:n]], eta, out)
    return out


def _displaced(
    scene: Scene, q: np.ndarray, eta: float, rng: np.random.Generator, out: Counter[str]
) -> None:
    """Each obstacle somewhere else for each configuration: half by eta exactly, half by less."""
    out["displaced: SAT"] = 0
    for start in range(0, len(q), CHUNK):
        part = q[start : start + CHUNK]
        shifts = rng.normal(size=(len(part), len(scene.obstacles), 3))
        shifts /= np.linalg.norm(shifts, axis=2, keepdims=True)
        size = rng.uniform(0.0, 1.0, (*shifts.shape[:2], 1)) ** (1.0 / 3.0)
        size[rng.random(size.shape) < 0.5] = 1.0
        hit = touching(scene.machine, part, scene.obstacles, eta * size * shifts)
        out["displaced: SAT"] += hit[:, 0].sum()
    out["displaced configurations"] = len(q)


def _near(scene: Scene, q: np.ndarray, eta: float, out: Counter[str]) -> None:
    """coal finds no obstacle within eta: what no displacement at all can undo."""
    engine = Coal(scene.machine.bodies.half_extents, scene.obstacles)
    out["within eta: coal"] = 0
    for start in range(0, len(q), CHUNK):
        own = placed(scene.machine, q[start : start + CHUNK])
        c, i, j = near_pairs(own, scene.obstacles, eta)
        for k, pairs in enumerate(by_configuration(c, len(own.centers))):
            engine.place(own, k)
            # coal's own tolerance is 1e-6 m.
            out["within eta: coal"] += any(
                engine.nearer(int(i[p]), int(j[p]), eta - 2e-6) for p in pairs
            )
    out["asked for eta by coal"] = len(q)


@dataclass(frozen=True)
class Disagreement:
    """One cell's centre q (4,), by layer: whether it touches. clearance [m]."""

    layer: str
    q: np.ndarray
    ours: bool
    fcl: bool
    coal: bool
    sat: bool
    clearance: float

    @property
    def ours_is_wrong(self) -> bool:
        """FCL disagrees, and so does another judge, not within contact."""
        seconded = self.ours != self.coal or self.ours != self.sat
        return self.ours != self.fcl and seconded and abs(self.clearance) > CONTACT


@dataclass(frozen=True)
class ExactFound:
    """Cells beside a border of the exact image; what FCL, and what SAT, sees otherwise."""

    cells: int
    touching: int
    sat_differs: int
    disagreements: list[Disagreement]


def exact_cells(scene: Scene, shape: Shape, samples: int, seed: int) -> ExactFound:
    """Centres of cells beside a border of the exact image, layer by layer, against python-fcl."""
    machine, obstacles = scene.machine, scene.obstacles
    rng = np.random.default_rng(seed)
    image = joint4(machine, scene.layers, shape)
    others = np.logical_or.reduce([image.layer(name) for name in scene.layers])
    layers = np.stack([others, image.layer(SELF)], axis=-1)
    # Half beside the borders of each, so that neither hides the other.
    index = np.concatenate([_cells(rng, borders(layers[..., k]), samples // 2) for k in range(2)])
    q = np.stack([image.grid.centers(k)[index[:, k]] for k in range(4)], axis=1)
    ours = layers[tuple(index.T)]
    by_fcl = judged_by(Fcl, machine, q, obstacles)
    by_sat = touching(machine, q, obstacles)
    found = []
    for k, layer in np.argwhere((ours != by_fcl) | (ours != by_sat)):
        only = obstacles if layer == 0 else obstacles.take(np.zeros(0, dtype=np.int64))
        alone = machine if layer == 1 else replace(machine, self_pairs=())
        found.append(
            Disagreement(
                layer=("obstacles", SELF)[layer],
                q=q[k],
                ours=bool(ours[k, layer]),
                fcl=bool(by_fcl[k, layer]),
                coal=bool(judged_by(Coal, machine, q[k : k + 1], obstacles)[0, layer]),
                sat=bool(by_sat[k, layer]),
                clearance=clearance(alone, q[k], only),
            )
        )
    beyond = [d for d in found if d.ours != d.sat and abs(d.clearance) > CONTACT]
    return ExactFound(len(q), int(ours.any(axis=1).sum()), len(beyond), found)


FINE, COARSE = 2e-4, 4e-3
"""Steps of the sweep close to the end of a margin and elsewhere [rad]."""
CLOSE = 0.010


def swept_margins(scene: Scene, states: int, eta: float, seed: int) -> Counter[str]:
    """Every joint's margins both ways from random free states, against a sweep by python-fcl.

    With eta > 0 [m] obstacles nearer than that are contact, as coal measures: python-fcl's
    distances are now and then too long. Counts: "optimistic" contacts before the margin's end;
    "late" ones more than a fine step after it, though what it names is not in contact to 1e-7 m
    ("grazing" when it is); "misnamed" ones with a pair that is not in contact at the first contact.
    """
    out: Counter[str] = Counter()
    sweep = _Sweep(scene, eta)
    for q in free_configurations(scene, states, seed, eta):
        out["states"] += 1
        for k, margin in enumerate(own_margins.margins(scene.machine, q, scene.obstacles, eta)):
            direction = np.zeros(len(q))
            direction[k // 2] = 1.0 if k % 2 else -1.0
            out["directions"] += 1
            _one_margin(sweep, q, direction, margin, out)
    return out


def _one_margin(
    sweep: _Sweep, q: np.ndarray, direction: np.ndarray, margin: Any, out: Counter[str]
) -> None:
    end = margin.free
    before = np.arange(end - 1e-6, max(end - CLOSE, 0.0), -FINE)[::-1]
    coarse = np.arange(0.0, max(end - CLOSE, 0.0), COARSE)
    steps = np.concatenate([coarse, before])
    out["positions"] += len(steps)
    if sweep.first_contact(q, direction, steps) is not None:
        out["optimistic"] += 1
        return
    if margin.hit is None:
        out["to the limit"] += 1
        j = int(np.flatnonzero(direction)[0])
        limit = (sweep.machine.upper if direction[j] > 0.0 else sweep.machine.lower)[j]
        wanted = min(abs(limit - q[j]), 2.0 * np.pi)
        out["limit missed"] += abs(end - wanted) > 1e-9
        return
    out["to a contact"] += 1
    out["to itself"] += margin.with_self
    named = (margin.own, margin.hit, margin.with_self)
    in_contact = sweep.gap(q + end * direction, named) <= 1e-7
    found = sweep.first_contact(q, direction, end + FINE * np.arange(1, 51))
    if found is None or found[0] > end + FINE * 1.5:
        # Between corners the gap along separating axes, which margins use, is below the distance.
        expected = "grazing" if sweep.eta == 0.0 else "short of eta"
        out[expected if in_contact else "late"] += 1
        return
    out["misnamed"] += named not in found[1] and not (sweep.eta > 0.0 and in_contact)


class _Sweep:
    """A machine moving in a scene, pair by pair."""

    def __init__(self, scene: Scene, eta: float) -> None:
        self.machine, self._others, self.eta = scene.machine, scene.obstacles, eta
        halves = scene.machine.bodies.half_extents
        self._fcl, self._coal = Fcl(halves, self._others), Coal(halves, self._others)

    def first_contact(
        self, q: np.ndarray, direction: np.ndarray, steps: np.ndarray
    ) -> tuple[float, set[tuple[int, int, bool]]] | None:
        """The first of the steps at which something touches, and all that does there."""
        moved = self._moved(q, direction)
        for start in range(0, len(steps), 200):
            part = steps[start : start + 200]
            own = placed(self.machine, q + part[:, None] * direction)
            c, i, j = near_pairs(own, self._others, self.eta)
            s, a, b = near_self_pairs(self.machine, own)
            keep, apart = moved[i], moved[a] != moved[b]
            c, i, j = c[keep], i[keep], j[keep]
            s, a, b = s[apart], a[apart], b[apart]
            against, itself = (by_configuration(v, len(part)) for v in (c, s))
            for k in range(len(part)):
                others = [(int(i[p]), int(j[p])) for p in against[k]]
                inner = [(int(a[p]), int(b[p])) for p in itself[k]]
                bodies = {m for m, _ in others} | {m for pair in inner for m in pair}
                self._fcl.place(own, k, bodies)
                if self.eta > 0.0:
                    self._coal.place(own, k, bodies)
                hits = {(m, n, False) for m, n in others if self._contact(m, n)}
                hits |= {(m, n, True) for m, n in inner if self._fcl.pair(m, n)}
                if hits:
                    return float(part[k]), hits
        return None

    def _contact(self, i: int, j: int) -> bool:
        if self.eta > 0.0:
            # coal's own tolerance is 1e-6 m.
            return self._coal.nearer(i, j, self.eta - 2e-6)
        return fcl_touch(self._fcl.own[i], self._fcl.obstacles[j])

    def gap(self, q: np.ndarray, named: tuple[int, int, bool]) -> float:
        """Separating gap of one pair, less what counts as contact [m]."""
        i, j, itself = named
        own, others = placed(self.machine, q[None]), self._others
        if itself:
            b = (own.centers[0, j], own.rotations[0, j], own.halves[j])
        else:
            b = (others.centers[j], others.rotations[j], others.half_extents[j])
        a = (own.centers[0, i], own.rotations[0, i], own.halves[i])
        found = float(box_gaps(*(v[None] for v in a), *(v[None] for v in b))[0])
        return found if itself else found - self.eta

    def _moved(self, q: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """(n,) which bodies the direction carries along."""
        own = placed(self.machine, np.stack([q, q + 0.1 * direction]))
        turned = np.abs(own.rotations[0] - own.rotations[1]).max(axis=(1, 2))
        return np.asarray(turned > 1e-6)
