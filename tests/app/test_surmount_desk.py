"""Manoeuvres that are asked for: the step that an obstacle is, the offer, its choices, its watch,
its end, and the API, with what looks for them made up.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Iterator
from typing import Any

import httpx
import jsonschema
import numpy as np
import pytest
from fastapi import FastAPI
from surmount_toy import CHOSEN, ENERGIES, solve
from test_plan_desk import CONFIG, MINI, state
from test_plan_desk import scene as two

from backend.control.follow import ARRIVED, Trajectory
from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_live import Step, blocked, live_surmount, nearest_now, step_of
from backend.documents.surmount_side import base_poses, side_view
from backend.documents.surmount_state import (
    FollowedSurmount,
    SideView,
    SurmountChoice,
    SurmountRequest,
    SurmountStateDocument,
)
from backend.errors import InputError
from backend.fusion.pose import Validity
from backend.machine.kinematics import body_boxes, link_poses
from backend.pipeline.records import Snapshot
from backend.shell.app.server import WebServer, bind
from backend.shell.app.surmount_api import surmount_router
from backend.shell.app.wire import dumps
from backend.shell.plan_desk import Progress
from backend.shell.surmount_desk import SurmountDesk
from backend.site.named_bodies import NO_SITE_BODIES
from backend.spatial.boxes import Boxes, concatenated
from backend.spatial.rotation import rz
from backend.spatial.transform import make
from backend.spatial.types import Array

HEIGHT, AHEAD = 0.3, 2.5
FAR = (9.0, 10.0)  # beside the way over the step


def box(x: float, y: float, half: tuple[float, float, float], z: float, yaw: float = 0.0) -> Boxes:
    return Boxes(np.array([[x, y, z]]), rz(yaw)[None], np.array([half]))


STEP = box(AHEAD + 4.0, 0.0, (4.0, 2.0, 0.5 * HEIGHT), 0.5 * HEIGHT)
POST = box(0.0, 12.0, (0.2, 0.2, 1.0), 1.0)
SITE = dataclasses.replace(CONFIG, site=dataclasses.replace(
    NO_SITE_BODIES, boxes=concatenated([STEP, POST]), names=("step", "post")
))  # fmt: skip
ASKED: dict[str, Any] = {"machine": "a", "obstacle": "step"}


def asked(**changes: Any) -> SurmountRequest:
    return SurmountRequest.model_validate({**ASKED, **changes})


def scene(**changes: Any) -> Snapshot:
    return two(**{"b": state("b", FAR), **changes})


def at(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, z: float = 0.0) -> Array:
    return make(rz(yaw), np.array([x, y, z]))


def test_a_box_ahead_is_a_step() -> None:
    found = step_of("step", STEP, 0, at())
    assert isinstance(found, Step)
    assert (found.height, found.distance, found.depth) == pytest.approx((HEIGHT, AHEAD, 8.0))
    assert found.angle == pytest.approx(0.0, abs=1e-12)
    askew = step_of("step", STEP, 0, at(yaw=0.3))
    assert isinstance(askew, Step)
    assert askew.angle == pytest.approx(0.3)
    assert askew.distance == pytest.approx(AHEAD)  # across the edge
    # The same wherever both stand, however they are turned.
    T = make(rz(1.1), np.array([3.0, -7.0, 0.4]))
    moved = step_of("step", STEP.moved(T), 0, T @ at(yaw=0.3))
    assert isinstance(moved, Step)
    assert dataclasses.astuple(moved)[1:] == pytest.approx(dataclasses.astuple(askew)[1:])


def test_from_its_top_it_leads_down() -> None:
    found = step_of("step", STEP, 0, at(AHEAD + 2.0, z=HEIGHT, yaw=math.pi))
    assert isinstance(found, Step)
    assert (found.height, found.distance) == pytest.approx((-HEIGHT, 2.0))


@pytest.mark.parametrize(
    ("T", "said"),
    [
        (at(yaw=math.pi), "not ahead"),
        (at(yaw=1.2), "not ahead"),
        (at(yaw=0.75), "past its edge"),
        (at(y=3.0), "past its edge"),
        (at(z=HEIGHT + 0.1), "not higher than the ground"),
    ],
)
def test_what_is_no_step_ahead_is_said(T: Array, said: str) -> None:
    found = step_of("step", STEP, 0, T)
    assert isinstance(found, str)
    assert said in found


def test_the_task_has_all_but_the_step_in_the_way() -> None:
    live = live_surmount(asked(), scene(), SITE)
    assert live.step.name == "step"
    assert live.step.distance == pytest.approx(AHEAD)
    assert "site:post" in {name.split("/")[0] for name in live.names}
    assert not any(name.startswith("site:step") for name in live.names)
    by_numbers = live_surmount(
        asked(obstacle=None, step={"height": 0.2, "distance": 1.8}), scene(), SITE
    )
    assert (by_numbers.step.height, by_numbers.step.distance) == (0.2, 1.8)
    # A step that is not on the site's list takes nothing out of it.
    assert any(name.startswith("site:step") for name in by_numbers.names)


@pytest.mark.parametrize(
    ("snapshot", "request_", "said"),
    [
        (scene(), asked(machine="c"), 'machine is "c"; allowed are a, b'),
        (scene(), asked(obstacle="wall"), 'obstacle is "wall"; allowed are post, step'),
        (scene(), asked(obstacle="post"), "post is not ahead"),
        (scene(a=state("a", (0.0, 0.0), rates=0.3)), asked(), "A moves (swing)"),
        (scene(b=state("b", FAR, validity=Validity.STALE)), asked(), "B joints are 0.6 s old"),
    ],
)
def test_what_cannot_be_is_said_at_once(
    snapshot: Snapshot, request_: SurmountRequest, said: str
) -> None:
    with pytest.raises(InputError) as caught:
        live_surmount(request_, snapshot, SITE)
    assert said in str(caught.value)


def test_masses_that_are_not_known_are_no_ground_to_lift_by() -> None:
    unsure = dataclasses.replace(MINI, masses_trusted=False)
    config = dataclasses.replace(SITE, machines={**SITE.machines, "a": unsure})
    with pytest.raises(InputError, match="masses are not known"):
        live_surmount(asked(), scene(), config)


@pytest.mark.parametrize(
    "wrong",
    [
        {"obstacle": None},
        {"step": {"height": 0.3, "distance": 2.0}},
        {"obstacle": None, "step": {"height": 0.0, "distance": 2.0}},
        {"obstacle": None, "step": {"height": 0.3, "distance": -2.0}},
    ],
)
def test_an_obstacle_is_named_or_given(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"obstacle|step"):
        asked(**wrong)


def test_what_a_moving_base_comes_near_to_blocks_it() -> None:
    q = scene().machines["a"].pose.joints
    T = np.stack([at(x) for x in np.linspace(0.0, 3.0, 200)])
    joints = np.tile(q, (200, 1))
    far = [body_boxes(MINI, link_poses(MINI, q, one)).corners()[..., 0].max() for one in T]
    front = far[0] + 1.5
    wall = box(front + 0.1, 0.0, (0.1, 3.0, 1.5), 1.5)
    found = blocked(MINI, joints, T, wall, ("wall",), 0.4, {})
    assert found is not None
    row, name, distance = found
    assert name == "wall"
    # That row is the first of those looked at which is nearer, measured by its boxes' corners.
    gaps = front - np.array(far)
    assert gaps[row] == pytest.approx(distance, abs=1e-6)
    assert distance < 0.4 <= gaps[row - 2]
    assert blocked(MINI, joints[:50], T[:50], wall, ("wall",), 0.4, {}) is None
    # As near as it was at the beginning is allowed, much nearer is not.
    beside = nearest_now(MINI, q, T[row], wall, ("wall",), 0.4)
    assert beside["wall"] == pytest.approx(distance)
    assert blocked(MINI, joints[:1], T[row : row + 1], wall, ("wall",), 0.4, beside) is None
    assert blocked(MINI, joints[:1], T[row + 6 : row + 7], wall, ("wall",), 0.4, beside) is not None


class Live:
    """A scene that changes, and what is followed in it."""

    def __init__(self) -> None:
        self.snapshot: Snapshot | None = scene()
        self.progress: Progress | None = None
        self.told: list[tuple[str, str]] = []
        self.desk = SurmountDesk(
            SITE,
            lambda: self.snapshot,
            lambda machine: self.progress if machine == "a" else None,
            lambda what, who, _: self.told.append((what, who)),
            solve,
        )

    def of(self, machine: str = "a") -> dict[str, Any]:
        found: dict[str, Any] = self.desk.document()[machine]
        return found

    def until(self, *states: str) -> dict[str, Any]:
        deadline = time.monotonic() + 120.0
        while (now := self.of())["state"] not in states:
            assert time.monotonic() < deadline, now
            time.sleep(0.05)
        return now

    def find(self, **changes: Any) -> dict[str, Any]:
        self.snapshot, self.progress = scene(), None
        self.desk.start(asked(**changes), "ann")
        return self.until("offered", "none")


@pytest.fixture(scope="module")
def live() -> Iterator[Live]:
    made = Live()
    yield made
    made.desk.close()


def test_it_is_on_offer_with_all_that_is_drawn(live: Live) -> None:
    found = live.find()
    assert found["state"] == "offered", found["why"]
    name = found["plan"]
    assert live.desk.has("a", name)
    assert not live.desk.has("a", "a-1")
    assert found["candidate"] == CHOSEN
    assert found["energy"] == ENERGIES[CHOSEN]
    made = live.desk.offered("a", name)
    assert isinstance(made, Trajectory)
    document = SurmountDocument.model_validate_json(live.desk.text("a", name))
    assert document.ok
    np.testing.assert_allclose(made.joints, document.joints)
    side = SideView.model_validate_json(dumps(live.desk.side("a", name)))
    assert len(side.time) == len(side.outlines) == len(side.pivots) <= 400
    assert side.time[-1] == pytest.approx(document.duration, abs=1e-3)
    way = live.desk.way("a", name)
    assert way is not None
    np.testing.assert_allclose(
        way.base[0], live.snapshot.machines["a"].body.link_poses[0], atol=1e-9
    )  # type: ignore[union-attr]
    assert ("surmount", "ann") in live.told
    assert "not on offer" in str(live.desk.offered("a", "a-over-0"))


def test_the_side_is_the_machine_across_the_edge() -> None:
    live = live_surmount(asked(), scene(), SITE)
    document = solve(live, None, SITE.machines, lambda *_: True)
    side = side_view(MINI, document)
    T = base_poses(np.array(document.base))
    k = len(side["time"]) // 2
    row = int(np.searchsorted(document.time, side["time"][k]))
    corners = body_boxes(MINI, link_poses(MINI, np.array(document.joints)[row], T[row])).corners()
    for p, part in enumerate(side["parts"]):
        mine = corners[MINI.body_parts == part].reshape(-1, 3) - T[0, :3, 3]
        drawn = np.array(side["outlines"][k][p])
        np.testing.assert_allclose(drawn.min(axis=0), mine[:, [0, 2]].min(axis=0), atol=2e-3)
        np.testing.assert_allclose(drawn.max(axis=0), mine[:, [0, 2]].max(axis=0), atol=2e-3)
    tip = np.array(document.end_point)[row] - T[0, :3, 3]
    np.testing.assert_allclose(side["pivots"][k][-1], tip[[0, 2]], atol=2e-3)


def test_another_candidate_has_another_name_and_the_same_table(live: Live) -> None:
    first = live.find()
    with pytest.raises(InputError, match="candidate is 9; "):
        live.desk.choose("a", first["plan"], SurmountChoice(candidate=9), "bob")
    live.desk.choose("a", first["plan"], SurmountChoice(candidate=3), "bob")
    assert live.desk.way("a", f"{first['plan']}.3") is None or live.of()["state"] == "offered"
    found = live.until("offered")
    assert found["plan"] == f"{first['plan']}.3"
    assert found["candidate"] == 3
    document = SurmountDocument.model_validate_json(live.desk.text("a", found["plan"]))
    assert [one.chosen for one in document.candidates] == [False, False, False, True]
    assert document.candidates[3].energy == 4444.0  # as it was simulated
    assert document.candidates[3].simulated
    assert document.candidates[0].energy == ENERGIES[0]
    assert "not on offer" in str(live.desk.offered("a", first["plan"]))
    assert found["energy"] == 4444.0
    live.desk.choose("a", found["plan"], SurmountChoice(candidate=0), "bob")
    assert live.until("offered")["plan"] == f"{first['plan']}.0"
    document = SurmountDocument.model_validate_json(live.desk.text("a", f"{first['plan']}.0"))
    assert document.candidates[0].energy == ENERGIES[0]  # had been simulated


def test_the_search_tells_how_far_it_is_and_is_cancelled(live: Live) -> None:
    live.snapshot, live.progress = scene(), None
    live.desk.start(asked(effort="thorough"), "ann")
    deadline = time.monotonic() + 60.0
    while not (live.of()["progress"] or {}).get("done"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    progress = live.of()["progress"]
    assert (progress["of"], progress["words"]) == (600, "simulated")
    began = time.monotonic()
    live.desk.drop("a", "ann")
    assert "a" not in live.desk.document()
    found = live.find()  # the next one need not wait for the rest of it
    assert found["state"] == "offered"
    assert time.monotonic() - began < 10.0


def test_why_there_is_none_is_told(live: Live) -> None:
    found = live.find(obstacle=None, step={"height": 1.2, "distance": 2.0})
    assert (found["state"], found["kind"]) == ("none", "reach")
    assert "out of the arm's reach" in found["why"]
    assert "out of the arm's reach" in str(live.desk.offered("a", found["plan"]))
    with pytest.raises(InputError, match="no trajectory"):
        live.desk.side("a", found["plan"])


def test_what_stands_on_the_way_is_told(live: Live) -> None:
    live.snapshot, live.progress = scene(b=state("b", (7.2, 0.0), math.pi)), None
    live.desk.start(asked(), "ann")
    found = live.until("none", "offered")
    assert found["state"] == "none"
    assert found["why"].startswith("b:")
    assert "is in its way" in found["why"]
    assert "are kept" in found["why"]


def test_a_machine_or_a_base_that_moved_makes_it_void(live: Live) -> None:
    found = live.find()
    q = scene().machines["a"].pose.joints
    live.snapshot = scene(a=state("a", (0.0, 0.0), q=q + np.array([0.1, 0, 0, 0])))
    assert "degrees from where it begins" in live.until("void")["why"]
    assert "the machine moved" in live.desk.over("a", found["plan"])
    live.find()
    live.snapshot = scene(a=state("a", (0.12, 0.0)))
    assert "base moved by 0.12 m" in live.until("void")["why"]


def test_followed_the_base_may_move_and_what_comes_into_its_way_ends_it(live: Live) -> None:
    found = live.find()
    live.progress = Progress(found["plan"], 20.0, "", arrived=False)
    live.snapshot = scene(a=state("a", (1.3, 0.0)))
    live.desk.look()
    assert live.of()["state"] == "offered"
    live.snapshot = scene(a=state("a", (1.3, 0.0)), b=state("b", (7.2, 0.0), math.pi))
    assert live.until("void")["why"].startswith("b:")
    assert "is in its way" in live.desk.over("a", found["plan"])


def test_what_is_not_known_is_neither_offered_nor_void(live: Live) -> None:
    found = live.find()
    live.snapshot = scene(b=state("b", FAR, validity=Validity.STALE))
    assert "B joints are 0.6 s old" in live.until("unknown")["why"]
    assert "0.6 s old" in str(live.desk.offered("a", found["plan"]))
    live.snapshot = scene()
    live.until("offered")


def test_followed_no_other_is_looked_for_and_arrived_it_is_done(live: Live) -> None:
    found = live.find()
    live.progress = Progress(found["plan"], 0.4, "", arrived=False)
    with pytest.raises(InputError, match="is being followed; drop it first"):
        live.desk.start(asked(), "bob")
    with pytest.raises(InputError, match="is being followed; drop it first"):
        live.desk.choose("a", found["plan"], SurmountChoice(candidate=0), "bob")
    live.progress = Progress(found["plan"], found["duration"], ARRIVED, arrived=True)
    live.until("done")
    live.desk.drop("a", "bob")
    assert live.desk.over("a", found["plan"]) == "the plan was dropped"


def test_what_was_seen_while_it_was_followed_is_told(live: Live) -> None:
    found = live.find()
    name = found["plan"]
    assert live.desk.followed("a", name)["at"] == []
    for k in range(900):
        t = 0.02 * k
        now = state("a", (0.001 * k, 0.0))
        pose = dataclasses.replace(now.pose, time=100.0 + 0.02 * (k // 2))  # each told twice
        live.progress = Progress(name, t, "", arrived=False)
        live.desk.keep(scene(a=dataclasses.replace(now, pose=pose)))
    told = FollowedSurmount.model_validate_json(dumps(live.desk.followed("a", name)))
    assert 100 < len(told.at) <= 400
    assert told.time[-1] == pytest.approx(8.98, abs=0.05)
    np.testing.assert_allclose(np.array(told.base)[:, 0], np.array(told.at) / 20.0, atol=2e-3)
    np.testing.assert_allclose(np.array(told.base)[:, 1:], 0.0, atol=1e-6)


@pytest.fixture(scope="module")
def url(live: Live) -> Iterator[str]:
    app = FastAPI()
    app.include_router(surmount_router(live.desk))
    web = WebServer(app, bind("127.0.0.1", 0))
    web.start()
    yield f"http://127.0.0.1:{web.port}/api/surmount"
    web.stop()


def test_the_api_says_it_all(url: str, live: Live) -> None:
    live.snapshot, live.progress = scene(), None
    answer = httpx.post(url, json=ASKED, trust_env=False)
    assert answer.status_code == 200
    jsonschema.validate(answer.json(), SurmountStateDocument.model_json_schema())
    name = answer.json()["surmounts"]["a"]["plan"]
    live.until("offered")
    found = httpx.get(url, trust_env=False).json()
    jsonschema.validate(found, SurmountStateDocument.model_json_schema())
    whole = httpx.get(f"{url}/a/{name}", trust_env=False).json()
    jsonschema.validate(whole, SurmountDocument.model_json_schema())
    assert "sequence 2-1" in [one["name"] for one in whole["phases"]]
    side = httpx.get(f"{url}/a/{name}/side", trust_env=False).json()
    jsonschema.validate(side, SideView.model_json_schema())
    seen = httpx.get(f"{url}/a/{name}/followed", trust_env=False).json()
    jsonschema.validate(seen, FollowedSurmount.model_json_schema())
    chosen = httpx.post(f"{url}/a/{name}/choose", json={"candidate": 2}, trust_env=False)
    assert chosen.json()["surmounts"]["a"]["plan"] == f"{name}.2"
    live.until("offered")
    assert httpx.get(f"{url}/a/{name}", trust_env=False).status_code == 404
    assert httpx.get(f"{url}/a/{name}.2", trust_env=False).status_code == 200
    late = httpx.post(f"{url}/a/{name}/choose", json={"candidate": 0}, trust_env=False)
    assert late.status_code == 409
    live.snapshot = scene(a=state("a", (0.0, 0.0), rates=0.3))
    refused = httpx.post(url, json=ASKED, trust_env=False)
    assert refused.status_code == 409
    assert "begins at rest" in refused.json()["detail"]
    assert httpx.post(url, json={"machine": "a"}, trust_env=False).status_code == 422
    assert "a" not in httpx.delete(f"{url}/a", trust_env=False).json()["surmounts"]
