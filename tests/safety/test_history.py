"""What became of alarms: how long, how bad, how it ended, who acknowledged."""

from __future__ import annotations

import numpy as np
import pytest

from backend.safety.alarms import Alarm
from backend.safety.history import KEPT, History, silence, update
from backend.safety.record import Concern, Evidence, Level


def concern(level: Level, distance: float = 0.5, t: float = 0.0, name: str = "partner") -> Concern:
    evidence = Evidence("a:bucket/0", "b:boom/1", distance, np.zeros((2, 3)), 2.0)
    return Concern(name, "a", level, f"{distance}", np.ones((4, 2)), np.ones(2), evidence, t)


class Story:
    def __init__(self) -> None:
        self.history, self.ended, self.now = History(), [], 100.0

    def cycle(self, *concerns: Concern, alarms: bool = True) -> None:
        self.now += 0.02
        raised = [
            Alarm(c, self.now, self.now, True) for c in concerns if alarms and c.level > Level.CLEAR
        ]
        self.history, ended = update(self.history, raised, concerns, self.now)
        self.ended += ended


def test_an_alarm_keeps_its_worst_moment_and_how_it_ended() -> None:
    story = Story()
    for level, distance in (
        (Level.SLOW, 0.6),
        (Level.SLOW, 0.4),
        (Level.STOP, 0.19),
        (Level.STOP, 0.11),
        (Level.STOP, 0.15),
        (Level.SLOW, 0.3),
        (Level.CLEAR, 0.9),
    ):
        story.cycle(concern(level, distance, story.now))
    (episode,) = story.ended
    assert episode.worst.evidence is not None
    assert episode.worst.evidence.distance == 0.11
    assert episode.worst.level is Level.STOP
    assert episode.incursion
    assert episode.begin == pytest.approx(100.02)
    assert episode.end == pytest.approx(100.14)
    assert episode.ended == "moved apart: bucket 0.90 m from b:boom/1"
    assert story.history.present == {}
    assert story.history.past == (episode,)


def test_unknown_ends_when_data_come_back_and_nothing_ends_as_safe_without_a_verdict() -> None:
    story = Story()
    story.cycle(concern(Level.UNKNOWN, float("nan")))
    story.cycle(concern(Level.CLEAR, 3.0))
    story.cycle(concern(Level.SLOW, 0.5))
    story.cycle()
    assert [e.ended for e in story.ended] == ["data came back", "no longer judged"]


def test_alarms_of_several_causes_are_told_apart() -> None:
    story = Story()
    story.cycle(concern(Level.SLOW), concern(Level.UNKNOWN, name="age"))
    assert set(story.history.present) == {("partner", "a"), ("age", "a")}
    story.cycle(concern(Level.SLOW), concern(Level.CLEAR, name="age"))
    assert set(story.history.present) == {("partner", "a")}


def test_who_acknowledged_first_is_kept() -> None:
    story = Story()
    story.cycle(concern(Level.SLOW))
    story.history = silence(story.history, "partner", "a", "ann", 100.05)
    story.history = silence(story.history, "partner", "a", "bob", 100.06)
    story.history = silence(story.history, "no such", "a", "bob", 100.06)
    story.cycle(concern(Level.STOP))  # and it stays through a change of level
    story.cycle(concern(Level.CLEAR))
    assert story.ended[0].silenced_by == "ann"
    assert story.ended[0].silenced_at == 100.05


def test_the_past_does_not_grow_without_end() -> None:
    story = Story()
    for _ in range(KEPT + 50):
        story.cycle(concern(Level.SLOW))
        story.cycle(concern(Level.CLEAR))
    assert len(story.history.past) == KEPT
    assert story.history.past[-1] is story.ended[-1]
