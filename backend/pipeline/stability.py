"""How firmly every machine stands, from the fused poses, and what that leaves of its motions.

Accelerations come from the fused joint rates over the last `WINDOW`; one that the sensors' noise
explains is none, as with the base's velocity (`fusion.motion`), and what noise is left is told as
the margin's sigma. The limits do not wait for an acceleration to be seen: they are made for the
hardest start and stop that the drives can do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from backend.fusion.align import slope, slope_sigma
from backend.fusion.motion import JOINT_WINDOW, SIGNIFICANT
from backend.fusion.pose import FusedPose, Validity
from backend.machine.model import Machine
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState
from backend.pipeline.surmounting import RULES, stability_on, tip_over_on
from backend.safety import tip_over
from backend.safety.limits import Delay
from backend.safety.record import Concern
from backend.safety.surmounting import Surmounting
from backend.safety.tip_over import TipOver
from backend.spatial.identity import ByIdentity
from backend.spatial.types import Array
from backend.stability.allowance import allowed_fractions, travel_fraction
from backend.stability.capacity import DIRECTIONS, holding_reach
from backend.stability.masses import why_unknown
from backend.stability.polygon import shrunk
from backend.stability.records import Stability
from backend.stability.state import models, stability

WINDOW = 0.2
"""Of the joint rates whose slope is the acceleration [s]."""
CURVE_PERIOD = 1.0
"""Between two curves of how far out a payload may be held [s]."""
SLICE = 6
"""Directions of a curve that are worked out in one cycle: all at once would make it late."""
_NO_CURVE: Array = np.zeros(0)
STATE_PERIOD = 0.04
"""Between two judgements of how firmly a machine stands, where there are several [s]."""
LEFT_PERIOD = 0.1
"""Between two judgements of how fast a machine's motions may be [s]; what has changed by the next
one is covered as if the drives answered that much later.
"""
ADVISED = 0.5
"""Below this share what may be done is told to those, too, who only look."""
NOBODY: Mapping[str, Surmounting] = MappingProxyType({})
_SAMPLES = 10  # of the joints in the window of a rate, for its noise


@dataclass(frozen=True)
class Rates:
    """stamps and joint rates [rad/s] of the last `WINDOW`, oldest first."""

    stamps: tuple[float, ...] = ()
    rates: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Curve:
    """How far out a payload may be held [m]. reach: by direction, empty before the first; begun:
    when the newest was begun [s]; parts: of it, until it is whole.
    """

    reach: Array = field(default_factory=lambda: _NO_CURVE)
    begun: float = -math.inf
    parts: tuple[Array, ...] = ()


_NOTHING = Curve()


@dataclass(frozen=True)
class Standing:
    """What a cycle hands to the next: by machine the recent rates, and how far out it may hold its
    payload, which is worked out anew every `CURVE_PERIOD`, a slice of one machine's a cycle; left:
    in which period the motions' fractions were judged, and they, (n, 2) and (2,); found: in which
    period each machine was judged, and how it stood.
    """

    recent: Mapping[str, Rates] = field(default_factory=dict)
    holds: Mapping[str, Curve] = field(default_factory=dict)
    left: Mapping[str, tuple[int, Array, Array]] = field(default_factory=dict)
    found: Mapping[str, tuple[int, Stability]] = field(default_factory=dict)


def following(
    before: Standing, machines: Mapping[str, MachineState], now: float, config: Config
) -> Standing:
    """With the rates of this cycle, and a slice of a curve where one is due."""
    recent = {name: _with(before.recent.get(name), s.pose) for name, s in machines.items()}
    known = [name for name, state in machines.items() if not _why(state, name, config)]
    holds = {name: before.holds.get(name, _NOTHING) for name in known}
    due = [name for name in known if holds[name].parts or now - holds[name].begun >= CURVE_PERIOD]
    rules = config.stability
    if due and rules is not None:
        # What was begun is ended first.
        name = min(due, key=lambda one: (not holds[one].parts, holds[one].begun))
        holds[name] = _further(holds[name], machines[name], name, now, config, rules)
    return Standing(recent, holds, before.left, before.found)


def standing(
    memory: Standing,
    machines: Mapping[str, MachineState],
    now: float,
    config: Config,
    climbing: Mapping[str, Surmounting] = NOBODY,
) -> tuple[Standing, dict[str, Stability]]:
    """By machine, and the memory of it. memory: with the rates of this cycle; climbing: machines
    that stand on what their plans say, which are judged in every cycle.

    Of several machines each is judged every other cycle, in periods that begin at fixed times: what
    is shown then does not depend on when one began to look.
    """
    rules = config.stability
    found: dict[str, Stability] = {
        name: stability_on(
            name, given, machines[name], _payload(name, config, rules or RULES), config
        )
        for name, given in climbing.items()
    }
    if rules is None:
        return memory, found
    kept: dict[str, tuple[int, Stability]] = {}
    for k, (name, state) in enumerate(machines.items()):
        if name in climbing:
            continue
        why = _why(state, name, config)
        if why:
            found[name] = Stability(why)
            continue
        period = math.floor(now / STATE_PERIOD + k / len(machines))
        at, last = memory.found.get(name, (None, None))
        if last is None or at != period or len(machines) == 1:
            last = _of(name, state, memory, config, rules)
        kept[name] = period, last
        holds = memory.holds.get(name, _NOTHING).reach
        found[name] = last if last.holds is holds else replace(last, holds=holds)
    return replace(memory, found=kept), found


def concerns(
    memory: Standing,
    found: Mapping[str, Stability],
    machines: Mapping[str, MachineState],
    driven: frozenset[str],
    now: float,
    config: Config,
    climbing: Mapping[str, Surmounting] = NOBODY,
) -> tuple[Standing, tuple[Concern, ...]]:
    """Of the own machines; none of a machine about which nothing is known, unless required. Those
    that climb by plan always have one.

    Limits are worked out for machines that somebody drives, and as advice below `ADVISED`; every
    `LEFT_PERIOD`, kept in the memory that is returned.
    """
    rules = config.stability
    made = [
        tip_over_on(name, given, found[name], rules or RULES, now, config)
        for name, given in climbing.items()
        if name in config.own
    ]
    if rules is None:
        return memory, tuple(made)
    left: dict[str, tuple[int, Array, Array]] = {}
    period = math.floor(now / LEFT_PERIOD)
    for name in config.own:
        if name in climbing:
            continue
        state, label = found[name], config.labels[name]
        machine = config.machines[name]
        if state.reason:
            if rules.required:
                joints = len(machine.joints)
                made.append(tip_over.unknown(name, label, joints, state.reason, now))
            continue
        allowed, travel = np.ones((len(machine.joints), 2)), np.ones(2)
        if rules.limits and (name in driven or not state.share > ADVISED):
            at, allowed, travel = memory.left.get(name, (None, allowed, travel))
            if at != period:
                allowed, travel = _left(machine, state, machines[name], config, rules)
            left[name] = period, allowed, travel
        made.append(
            tip_over.judge(name, label, state.share, state.edge, allowed, travel, rules, now)
        )
    return replace(memory, left=left), tuple(made)


def _payload(name: str, config: Config, rules: TipOver) -> float:
    return rules.payload.get(name, config.machines[name].payload)


def _why(state: MachineState, name: str, config: Config) -> str:
    """Why nothing is known of a machine, else empty."""
    pose = state.pose
    why = _masses_unknown(ByIdentity(config.machines[name]))
    if not why and (pose.validity is not Validity.VALID or state.body is None):
        why = pose.reasons[0] if pose.reasons else "the pose is unknown"
    if not why and not _slope_known(pose):
        why = "the slope is not measured"
    return why


@lru_cache(maxsize=64)
def _masses_unknown(machine: ByIdentity[Machine]) -> str:
    return why_unknown(machine.value)


def _further(
    curve: Curve, state: MachineState, name: str, now: float, config: Config, rules: TipOver
) -> Curve:
    """The curve with one slice more; shown once it is whole."""
    assert state.body is not None
    machine, payload = config.machines[name], _payload(name, config, rules)
    _, support = models(ByIdentity(machine), payload)
    T, first = state.body.link_poses[0], SLICE * len(curve.parts)
    args = machine, support, state.pose.joints, payload, T, rules.keep
    part = holding_reach(*args, slice(first, first + SLICE))
    parts, begun = (*curve.parts, part), curve.begun if curve.parts else now
    if first + SLICE < DIRECTIONS:
        return Curve(curve.reach, begun, parts)
    return Curve(np.concatenate(parts), begun)


def _of(
    name: str, state: MachineState, memory: Standing, config: Config, rules: TipOver
) -> Stability:
    """Of a machine about which enough is known."""
    assert state.body is not None
    machine, pose, recent = config.machines[name], state.pose, memory.recent[name]
    # A line through the joint's samples in its window: sigma sqrt(12 / n) / window.
    noise = pose.joint_sigmas * math.sqrt(12.0 / _SAMPLES) / JOINT_WINDOW
    rates, accelerations, spread = pose.joint_velocities, np.zeros(len(machine.joints)), 0.0 * noise
    if len(recent.stamps) > 2 and recent.stamps[-1] - recent.stamps[0] > 0.5 * WINDOW:
        stamps = list(recent.stamps)
        seen = np.array(slope(stamps, list(recent.rates), (False,) * len(rates)))
        # Rates of overlapping windows err together: as few of them count as fit side by side.
        apart = max(len(stamps) * JOINT_WINDOW / (stamps[-1] - stamps[0]), 1.0)
        spread = noise * min(slope_sigma(stamps, 1.0) * math.sqrt(min(apart, len(stamps))), 1e3)
        accelerations = np.where(np.abs(seen) > SIGNIFICANT * spread, seen, 0.0)
        # Beyond twice what a drive can do a rate was mistaken; of what it can, any is as likely.
        most = 2.0 * machine.max_acceleration
        accelerations = np.clip(accelerations, -most, most)
        spread = np.minimum(spread, machine.max_acceleration / math.sqrt(3.0))
    found = stability(
        machine,
        _payload(name, config, rules),
        pose.joints,
        rates,
        accelerations,
        (noise, spread),
        state.body.link_poses[0],
    )
    return replace(found, holds=memory.holds.get(name, _NOTHING).reach)


def _slope_known(pose: FusedPose) -> bool:
    attitude = pose.streams.get("attitude")
    return attitude is not None and attitude.received > attitude.rejected


def _left(
    machine: Machine, state: Stability, placed: MachineState, config: Config, rules: TipOver
) -> tuple[Array, Array]:
    assert placed.body is not None
    model, support = models(ByIdentity(machine), state.payload)
    kept, T = shrunk(support, rules.keep), placed.body.link_poses[0]
    pose, lags = placed.pose, Delay(0.0, 0.0)
    args = machine, model, kept, pose.joints, pose.joint_velocities
    latency = config.stop_latency + LEFT_PERIOD
    allowed = allowed_fractions(*args, latency, lags.joint_lag, T)
    fraction = travel_fraction(*args, lags.track_lag + LEFT_PERIOD, T)
    return allowed, np.full(2, fraction)


def _with(before: Rates | None, pose: FusedPose) -> Rates:
    """A rate that is no newer than the last one tells nothing new."""
    before = before or Rates()
    if pose.validity is not Validity.VALID:
        return Rates()
    if before.stamps and not pose.time > before.stamps[-1]:
        return before if pose.time == before.stamps[-1] else Rates()
    keep = sum(stamp < pose.time - WINDOW for stamp in before.stamps)
    rates = tuple(pose.joint_velocities.tolist())
    return Rates((*before.stamps[keep:], pose.time), (*before.rates[keep:], rates))
