"""The method that an operator chose near limits, with all that it is told from a snapshot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backend.control.patterns import Method
from backend.errors import InputError
from backend.fusion.pose import Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState, Snapshot
from backend.pipeline.surmounting import without
from backend.pipeline.working_gauge import site_of
from backend.planning import live
from backend.planning.live import Around
from backend.planning.proximity import Limits
from backend.planning.records import Method as Way
from backend.planning.records import Thresholds
from backend.planning.stopping import threshold_warnings
from backend.safety.limiter import Wish
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import concatenated
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array

WAYS: dict[Method, Way] = {
    Method.SCALING: "scaling",
    Method.POTENTIAL: "potential",
    Method.CONSTRAINED: "constrained",
}
JUDGED_EVERY = 1.0
"""Between two judgements of whether the thresholds suffice for a machine's posture [s]."""


@dataclass(frozen=True)
class Told:
    """What a method did with a wish; scale, why: see `live.Shaped`; warnings: of the thresholds."""

    method: Method
    thresholds: Thresholds
    scale: float = 1.0
    why: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


class Methods:
    """For the machines of one cockpit; belongs to the thread of the fast loop."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._thresholds = thresholds_of(config)
        for own in config.own[:1]:
            live.rehearse(config.machines[own])  # no cycle of the loop waits for it
        self._warned: dict[str, tuple[float, tuple[str, ...]]] = {}

    def shape(
        self, name: str, method: Method, wish: Wish, snapshot: Snapshot, overridden: bool
    ) -> tuple[Wish, Told]:
        """What `method` leaves of the wish for a machine, for the limiter; and what is said of it.

        overridden: a supervisor holds to run within the limits, of which the method is one.
        """
        q = snapshot.machines[name].pose.joints
        warnings = self._warnings(name, q, snapshot.time)
        if method is Method.BRAKING:
            return wish, Told(method, self._thresholds, warnings=warnings)
        if overridden:
            why = (f"{method.value} is left out: override",)
            return wish, Told(method, self._thresholds, why=why, warnings=warnings)
        machine, way = self._config.machines[name], WAYS[method]
        try:
            around = self._around(name, snapshot)
        except Exception as error:  # nothing moves that cannot be judged
            shaped = live.failed(way, wish, error)
        else:
            shaped = live.shape(way, machine, around, wish, self._thresholds)
        told = Told(method, self._thresholds, shaped.scale, shaped.why, warnings)
        return shaped.wish, told

    def _around(self, name: str, snapshot: Snapshot) -> Around:
        config, states = self._config, snapshot.machines
        own, q = states[name], states[name].pose.joints
        unknown = next(filter(None, (self._unknown(states[k]) for k in config.machines)), "")
        if unknown or own.body is None:
            nothing = Limits((), concatenated([]))
            return Around(q, np.zeros((0, 4, 4)), nothing, np.zeros(0), unknown)
        # As `site_concern` and `proximity`: beyond the configured part, each pose's inflation.
        doubt = own.eta - config.eta
        site = without(site_of(name, snapshot.gauge, config), snapshot.surmounting.get(name))
        boxes, names = [site.boxes], _features(ByIdentity(site))
        doubts = [np.full(len(names), doubt)]
        for partner, state in states.items():
            if partner == name or state.body is None:
                continue
            boxes.append(state.body.boxes)
            parts = config.machines[partner].body_names
            names += tuple(f"{partner}:{part.partition('/')[0]}" for part in parts)
            doubts.append(np.full(len(parts), doubt + state.eta - config.eta))
        limits = Limits(names, concatenated(boxes))
        return Around(q, own.body.link_poses, limits, np.concatenate(doubts))

    def _unknown(self, state: MachineState) -> str:
        """Why a machine's pose is not certain; empty when it is."""
        if state.pose.validity is Validity.VALID and state.body is not None:
            return ""
        reason = state.pose.reasons[0] if state.pose.reasons else "is unknown"
        return f"{self._config.labels[state.pose.machine]} {reason}"

    def _warnings(self, name: str, q: Array, now: float) -> tuple[str, ...]:
        at, found = self._warned.get(name, (-np.inf, ()))
        if not 0.0 <= now - at < JUDGED_EVERY:
            found = _judged(self._config.machines[name], q, self._thresholds, self._config)
            self._warned[name] = now, found
        return found


@lru_cache(maxsize=16)
def _features(site: ByIdentity[SiteBodies]) -> tuple[str, ...]:
    """The names of a site's boxes, without their numbers."""
    return tuple(name.partition("/")[0] for name in site.value.full_names)


def thresholds_of(config: Config) -> Thresholds:
    """The site's p_u and p_l, Mäkinen's where the site's are none."""
    try:
        return Thresholds(config.limits.slow_below, config.limits.stop_below)
    except InputError:
        return Thresholds()


def _judged(machine: Machine, q: Array, thresholds: Thresholds, config: Config) -> tuple[str, ...]:
    if not np.isfinite(q).all():
        return ()
    return threshold_warnings(machine, q, thresholds, config.stop_latency)
