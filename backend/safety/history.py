"""What became of alarms: every one from its beginning to its end, and how it ended."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from backend.safety import tip_over
from backend.safety.alarms import Alarm
from backend.safety.partner import part
from backend.safety.record import Concern, Level

KEPT = 200


@dataclass(frozen=True)
class Episode:
    """One alarm from `begin` to `end` [s], None while it lasts. worst: the concern when it was
    severest, at the same level when the distance was smallest; ended: how it ended, in words;
    silenced_by: who acknowledged it, at `silenced_at` [s].
    """

    begin: float
    worst: Concern
    end: float | None = None
    ended: str = ""
    silenced_by: str = ""
    silenced_at: float | None = None

    @property
    def key(self) -> tuple[str, str]:
        return (self.worst.name, self.worst.machine)

    @property
    def incursion(self) -> bool:
        """Whether something came into a zone that it must stay out of."""
        return self.worst.level is Level.STOP


@dataclass(frozen=True)
class History:
    """present: by alarm; past: the newest `KEPT` that ended, oldest first."""

    present: dict[tuple[str, str], Episode] = field(default_factory=dict)
    past: tuple[Episode, ...] = ()


def update(
    history: History, alarms: Iterable[Alarm], concerns: Iterable[Concern], now: float
) -> tuple[History, tuple[Episode, ...]]:
    """The history after one more cycle, and the episodes that ended in it."""
    lasting = {alarm.key: alarm for alarm in alarms if alarm.active}
    verdicts = {(c.name, c.machine): c for c in concerns}
    present: dict[tuple[str, str], Episode] = {}
    for key, alarm in lasting.items():
        known = history.present.get(key) or Episode(alarm.since, alarm.concern)
        present[key] = replace(known, worst=_worse(known.worst, alarm.concern))
    ended = tuple(
        replace(episode, end=now, ended=_how(episode, verdicts.get(key)))
        for key, episode in history.present.items()
        if key not in lasting
    )
    if not ended and present.keys() == history.present.keys() and not present:
        return history, ()
    return History(present, (*history.past, *ended)[-KEPT:]), ended


def silence(history: History, name: str, machine: str, who: str, now: float) -> History:
    """The history after somebody acknowledged an alarm; the first who did is kept."""
    episode = history.present.get((name, machine))
    if episode is None or episode.silenced_by:
        return history
    told = replace(episode, silenced_by=who, silenced_at=now)
    return replace(history, present={**history.present, episode.key: told})


def _worse(known: Concern, new: Concern) -> Concern:
    if new.level != known.level:
        return new if new.level > known.level else known
    return new if _distance(new) < _distance(known) else known


def _distance(concern: Concern) -> float:
    """[m]; infinite when nothing is known of it."""
    evidence = concern.evidence
    if evidence is None or math.isnan(evidence.distance):
        return math.inf
    return evidence.distance


def _how(episode: Episode, verdict: Concern | None) -> str:
    if verdict is None or verdict.level is Level.UNKNOWN:
        return "no longer judged"
    if episode.worst.level is Level.UNKNOWN:
        return "data came back"
    if verdict.name == tip_over.NAME:
        return "stands firmly again"
    if verdict.evidence is None:
        return "out of reach of each other"
    nearest = verdict.evidence
    return f"moved apart: {part(nearest.own)} {nearest.distance:.2f} m from {nearest.other}"
