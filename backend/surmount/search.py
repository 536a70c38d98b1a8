"""The parameters that need the least energy: batches on a grid, and SLSQP from the best of these.

p1, p2, p3 and alpha_f are searched, p4 is given (Jayasekara and Arisumi 2015, "Optimization").
Sequence 1 depends on p1, p2 and alpha_f, sequences 2-1 and 2-2 on p3 and alpha_f: both halves are
simulated apart, and a grid of all four needs only those of its halves. Points that do not hold are
not simulated but cost more than any that does, the more the less they hold.

Nothing here runs anything: whoever asks passes `simulate`, which may do so in parallel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy import optimize

from backend.planning.trajectory.sweep import Sweep
from backend.spatial.types import Array
from backend.surmount.judge import judge, own_bodies
from backend.surmount.machine import Climber
from backend.surmount.outline import leans
from backend.surmount.records import SEQUENCES, Parameters, Spline, Step, Verdict

_minimize: Any = optimize.minimize  # its stubs know no constraints as dicts of functions
Half = Literal["front", "back"]
HALVES: dict[Half, tuple[str, ...]] = {"front": SEQUENCES[:1], "back": SEQUENCES[1:]}
COARSE = 0.03 / 0.359
"""Increment of lengths, of the boom's; the paper's 0.03 m on its shovel."""
FINE = 0.01 / 0.359
COARSE_LEAN, FINE_LEAN = np.radians(3.0), np.radians(1.0)
NUDGE = 0.01
"""For differences, of the boom's length and in radians (Table 3, lambda)."""
STARTS = 3
"""Of SLSQP."""
DEAR = 3.0
"""What does not hold costs this many times the best that does, and more."""
ROWS = 31
SPARE = 0.15
"""Of clearance and margin, that a search keeps beyond what is demanded."""


class Job(NamedTuple):
    """One half to be simulated."""

    half: Half
    parameters: Parameters
    spline: Spline | None = None

    @property
    def key(self) -> tuple[float, ...]:
        """By what it depends on, to a micrometre and a microradian."""
        p, s = self.parameters, self.spline
        own = (p.p1, p.p2) if self.half == "front" else (p.p3, p.p4)
        bent = () if s is None or self.half == "back" else (s.low, s.high)
        return tuple(round(float(v), 6) for v in (*own, p.alpha_f, *bent))


class Simulated(NamedTuple):
    """energy [J], infinite where `why` says what went wrong."""

    energy: float
    why: str = ""


Simulate = Callable[[Sequence[Job]], list[Simulated]]
Told = Callable[[int, int, str], bool]


class CancelledError(Exception):
    """Whoever was told of the progress did not want more of it."""


@dataclass(frozen=True)
class Found:
    """parameters with their energy [J], of the front's and the back's simulation."""

    parameters: Parameters
    energy: float
    by: str
    spline: Spline | None = None


_Rated = tuple[Parameters, float]


@dataclass
class Search:
    """One step and machine. told: hears of done, of, in words, and says whether to go on.

    simulations: how many halves were simulated; kept: all of them; refusals: by kind how often
    it was what did not hold first, and the verdict that came nearest to holding.
    """

    climber: Climber
    step: Step
    p4: float
    simulate: Simulate
    told: Told = lambda done, of, words: True
    kept: dict[tuple[Half, tuple[float, ...]], Simulated] = field(default_factory=dict)
    simulations: int = 0
    own: Sweep | None = None
    refusals: dict[str, tuple[int, Verdict]] = field(default_factory=dict)
    strict: Climber = field(init=False)

    def __post_init__(self) -> None:
        if self.own is None:
            self.own = own_bodies(self.climber)
        # Between the rows of a search a little more is lost than between those of the last look.
        demands = self.climber.demands
        more = replace(
            demands,
            clearance=demands.clearance + SPARE * demands.clearance,
            margin=demands.margin + SPARE * demands.margin,
        )
        self.strict = replace(self.climber, demands=more)

    @property
    def boom(self) -> float:
        """[m]"""
        return self.climber.machine.sun.lengths[1]

    def bounds(self) -> Array:
        """(4, 2) of p1, p2, p3 [m] and alpha_f [rad]."""
        climber = self.climber
        l1, l2, l3, _ = climber.machine.sun.lengths
        stretch = l1 + l2 + l3
        low, high = leans(self.step.height, climber.a, climber.r)
        nose = climber.a + climber.r
        near = 4.0 * climber.edge[0]
        return np.array(
            [
                [nose, max(stretch - near, nose + near)],
                [near, max(stretch - nose, 2.0 * near)],
                [near, max(stretch - self.p4, 2.0 * near)],
                [low, high],
            ]
        )

    def verdict(self, half: Half, parameters: Parameters, spline: Spline | None = None) -> Verdict:
        """What holds of one half."""
        return judge(
            self.strict, self.step, parameters, spline, ROWS, self.own, HALVES[half], quick=True
        )[0]

    def energies(self, jobs: Sequence[Job], words: str = "") -> list[float]:
        """[J] of halves, simulated unless they were; infinite where they fail."""
        new = list({(job.half, job.key): job for job in jobs}.values())
        new = [job for job in new if (job.half, job.key) not in self.kept]
        size = 16
        for k in range(0, len(new), size):
            some = new[k : k + size]
            for job, made in zip(some, self.simulate(some), strict=True):
                self.kept[job.half, job.key] = made
            self.simulations += len(some)
            if words and not self.told(min(k + size, len(new)), len(new), words):
                raise CancelledError
        return [self.kept[job.half, job.key].energy for job in jobs]

    def batch(self, around: Parameters | None = None, simulated: bool = True) -> list[Found]:
        """All that hold on a grid, the best first: the coarse one over the bounds, or the fine one
        up to 3 increments around parameters. simulated: else with quasi-static energies.
        """
        bounds = self.bounds()
        if around is None:
            steps = np.array([COARSE * self.boom] * 3 + [COARSE_LEAN])
            axes = [
                np.arange(low, high + 1e-9, step)
                for (low, high), step in zip(bounds, steps, strict=True)
            ]
            words = "coarse batch"
        else:
            steps = np.array([FINE * self.boom] * 3 + [FINE_LEAN])
            middle = around.free
            axes = []
            for k in range(4):
                axis = middle[k] + steps[k] * np.arange(-3, 4)
                axes.append(axis[(axis >= bounds[k, 0] - 1e-9) & (axis <= bounds[k, 1] + 1e-9)])
            words = "fine batch"
        front, back = self._grids(axes)
        if simulated:
            jobs = [Job("front", one) for one, _ in front] + [Job("back", one) for one, _ in back]
            values = self.energies(jobs, words)
            front = [(one, e) for (one, _), e in zip(front, values[: len(front)], strict=True)]
            back = [(one, e) for (one, _), e in zip(back, values[len(front) :], strict=True)]
        found = [
            Found(replace(one, p3=other.p3), e1 + e2, words if simulated else "quasi-static batch")
            for one, e1 in front
            for other, e2 in back
            if one.alpha_f == other.alpha_f and np.isfinite(e1 + e2)
        ]
        return sorted(found, key=lambda one: one.energy)

    def _grids(self, axes: list[Array]) -> tuple[list[_Rated], list[_Rated]]:
        """What holds of front and back, with quasi-static energies."""
        front: list[_Rated] = []
        back: list[_Rated] = []
        p1s, p2s, p3s, slopes = axes
        stretch = sum(self.climber.machine.sun.lengths[:3])
        for n, alpha in enumerate(slopes):
            if not self.told(n, len(slopes), "which parameters hold"):
                raise CancelledError
            first = Parameters(float(p1s[0]), float(p2s[0]), float(p3s[0]), self.p4, float(alpha))
            behind = []
            for p3 in p3s:
                tried = replace(first, p3=float(p3))
                # Maximum stretch (21).
                if p3 + self.p4 <= stretch:
                    behind += self._rated("back", tried)
            if not behind:
                continue
            back += behind
            for p1 in p1s:
                for p2 in p2s[p1 + p2s <= stretch]:
                    front += self._rated("front", replace(first, p1=float(p1), p2=float(p2)))
        return front, back

    def _rated(self, half: Half, tried: Parameters) -> list[_Rated]:
        verdict = self.verdict(half, tried)
        if verdict.holds:
            return [(tried, verdict.energy)]
        count, nearest = self.refusals.get(verdict.kind, (0, verdict))
        if verdict.values.min() > nearest.values.min():
            nearest = verdict
        self.refusals[verdict.kind] = count + 1, nearest
        return []

    def cost(self, tried: Sequence[Parameters], dear: float) -> list[float]:
        """[J] of each; what does not hold costs `dear` [J] and more, without being simulated."""
        jobs, costs = [], []
        for parameters in tried:
            left = [float(self.verdict(half, parameters).values.min()) for half in HALVES]
            costs.append(0.0 if min(left) >= -1e-9 else dear * (1.0 - min(left)))
            if costs[-1] == 0.0:
                jobs += [Job(half, parameters) for half in HALVES]
        values = iter(self.energies(jobs))
        made = [c if c > 0.0 else next(values) + next(values) for c in costs]
        return [m if np.isfinite(m) else dear for m in made]

    def slsqp(self, start: Found) -> Found:
        """SciPy's SLSQP from there, with differences of NUDGE, towards where all is held."""
        bounds = self.bounds()
        scale = np.array([self.boom] * 3 + [1.0])
        dear = DEAR * start.energy
        best = [start]

        def at(x: Array) -> Parameters:
            free = np.clip(x * scale, bounds[:, 0], bounds[:, 1])
            return start.parameters.with_free(free)

        def around(x: Array) -> list[Array]:
            # Towards the inside where a bound is near.
            signs = np.where((x + NUDGE) * scale > bounds[:, 1], -1.0, 1.0)
            return [x + NUDGE * sign * row for sign, row in zip(signs, np.eye(4), strict=True)]

        def energy(x: Array) -> float:
            value = self.cost([at(x)], dear)[0]
            if value < best[0].energy:
                best[0] = Found(at(x), value, "SLSQP")
            return value / start.energy

        def gradient(x: Array) -> Array:
            points = around(x)
            values = self.cost([at(p) for p in (x, *points)], dear)
            if not self.told(self.simulations, 0, "SLSQP"):
                raise CancelledError
            steps = np.array([p[k] - x[k] for k, p in enumerate(points)])
            return np.asarray((np.array(values[1:]) - values[0]) / steps / start.energy)

        def left(x: Array) -> Array:
            made = [
                judge(self.strict, self.step, at(x), None, ROWS, self.own, names)[0].values
                for names in HALVES.values()
            ]
            return np.asarray(np.clip(np.concatenate(made), -10.0, 10.0))

        def slopes(x: Array) -> Array:
            here, points = left(x), around(x)
            steps = [p[k] - x[k] for k, p in enumerate(points)]
            return np.stack(
                [(left(p) - here) / s for p, s in zip(points, steps, strict=True)], axis=1
            )

        _minimize(
            energy,
            start.parameters.free / scale,
            jac=gradient,
            method="SLSQP",
            bounds=[(float(low), float(high)) for low, high in bounds / scale[:, None]],
            constraints=[{"type": "ineq", "fun": left, "jac": slopes}],
            options={"maxiter": 40, "ftol": 1e-5},
        )
        return best[0]

    def settled(self, start: Found, smallest: float = 0.25) -> Found:
        """By trying a step either way along every parameter, from the fine increments down to a
        quarter of them: where no step helps any more."""
        bounds = self.bounds()
        steps = np.array([FINE * self.boom] * 3 + [FINE_LEAN])
        size, best = 1.0, start
        while size >= smallest:
            tried = []
            for row in np.concatenate([np.diag(steps), -np.diag(steps)]) * size:
                free = np.clip(best.parameters.free + row, bounds[:, 0], bounds[:, 1])
                if np.abs(free - best.parameters.free).max() > 1e-9:
                    tried.append(best.parameters.with_free(free))
            values = self.cost(tried, DEAR * best.energy)
            if not self.told(self.simulations, 0, "settling"):
                raise CancelledError
            k = int(np.argmin(values))
            if values[k] < best.energy:
                best = Found(tried[k], values[k], best.by)
            else:
                size *= 0.5
        return best

    def bent(self, start: Found) -> Found:
        """Another way up in sequence 1 than the cubic: the spline that needs least from there."""
        best = replace(start, spline=Spline())
        back = self.energies([Job("back", start.parameters)])[0]
        size = 0.06
        while size >= 0.01:
            tried = []
            assert best.spline is not None
            for low, high in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1)):
                spline = Spline(best.spline.low + size * low, best.spline.high + size * high)
                rising = 0.02 < spline.low < spline.high < 0.98
                if rising and self.verdict("front", start.parameters, spline).holds:
                    tried.append(spline)
            jobs = [Job("front", start.parameters, spline) for spline in tried]
            values = self.energies(jobs)
            if not self.told(self.simulations, 0, "spline"):
                raise CancelledError
            k = int(np.argmin(values)) if values else -1
            if values and values[k] + back < best.energy:
                best = Found(start.parameters, values[k] + back, "spline", tried[k])
            else:
                size *= 0.5
        return best
