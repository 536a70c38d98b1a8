"""One cycle: state and inputs to the next state and one immutable snapshot.

No clock, no I/O: live, simulated and recorded input give the same snapshot for the same input.

    samples → streams → poses at one common time → bodies → distances, margins → concerns → alarms
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from backend.fusion.fuse import common_time, fuse
from backend.fusion.inflation import eta
from backend.fusion.pose import FusedPose, Validity
from backend.fusion.rig import Rig, make_rig
from backend.fusion.samples import Sample
from backend.fusion.streams import Streams, ingest
from backend.pipeline import surmounting
from backend.pipeline.braking import approach_of, unknown_ages
from backend.pipeline.config import Config
from backend.pipeline.margins import machine_margins
from backend.pipeline.partner_risks import swinging
from backend.pipeline.people import PeopleState, present
from backend.pipeline.people import following as people_after
from backend.pipeline.people_concern import people_concern
from backend.pipeline.people_records import Judged, People
from backend.pipeline.place import base_transform, place
from backend.pipeline.proximity import measure
from backend.pipeline.records import (
    AS_THE_SITE_SAYS,
    Body3D,
    GaugeInForce,
    Health,
    Inputs,
    MachineState,
    Notice,
    Snapshot,
)
from backend.pipeline.site_concern import site_concern
from backend.pipeline.stability import Standing, standing
from backend.pipeline.stability import concerns as tip_overs
from backend.pipeline.stability import following as standing_after
from backend.pipeline.stood_on import but_ground
from backend.pipeline.working_area import area_of, inside
from backend.pipeline.working_gauge import following as gauge_now
from backend.pipeline.working_gauge import site_of
from backend.safety import alarms, partner
from backend.safety.alarms import Alarm
from backend.safety.partner import Proximity
from backend.safety.record import Concern


@dataclass(frozen=True)
class State:
    """What a cycle hands to the next. rigs: how each machine's sensors sit; all by machine."""

    rigs: dict[str, Rig]
    streams: dict[str, Streams]
    common_time: float = -math.inf
    alarms: tuple[Alarm, ...] = ()
    health: Health = field(default_factory=lambda: Health({}, {}, 0, {}))
    notices: tuple[Notice, ...] = ()
    gauge: GaugeInForce = AS_THE_SITE_SAYS
    people: PeopleState = field(default_factory=PeopleState)
    standing: Standing = field(default_factory=Standing)
    cycle: int = 0


def initial(config: Config) -> State:
    """The state before anything arrived."""
    rigs = {name: make_rig(name, m, config.frame) for name, m in config.machines.items()}
    return State(rigs=rigs, streams={name: Streams() for name in rigs})


def step(state: State, inputs: Inputs, now: float, config: Config) -> tuple[State, Snapshot]:
    """One cycle at the local time `now` [s]; `now` never runs backward between cycles."""
    streams, strangers = _sorted_in(state, inputs.samples)
    common = common_time(
        ((rig, streams[name]) for name, rig in state.rigs.items()), now, state.common_time
    )
    machines = {
        name: _machine_state(fuse(rig, streams[name], now, common), rig, now, config)
        for name, rig in state.rigs.items()
    }
    gauge = gauge_now(state.gauge, inputs.gauge, machines, config)
    driven = frozenset(inputs.driven)
    memory, people = state.people, None
    somebody: tuple[Concern, ...] = ()
    if config.people is not None:
        memory = people_after(state.people, inputs.people, machines, now)
        memory, people, somebody = _people(memory, machines, driven, now, config)
    pairs, close, unknown = measure(machines, config)
    margins = (
        {name: machine_margins(name, machines, pairs, config, gauge, people) for name in config.own}
        if config.margins
        else {}
    )
    concerns = tuple(
        swinging(
            _partner(name, machines, close, unknown, now, config, name in driven),
            () if people is None or name not in people.judged else people.judged[name].partners,
            pairs,
        )
        for name in config.own
    )
    climbing = surmounting.in_force(inputs.surmounting, machines, now)
    for name in config.own:
        around = surmounting.without(site_of(name, gauge, config), climbing.get(name))
        around = but_ground(around, machines[name])
        if len(around.boxes):
            driven_here = name in driven
            concerns += (site_concern(name, machines[name], now, config, driven_here, around),)
    concerns += somebody
    stood = state.standing
    if config.stability is not None:
        stood = standing_after(state.standing, machines, now, config)
    stood, stability = standing(stood, machines, now, config, climbing)
    stood, tipping = tip_overs(stood, stability, machines, driven, now, config, climbing)
    concerns += tipping
    concerns += tuple(
        surmounting.surmounting_concern(
            name,
            given,
            machines[name],
            stability[name],
            site_of(name, gauge, config),
            now,
            config,
            name in driven,
        )
        for name, given in climbing.items()
        if name in config.own
    )
    concerns += tuple(unknown_ages(driven, machines, now, config))
    raised = alarms.update(state.alarms, concerns, now)
    health = _health(state.health, inputs, strangers)
    notices = _notices(state.notices, inputs.notices, now)
    snapshot = Snapshot(
        time=now,
        state_time=common,
        cycle=state.cycle,
        mode=config.mode,
        machines=machines,
        pairs=pairs,
        margins=margins,
        concerns=concerns,
        alarms=raised,
        health=health,
        notices=notices,
        gauge=gauge,
        people=people,
        stability=stability,
        surmounting=climbing,
    )
    following = replace(
        state,
        streams=streams,
        common_time=common,
        alarms=raised,
        health=health,
        notices=notices,
        gauge=gauge,
        people=memory,
        standing=stood,
        cycle=state.cycle + 1,
    )
    return following, snapshot


def _sorted_in(state: State, samples: Iterable[Sample]) -> tuple[dict[str, Streams], int]:
    """The streams after all samples, and how many samples were of no machine of the site."""
    streams = dict(state.streams)
    strangers = 0
    for sample in samples:
        rig = state.rigs.get(sample.machine)
        if rig is None:
            strangers += 1
            continue
        streams[sample.machine] = ingest(rig, streams[sample.machine], sample)
    return streams, strangers


def _machine_state(pose: FusedPose, rig: Rig, now: float, config: Config) -> MachineState:
    body = _placed(pose, rig)
    return MachineState(
        pose=pose,
        body=body,
        eta=eta(rig.machine, pose, config.eta),
        area=area_of(rig.machine, pose, body, now),
    )


def _placed(pose: FusedPose, rig: Rig) -> Body3D | None:
    """None until every needed stream was seen; a stale pose stays placed, for drawing."""
    seen = {name: stream.received > stream.rejected for name, stream in pose.streams.items()}
    turned = seen.get("joints") or seen.get("attitude")
    if not (turned and seen.get("position") and seen.get("heading")):
        return None
    return place(rig.machine, pose.joints, base_transform(pose))


def _partner(
    name: str,
    machines: dict[str, MachineState],
    close: dict[str, list[Proximity]],
    unknown: dict[str, str],
    now: float,
    config: Config,
    driven: bool,
) -> Concern:
    joints = len(config.machines[name].joints)
    if name in unknown:
        return partner.unknown(name, joints, unknown[name], now)
    own = machines[name]
    if own.body is None or own.pose.validity is not Validity.VALID:  # alone on its site
        reason = own.pose.reasons[0] if own.pose.reasons else "is unknown"
        return partner.unknown(name, joints, f"{config.labels[name]} {reason}", now)
    braking = approach_of(name, machines, now, config) if driven else None
    return partner.judge(name, joints, tuple(close[name]), config.limits, now, braking)


def _people(
    memory: PeopleState,
    machines: dict[str, MachineState],
    driven: frozenset[str],
    now: float,
    config: Config,
) -> tuple[PeopleState, People, tuple[Concern, ...]]:
    """What the next cycle needs, everybody now, and what they mean for each own machine."""
    assert config.people is not None
    here = present(memory, config.people, now)
    concerns: list[Concern] = []
    judged: dict[str, Judged] = {}
    for name in config.own:
        concern, why = people_concern(name, machines, here, memory, now, config, name in driven)
        concerns.append(concern)
        if why is not None:
            judged[name] = why
    if not memory.judged:
        memory = replace(memory, judged=judged, judged_at=now)
    here = replace(here, judged=judged, inside=inside(here, machines))
    return memory, here, tuple(concerns)


def _notices(
    before: tuple[Notice, ...], present: tuple[Notice, ...], now: float
) -> tuple[Notice, ...]:
    """Those that hold now, each with the time since when its key has been told."""
    if not present:
        return ()
    since = {notice.key: notice.since for notice in before}
    return tuple(replace(notice, since=since.get(notice.key, now)) for notice in present)


def _health(before: Health, inputs: Inputs, strangers: int) -> Health:
    malformed = _added(before.malformed, inputs.malformed)
    foreign = _added(before.foreign, inputs.foreign)
    if strangers:
        foreign = _added(foreign, (("unlisted machine", strangers),))
    images = before.images
    if inputs.images:
        images = images | {f"{image.kind} {image.key}": image for image in inputs.images}
    return Health(malformed, foreign, before.lost + inputs.lost, images)


def _added(counts: dict[str, int], more: Iterable[tuple[str, int]]) -> dict[str, int]:
    """The counts with `more` added; the same object when there is nothing to add."""
    news = tuple(more)
    if not news:
        return counts
    total = dict(counts)
    for key, count in news:
        total[key] = total.get(key, 0) + count
    return total
