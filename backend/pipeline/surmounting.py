"""Machines that are taken over an obstacle by plan: their pose against it, and what counts then."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from backend.collision.cover import cover
from backend.collision.scene import Scene
from backend.collision.server import closest
from backend.fusion.inflation import spread
from backend.fusion.pose import FusedPose, Validity
from backend.machine.model import Machine
from backend.pipeline.braking import LONGEST_DELAY, age_of, motion_of
from backend.pipeline.config import Config
from backend.pipeline.records import MachineState
from backend.pipeline.site_concern import NEAR, rows_to, standing
from backend.safety import surmounting, tip_over
from backend.safety.approach import Approach, approach_standing, standing_reach
from backend.safety.hulls import hulls
from backend.safety.partner import Limits
from backend.safety.record import Concern
from backend.safety.surmounting import Surmounting
from backend.safety.tip_over import TipOver
from backend.site.named_bodies import SiteBodies
from backend.spatial.angles import wrap
from backend.spatial.identity import ByIdentity
from backend.spatial.types import BoolArray
from backend.stability.footing import standing_on
from backend.stability.masses import why_unknown
from backend.stability.records import Stability

RULES = TipOver()
"""How tipping over is judged where the site judges none: on an obstacle it always is."""
DOUBT = 0.2
"""Share of a planned clearance to what is climbed that the pose's uncertainty may use up."""


def in_force(
    given: Mapping[str, Surmounting], machines: Mapping[str, MachineState], now: float
) -> dict[str, Surmounting]:
    """Of the machines that there are, what was told just now."""
    return {
        name: one
        for name, one in given.items()
        if name in machines and abs(now - one.time) <= surmounting.STALE
    }


def without(around: SiteBodies, given: Surmounting | None) -> SiteBodies:
    """The site without what is climbed; the same object for the same obstacles."""
    return around if given is None else _parted(ByIdentity(around), given.obstacles)[0]


def surmounting_concern(
    own: str,
    given: Surmounting,
    state: MachineState,
    stands: Stability,
    around: SiteBodies,
    now: float,
    config: Config,
    driven: bool,
) -> Concern:
    """The verdict on one own machine. around: the bodies that would hold for it; stands: on what
    the plan says.
    """
    machine, label = config.machines[own], config.labels[own]
    joints = len(machine.joints)
    if state.pose.validity is not Validity.VALID or state.body is None:
        reason = state.pose.reasons[0] if state.pose.reasons else "is unknown"
        return surmounting.unknown(own, joints, f"{label} {reason}", now)
    climbed = standing(_parted(ByIdentity(around), given.obstacles)[1])
    limits = surmounting.limits_of(given, config.limits)
    # The pose may be wrong by what its inflation holds beyond the configured factor; but how it
    # lies to what it stands on is known better than where both are.
    doubt = min(state.eta - config.eta, DOUBT * given.clearance)
    kept = _kept(ByIdentity(machine), given.touching)
    found = closest(climbed, state.body.boxes.take(kept), limits.slow_below + doubt)
    found = replace(found, link=np.flatnonzero(kept)[found.link])
    rows = rows_to(machine, state, climbed, found, doubt)
    names = tuple(f"{own}:{name}" for name in machine.body_names), climbed.names
    braking = _approach(machine, state, climbed, limits, given, now) if driven else None
    return surmounting.judge(
        own,
        label,
        joints,
        given,
        off_plan(given, state.pose),
        stands.margin,
        rows,
        names,
        limits,
        now,
        braking,
    )


def off_plan(given: Surmounting, pose: FusedPose) -> str:
    """How far the base is off its place, in words; empty within the tolerance."""
    far = float(np.linalg.norm(pose.position - np.array(given.position)))
    if not far <= given.tolerance[0]:
        return f"its base is {far:.2f} m off"
    names = ("yaw", "pitch", "roll")
    seen = np.array([pose.yaw, pose.pitch, pose.roll])
    turned = np.abs(wrap(seen - np.array(given.attitude)))
    k = int(np.argmax(turned))
    if not turned[k] <= given.tolerance[1]:
        return f"its {names[k]} is {math.degrees(turned[k]):.0f}° off"
    return ""


def stability_on(
    own: str, given: Surmounting, state: MachineState, payload: float, config: Config
) -> Stability:
    """How firmly it stands on what the plan says that it stands on."""
    machine, pose = config.machines[own], state.pose
    why = why_unknown(machine)
    if not why and (pose.validity is not Validity.VALID or state.body is None):
        why = pose.reasons[0] if pose.reasons else "the pose is unknown"
    if why or state.body is None:
        return Stability(why)
    points = np.array(given.support, dtype=float).reshape(-1, 3)
    T = state.body.link_poses[0]
    return standing_on(machine, payload, pose.joints, T, pose.yaw, points)


def tip_over_on(
    own: str, given: Surmounting, found: Stability, rules: TipOver, now: float, config: Config
) -> Concern:
    """Tipping over what the plan stands on; not knowing is no reason to go on, on an obstacle."""
    label, joints = config.labels[own], len(config.machines[own].joints)
    if found.reason:
        nothing = surmounting.unknown(own, joints, f"{label} tip-over: {found.reason}", now)
        return replace(nothing, name=tip_over.NAME)
    stands = found.margin, found.share, found.edge
    return surmounting.tips(own, label, joints, given, stands, rules, now)


@lru_cache(maxsize=16)
def _parted(
    around: ByIdentity[SiteBodies], obstacles: tuple[str, ...]
) -> tuple[SiteBodies, SiteBodies]:
    """Without the obstacles, and they alone."""
    site = around.value
    climbed = np.array([_feature(name) in obstacles for name in site.names], dtype=bool)
    parts = []
    for kept in (~climbed, climbed):
        names = tuple(name for name, keep in zip(site.names, kept, strict=True) if keep)
        parts.append(replace(site, boxes=site.boxes.take(kept), names=names))
    return parts[0], parts[1]


def _feature(name: str) -> str:
    """The name of what a box of the site belongs to."""
    return name if name.startswith("gauge:") else name.partition("/")[0]


@lru_cache(maxsize=16)
def _kept(machine: ByIdentity[Machine], touching: tuple[str, ...]) -> BoolArray:
    """(bodies,) whether a body must keep clear of what is climbed."""
    return np.array([part not in touching for part in machine.value.body_parts], dtype=bool)


def _approach(
    machine: Machine,
    state: MachineState,
    climbed: Scene,
    limits: Limits,
    given: Surmounting,
    now: float,
) -> Approach | None:
    """What braking is judged by: of the parts that must not touch."""
    assert state.body is not None
    keep = limits.stop_below + min(spread(machine, state.pose), DOUBT * given.clearance)
    reach = standing_reach(machine, keep, LONGEST_DELAY)
    boxes, names = cover(climbed, hulls(machine).around(state.body.link_poses), reach, NEAR)
    if not len(boxes):
        return None
    whole = approach_standing(
        machine, motion_of(state), boxes, names, keep, age_of(state, now), LONGEST_DELAY
    )
    touching = np.array([name.partition("/")[0] in given.touching for name in whole.own])
    rows = ~touching[whole.index[:, 0]]
    return replace(
        whole,
        index=whole.index[rows],
        room=whole.room[rows],
        slope=whole.slope[rows],
        bend=whole.bend[rows],
        closing=whole.closing[rows],
    )
