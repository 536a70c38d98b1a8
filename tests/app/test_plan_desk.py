"""Trajectories are planned aside from a live snapshot, watched while on offer, and void in time."""

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

from backend.collision.closest import closest_pairs
from backend.control.follow import ARRIVED, Trajectory
from backend.documents.plan_document import PlanDocument
from backend.documents.plan_live import kept, live_task
from backend.documents.plan_series import FollowedSeries
from backend.documents.plan_state import PlanRequest, PlanStateDocument
from backend.errors import InputError
from backend.fusion.inflation import spread
from backend.fusion.pose import FusedPose, Validity
from backend.fusion.samples import Fix
from backend.machine.kinematics import body_boxes, end_point, link_poses
from backend.machine.load import load_machine
from backend.pipeline.config import Config
from backend.pipeline.people_records import Missing, People
from backend.pipeline.place import base_transform, place
from backend.pipeline.records import Health, MachineState, PairDistance, Snapshot
from backend.planning.trajectory.holds import broken, nearest
from backend.planning.trajectory.plan import plan as trajectory
from backend.planning.trajectory.records import Obstacles, Refusal
from backend.safety.partner import Limits
from backend.safety.people import Watch
from backend.shell.app.plan_api import plan_router
from backend.shell.app.server import WebServer, bind
from backend.shell.app.wire import dumps
from backend.shell.plan_desk import PlanDesk, Progress
from backend.site.named_bodies import NO_SITE_BODIES
from backend.site.site import load_site
from backend.spatial.boxes import Boxes

MINI = load_machine("mini")
START = np.array([0.0, 0.6, -1.2, -0.4])
FAR = (9.0, 0.0)
CONFIG = Config(
    frame=load_site("demo").frame,
    machines={"a": MINI, "b": MINI},
    labels={"a": "A", "b": "B"},
    own=("a", "b"),
    limits=Limits(0.8, 0.2),
    eta=0.1,
    mode="LIVE",
)
NOBODY = People("", 0.1)
SWUNG = {"machine": "a", "goal": {"joints": {"swing": 1.0}}}


def state(
    name: str,
    position: tuple[float, float],
    yaw: float = 0.0,
    q: Any = START,
    validity: Validity = Validity.VALID,
    rates: float = 0.0,
) -> MachineState:
    reasons = () if validity is Validity.VALID else ("joints are 0.6 s old",)
    joints = np.array(q, dtype=float)
    pose = FusedPose(
        name, 100.0, validity, reasons, np.array([*position, 0.0]), yaw, 0.0, 0.0, joints,
        np.full(len(joints), rates), np.zeros(3), 0.01, 0.001, 0.001, Fix.RTK_FIXED, {}, None,
    )  # fmt: skip
    return MachineState(pose, place(MINI, joints, base_transform(pose)), 0.1)


def scene(a: MachineState | None = None, b: MachineState | None = None) -> Snapshot:
    machines = {"a": a or state("a", (0.0, 0.0)), "b": b or state("b", FAR, math.pi)}
    reasons = [f"{n.upper()} {s.pose.reasons[0]}" for n, s in machines.items() if s.pose.reasons]
    pair = PairDistance("a", "b", "", "", 2.0, None, (reasons or [""])[0], 0, near=True)
    health = Health({}, {}, 0, {})
    return Snapshot(100.0, 100.0, 1, "LIVE", machines, (pair,), (), (), health)


def asked(**changes: Any) -> PlanRequest:
    return PlanRequest.model_validate({**SWUNG, **changes})


def test_what_the_limiter_keeps_is_kept_and_more() -> None:
    snapshot = scene()
    wrong = sum(spread(MINI, s.pose) for s in snapshot.machines.values())
    assert kept("a", snapshot, CONFIG) == pytest.approx(0.2 + wrong)
    live = live_task(asked(clearance=0.3), snapshot, CONFIG)
    assert live.task.clearance == pytest.approx(0.5 + wrong)


def test_obstacles_are_partners_site_and_people_and_those_lost_lately() -> None:
    near = scene(b=state("b", (6.5, 0.0), math.pi))
    watching = dataclasses.replace(
        CONFIG,
        people=Watch(),
        site=dataclasses.replace(
            NO_SITE_BODIES,
            boxes=Boxes(np.array([[0.0, 3.0, 1.0]]), np.eye(3)[None], np.full((1, 3), 0.2)),
            names=("pole",),
        ),
    )
    lost = Missing(7, (2.0, -2.0, 0.9), 95.0, 96.0)
    people = dataclasses.replace(NOBODY, lost=(lost,))
    live = live_task(asked(), dataclasses.replace(near, people=people), watching)
    names = live.obstacles.names
    assert any(name.startswith("b:") for name in names)
    assert any(name.startswith("site:pole") for name in names)
    k = names.index("person:P7")
    wider = Watch().stop_below - CONFIG.limits.stop_below
    assert live.obstacles.boxes.half_extents[k][0] == pytest.approx(0.7 + wider)
    assert live.obstacles.ground


@pytest.mark.parametrize(
    ("snapshot", "request_", "said"),
    [
        (scene(), asked(machine="c"), 'machine is "c"; allowed are a, b'),
        (scene(b=state("b", FAR, validity=Validity.STALE)), asked(), "B joints are 0.6 s old"),
        (scene(a=state("a", (0.0, 0.0), validity=Validity.STALE)), asked(), "A joints are 0.6"),
        (scene(a=state("a", (0.0, 0.0), rates=0.3)), asked(), "A moves (swing)"),
        (scene(), asked(goal={"joints": {"tilt": 0.0}}), "goal.joints.tilt is unknown"),
        (scene(), asked(goal={"joints": {"boom": 9.0}}), "goal.joints.boom is 9.000; allowed is"),
        (scene(), asked(limits={"joint_velocities": {"x": 1.0}}), "is not a joint of"),
    ],
)
def test_what_cannot_be_planned_is_said_at_once(
    snapshot: Snapshot, request_: PlanRequest, said: str
) -> None:
    with pytest.raises(InputError) as caught:
        live_task(request_, snapshot, CONFIG)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "goal", [{}, {"joints": {}}, {"end_point": [1, 2, 3], "joints": {"swing": 1.0}}]
)
def test_a_goal_is_a_point_or_joints(goal: Any) -> None:
    with pytest.raises(ValueError, match="joint"):
        asked(goal=goal)


def test_people_who_are_not_known_are_no_free_ground() -> None:
    blind = dataclasses.replace(NOBODY, reason="no LiDAR data for 0.7 s")
    snapshot = dataclasses.replace(scene(), people=blind)
    with pytest.raises(InputError, match="no LiDAR data"):
        live_task(asked(), snapshot, dataclasses.replace(CONFIG, people=Watch()))


def test_a_way_is_broken_by_what_comes_nearer_and_not_by_what_was_there() -> None:
    def post(x: float, y: float) -> Obstacles:
        boxes = Boxes(np.array([[x, y, 0.8]]), np.eye(3)[None], np.array([[0.1, 0.1, 0.8]]))
        return Obstacles(boxes, ("post",))

    swings = np.linspace(0.0, 1.5, 16)
    q = np.tile(START, (16, 1))
    q[:, 0] = swings
    tip = end_point(MINI, START)
    reach = float(np.hypot(tip[0], tip[1]))
    at = 1.0  # [rad], where a post stands in the way
    standing = post(reach * math.cos(at), reach * math.sin(at))
    found = broken(MINI, standing, q, 0.3, {})
    assert found is not None
    assert found.name == "post"
    assert 0.4 < swings[found.row] < at
    assert broken(MINI, standing, q[-1:], 0.3, {}) is None  # past it
    assert broken(MINI, post(0.0, -4.0), q, 0.3, {}) is None
    # Beside the start: as near as it was is allowed, by noise nearer, too, but not much nearer.
    beside = post(reach, -0.65)
    before = nearest(MINI, beside, START, 0.5)
    assert 0.05 < before["post"] < 0.5
    assert broken(MINI, beside, q, 0.5, {}) is not None
    assert broken(MINI, beside, q, 0.5, before) is None
    assert broken(MINI, post(reach, -0.63), q, 0.5, before) is None
    assert broken(MINI, post(reach, -0.50), q, 0.5, before) is not None


class Live:
    """A scene that changes, and what is followed in it."""

    def __init__(self) -> None:
        self.snapshot: Snapshot | None = scene()
        self.progress: Progress | None = None
        self.told: list[tuple[str, str]] = []
        self.desk = PlanDesk(
            CONFIG,
            lambda: self.snapshot,
            lambda machine: self.progress if machine == "a" else None,
            lambda what, who, _: self.told.append((what, who)),
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

    def plan(self, **changes: Any) -> dict[str, Any]:
        self.snapshot, self.progress = scene(), None
        self.desk.start(asked(**changes), "ann")
        return self.until("offered", "none")


@pytest.fixture(scope="module")
def live() -> Iterator[Live]:
    made = Live()
    yield made
    made.desk.close()


def test_it_is_on_offer_and_can_be_followed_by_its_name(live: Live) -> None:
    found = live.plan()
    assert found["state"] == "offered"
    assert found["duration"] > 1.0
    assert found["checks"]["min_stability_margin"] > 0.0
    made = live.desk.offered("a", found["plan"])
    assert isinstance(made, Trajectory)
    np.testing.assert_allclose(made.joints[0], START, atol=1e-9)
    np.testing.assert_allclose(made.joints[-1], [1.0, *START[1:]], atol=1e-6)
    assert live.desk.over("a", found["plan"]) == ""
    document = PlanDocument.model_validate_json(live.desk.text("a", found["plan"]))
    assert document.ok
    np.testing.assert_allclose(document.end_point[-1], found["goal"], atol=1e-4)
    assert ("plan", "ann") in live.told
    assert "is not on offer; " + found["plan"] in str(live.desk.offered("a", "a-0"))
    assert "not on offer" in str(live.desk.offered("b", found["plan"]))


def test_a_machine_that_moved_away_makes_it_void(live: Live) -> None:
    found = live.plan()
    live.snapshot = scene(a=state("a", (0.0, 0.0), q=START + np.array([0.03, 0, 0, 0])))
    live.desk.look()
    assert live.of()["state"] == "offered"
    live.snapshot = scene(a=state("a", (0.0, 0.0), q=START + np.array([0.1, 0, 0, 0])))
    assert "degrees from where it begins" in live.until("void")["why"]
    assert "the machine moved" in str(live.desk.offered("a", found["plan"]))
    live.snapshot = scene()  # void it stays
    live.desk.look()
    assert live.of()["state"] == "void"


def test_a_base_that_moved_makes_it_void_even_while_followed(live: Live) -> None:
    found = live.plan()
    live.progress = Progress(found["plan"], 1.0, "", arrived=False)
    live.snapshot = scene(a=state("a", (0.2, 0.0)))
    assert "base moved by 0.20 m" in live.until("void")["why"]
    assert "base moved" in live.desk.over("a", found["plan"])


def test_while_followed_only_what_is_left_counts(live: Live) -> None:
    found = live.plan(goal={"joints": {"swing": 1.6}})
    end = found["duration"]
    turned = state("a", (0.0, 0.0), q=START + np.array([1.5, 0, 0, 0]))
    # The partner reaches to where the arm was at the beginning.
    behind = state("b", (6.3, 0.0), math.pi)
    live.progress = Progress(found["plan"], end - 0.05, "", arrived=False)
    live.snapshot = scene(a=turned, b=behind)
    live.desk.look()
    assert live.of()["state"] == "offered"
    live.progress = Progress(found["plan"], 0.5, "", arrived=False)
    why = live.until("void")["why"]
    assert why.startswith("b:")
    assert why.endswith("is in its way now")


def test_what_is_not_known_is_neither_offered_nor_void(live: Live) -> None:
    found = live.plan()
    live.snapshot = scene(b=state("b", FAR, validity=Validity.STALE))
    assert "B joints are 0.6 s old" in live.until("unknown")["why"]
    assert "0.6 s old" in str(live.desk.offered("a", found["plan"]))
    assert live.desk.over("a", found["plan"]) == ""
    live.snapshot = scene()
    live.until("offered")


def test_arrived_it_is_done(live: Live) -> None:
    found = live.plan()
    live.progress = Progress(found["plan"], found["duration"], ARRIVED, arrived=True)
    live.until("done")
    assert isinstance(live.desk.offered("a", found["plan"]), str)


def test_what_was_seen_while_it_was_followed_is_told(live: Live) -> None:
    found = live.plan()
    name, made = found["plan"], live.desk.offered("a", found["plan"])
    assert isinstance(made, Trajectory)
    figures = PlanDocument.model_validate_json(live.desk.text("a", name)).figures
    assert figures is not None
    np.testing.assert_allclose(figures.planned.swing, made.rates[:, 0], atol=1e-4)
    np.testing.assert_allclose(figures.initial.end_point[-1], found["goal"], atol=1e-3)
    empty = live.desk.followed("a", name)
    assert empty["at"] == []
    FollowedSeries.model_validate(empty)
    for k in range(1000):
        at = min(0.02 * k, made.duration)
        now = state("a", (0.0, 0.0), q=made.at(at)[0])
        pose = dataclasses.replace(now.pose, time=100.0 + 0.02 * (k // 2))  # each told twice
        live.progress = Progress(name, at, "", arrived=False)
        live.desk.keep(scene(a=dataclasses.replace(now, pose=pose)))
    live.progress = Progress(name, made.duration, ARRIVED, arrived=True)
    live.desk.keep(scene())  # after its end it does not count
    told = FollowedSeries.model_validate_json(dumps(live.desk.followed("a", name)))
    assert 100 < len(told.at) <= 400
    assert told.at[-1] == pytest.approx(made.duration, abs=0.05)
    assert told.time[-1] == pytest.approx(9.98, abs=0.05)
    wanted = [made.at(at)[0] for at in told.at]
    np.testing.assert_allclose(told.joints, wanted, atol=2e-3)
    assert any(value is not None for value in told.lift)
    with pytest.raises(InputError, match="not on offer"):
        live.desk.followed("a", "a-0")


def test_followed_no_other_is_planned_until_it_is_dropped(live: Live) -> None:
    found = live.plan()
    live.progress = Progress(found["plan"], 0.4, "", arrived=False)
    with pytest.raises(InputError, match="is being followed; drop it first"):
        live.desk.start(asked(), "bob")
    live.desk.drop("a", "bob")
    assert live.desk.over("a", found["plan"]) == "the plan was dropped"
    assert "a" not in live.desk.document()


def test_why_there_is_none_is_told_with_what_blocks(live: Live) -> None:
    found = live.plan(goal={"end_point": [9.0, 0.0, 0.5]})
    assert found["state"] == "none"
    assert "out of the arm's reach" in found["why"]
    assert found["proven"]
    live.snapshot = scene(b=state("b", (6.3, 0.0), math.pi))
    tip = end_point(MINI, START) + np.array([0.4, 0.0, 0.4])
    live.desk.start(asked(goal={"end_point": tip.tolist()}), "ann")
    found = live.until("none")
    assert any(name.startswith("b:") for name in found["blockers"])


@pytest.fixture(scope="module")
def url(live: Live) -> Iterator[str]:
    app = FastAPI()
    app.include_router(plan_router(live.desk))
    web = WebServer(app, bind("127.0.0.1", 0))
    web.start()
    yield f"http://127.0.0.1:{web.port}/api/plan"
    web.stop()


def apart(q: np.ndarray, T: np.ndarray, other: np.ndarray, T_other: np.ndarray) -> float:
    """The shortest distance of any posture of one from any posture of the other [m]."""
    ones = [body_boxes(MINI, link_poses(MINI, one, T)) for one in q]
    others = [body_boxes(MINI, link_poses(MINI, one, T_other)) for one in other]
    return float(min(closest_pairs(a, b).distance[0] for a in ones for b in others))


def test_one_machine_keeps_clear_of_what_the_other_has_announced(live: Live) -> None:
    first = live.plan()
    live.snapshot = scene(b=state("b", (4.6, 3.4), math.pi, q=[1.9, *START[1:]]))
    goal = {"machine": "b", "goal": {"joints": {"swing": -0.5}}, "clearance": 0.1}
    live.desk.start(PlanRequest.model_validate(goal), "bob")
    deadline = time.monotonic() + 120.0
    while (second := live.of("b"))["state"] not in ("offered", "none"):
        assert time.monotonic() < deadline, second
        time.sleep(0.05)
    ways = {}
    for name, plan in (("a", first), ("b", second)):
        way = live.desk.way(name, plan["plan"])
        assert way is not None, plan
        ways[name] = np.array(way[0].joints[::5]), way[1]
    # At no two moments of either do they come near: they may be followed at the same time.
    assert apart(*ways["a"], *ways["b"]) >= second["clearance"] - 1e-6
    # Had it not been announced, they would.
    alone = live_task(PlanRequest.model_validate(goal), live.snapshot, CONFIG)
    made = trajectory(MINI, alone.task, alone.obstacles)
    assert not isinstance(made, Refusal)
    assert apart(*ways["a"], made.q[::5], ways["b"][1]) < second["clearance"] - 0.1
    live.desk.drop("b", "bob")


def test_the_api_says_it_all(url: str, live: Live) -> None:
    live.snapshot, live.progress = scene(), None
    answer = httpx.post(url, json=SWUNG, trust_env=False)
    assert answer.status_code == 200
    name = answer.json()["plans"]["a"]["plan"]
    early = httpx.get(f"{url}/a/{name}", trust_env=False)
    assert early.status_code in (200, 404)
    live.until("offered")
    found = httpx.get(url, trust_env=False).json()
    jsonschema.validate(found, PlanStateDocument.model_json_schema())
    whole = httpx.get(f"{url}/a/{name}", trust_env=False).json()
    jsonschema.validate(whole, PlanDocument.model_json_schema())
    assert len(whole["time"]) == len(whole["joints"]) == len(whole["end_point"])
    live.snapshot = scene(a=state("a", (0.0, 0.0), rates=0.3))
    refused = httpx.post(url, json=SWUNG, trust_env=False)
    assert refused.status_code == 409
    assert "begins at rest" in refused.json()["detail"]
    assert httpx.post(url, json={"machine": "a"}, trust_env=False).status_code == 422
    assert "a" not in httpx.delete(f"{url}/a", trust_env=False).json()["plans"]
    assert httpx.get(f"{url}/a/{name}", trust_env=False).status_code == 404
