"""From concerns to alarms: on after 0.3 s (STOP and UNKNOWN at once), off after 1 s."""

from __future__ import annotations

from dataclasses import dataclass

from backend.safety.record import Concern, Level

ON_DELAY = 0.3
OFF_DELAY = 1.0


@dataclass(frozen=True)
class Alarm:
    """One condition that an operator must know. since, last: when first and last seen [s]."""

    concern: Concern
    since: float
    last: float
    active: bool  # past the on-delay

    @property
    def key(self) -> tuple[str, str]:
        return (self.concern.name, self.concern.machine)


def update(
    alarms: tuple[Alarm, ...], concerns: tuple[Concern, ...], now: float
) -> tuple[Alarm, ...]:
    """The alarms after one more cycle, the severest first, then the shortest time to contact."""
    known = {alarm.key: alarm for alarm in alarms}
    for concern in concerns:
        if concern.level is Level.CLEAR:
            continue
        old = known.get((concern.name, concern.machine))
        since = old.since if old else now
        at_once = concern.level >= Level.STOP
        active = (old is not None and old.active) or at_once or now - since >= ON_DELAY
        known[(concern.name, concern.machine)] = Alarm(concern, since, now, active)
    kept = [
        alarm
        for alarm in known.values()
        if now - alarm.last < OFF_DELAY and (alarm.active or alarm.last == now)
    ]
    return tuple(sorted(kept, key=_urgency))


def _urgency(alarm: Alarm) -> tuple[int, float]:
    evidence = alarm.concern.evidence
    return (-int(alarm.concern.level), evidence.time_to_contact if evidence else float("inf"))
