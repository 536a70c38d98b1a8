"""The process that makes zones of people and the site is asked only once there is something."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.pipeline.people_records import People
from backend.pipeline.records import AS_THE_SITE_SAYS, GaugeInForce
from backend.shell.kinds import Made, Wishes
from backend.site.gauge_choice import Drawn, GaugeChoice
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.spatial.boxes import Boxes
from cockpit.desk import OnceThereIs

BARE: Any = SimpleNamespace(people=None, gauge=AS_THE_SITE_SAYS)
CROWDED: Any = SimpleNamespace(people=People("", 0.1), gauge=AS_THE_SITE_SAYS)
AREA = Drawn("pit", "keep_out", ((3.0, -1.0), (9.0, -1.0), (9.0, 1.0)), -1.0, 4.0)
DRAWN: Any = SimpleNamespace(people=None, gauge=GaugeInForce(GaugeChoice((AREA,))))
WALL = SiteBodies(Boxes(np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 3))), ("wall",))


class Worker:
    def __init__(self) -> None:
        self.asked = 0

    def make(self, snapshot: Any, wishes: Wishes) -> list[Made]:
        self.asked += 1
        return []


def loop(site: SiteBodies = NO_SITE_BODIES) -> tuple[Worker, OnceThereIs]:
    worker = Worker()
    config: Any = SimpleNamespace(site=site)
    return worker, OnceThereIs(worker, config)


def test_a_bare_site_starts_no_process() -> None:
    worker, around = loop()
    for _ in range(3):
        assert around.make(BARE, Wishes({})) == []
    assert worker.asked == 0


@pytest.mark.parametrize("something", [CROWDED, DRAWN], ids=["people", "drawn"])
def test_what_was_there_once_is_asked_for_from_then_on(something: Any) -> None:
    worker, around = loop()
    for snapshot in (BARE, something, BARE, BARE):
        around.make(snapshot, Wishes({}))
    assert worker.asked == 3


def test_a_site_with_bodies_is_asked_for_at_once() -> None:
    worker, around = loop(replace(WALL))
    around.make(BARE, Wishes({}))
    assert worker.asked == 1
