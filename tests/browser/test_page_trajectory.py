"""The panel of trajectories, with a made-up server: asked for, seen, accepted, followed, void."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driving_frames import DriveFeed, console
from exact_frames import Q
from playwright.sync_api import Browser, Route
from test_page_exact import CLIPPED, OUTSIDE, SIZES

from backend.documents.plan_document import PlanDocument
from backend.documents.plan_series import FollowedSeries, PlanFigures
from backend.documents.plan_state import PlanOffer, PlanRequest, PlanStateDocument
from backend.shell.app.driving_models import FollowModel
from backend.spatial.types import Array

GOAL = (-1.5, 2.0)
TIMES = np.linspace(0.0, 6.0, 121)


def document_points() -> Array:
    """Around the machine, from ahead to the goal."""
    u = TIMES / 6.0
    theta = math.radians(30) + u * (math.atan2(GOAL[1], GOAL[0]) - math.radians(30))
    reach = 3.2 + u * (math.hypot(*GOAL) - 3.2)
    return np.stack([reach * np.cos(theta), reach * np.sin(theta), 0.4 + u], axis=1)


def document() -> PlanDocument:
    u = TIMES / 6.0
    theta = math.radians(30) + u * (math.atan2(GOAL[1], GOAL[0]) - math.radians(30))
    q = np.tile([Q[role] for role in ("swing", "boom", "stick", "bucket")], (121, 1))
    q[:, 0] = theta
    return PlanDocument(
        ok=True, machine="left", method="toppra", duration=6.0, time=TIMES.tolist(),
        roles=["swing", "boom", "stick", "bucket"], joints=q.tolist(),
        end_point=document_points().tolist(),
        figures=PlanFigures.model_validate(
            {"initial": motion(1.5, 0.7), "planned": motion(1.0, 0.4)}
        ),
    )  # fmt: skip


def motion(stretch: float, swing: float) -> dict[str, Any]:
    """Bell-shaped, `stretch` times as fast; the limits are 0.5 rad/s and 0.8 m/s^2."""
    u, count = TIMES / 6.0, len(TIMES)
    return {
        "time": (TIMES / stretch).tolist(),
        "end_point": document_points().tolist(),
        "swing": (swing * np.sin(np.pi * u)).tolist(),
        "critical_swing": [0.5] * count,
        "lift": (0.3 * stretch * np.sin(2 * np.pi * u)).tolist(),
        "critical_lift": [0.8 if k > 20 else None for k in range(count)],
    }


def followed() -> str:
    """The first 2.4 s."""
    series = {k: v[:49] for k, v in motion(1.0, 0.38).items()}
    joints = (np.array(document().joints)[:49] - 0.02).tolist()
    return FollowedSeries(**series, at=TIMES[:49].tolist(), joints=joints).model_dump_json()


def offer(state: str = "offered", **changes: Any) -> dict[str, Any]:
    made = state in ("offered", "void", "unknown", "done")
    asked = PlanRequest.model_validate({"machine": "left", "goal": {"end_point": [*GOAL, 0.5]}})
    checks = {
        "min_clearance": 0.71,
        "min_own_clearance": 0.1,
        "min_ground_clearance": 0.4,
        "min_stability_margin": 0.42,
        "worst_rate": 0.99,
        "worst_acceleration": 0.99,
        "samples": 300,
    }
    found = {
        "plan": "left-1",
        "state": state,
        "why": "",
        "kind": "",
        "blockers": [],
        "proven": False,
        "who": "anna",
        "asked": asked,
        "goal": [*GOAL, 0.5],
        "duration": 6.0 if made else None,
        "clearance": 0.58,
        "keep": 0.38,
        "checks": checks if made else None,
        "notes": [],
        "seconds": 0.4,
        "age": 0.2,
        **changes,
    }
    return PlanOffer.model_validate(found).model_dump()


class TrajectoryFeed(DriveFeed):
    """Answers /api/plan; `offers` is the key plans of the snapshots."""

    def __init__(self, browser: Browser, size: tuple[int, int]) -> None:
        self.offers: dict[str, Any] = {}
        self.asked: list[PlanRequest] = []
        self.refusal = ""
        super().__init__(browser, *size)

    def more_routes(self) -> None:
        super().more_routes()
        self.page.route("**/api/plan", self.reply)
        self.page.route(
            "**/api/plan/left/left-1/followed",
            lambda route: route.fulfill(content_type="application/json", body=followed()),
        )
        self.page.route("**/api/plan/left", self.reply)
        self.page.route(
            "**/api/plan/left/left-1",
            lambda route: route.fulfill(
                content_type="application/json", body=document().model_dump_json()
            ),
        )

    def reply(self, route: Route) -> None:
        if self.refusal:
            body = json.dumps({"detail": self.refusal})
            route.fulfill(content_type="application/json", body=body, status=409)
            return
        if route.request.method == "POST":
            self.asked.append(PlanRequest.model_validate_json(route.request.post_data or ""))
            self.offers = {"left": offer("planning")}
        else:
            self.offers = {}
        answer = PlanStateDocument.model_validate({"plans": self.offers})
        route.fulfill(content_type="application/json", body=answer.model_dump_json())

    def send(self, until: Any, **changes: Any) -> None:
        super().send(until, **{"plans": self.offers, **changes})

    def open(self) -> None:
        self.send(lambda: self.page.is_visible("#trajectory-open"))
        assert not self.page.is_visible("#trajectory")
        self.page.click("#trajectory-open")
        self.until_state("")
        self.send(lambda: bool(self.drawn()))

    def drawn(self) -> dict[str, Any]:
        return self.shown("plan").get("trajectory") or {}

    def click(self, east: float, north: float) -> None:
        view, drawn = self.shown("plan"), self.drawn()
        box = self.page.locator("#plan").bounding_box()
        assert box is not None
        x = drawn["middle"][0] + drawn["px"] * (east - view["centre"][0])
        y = drawn["middle"][1] - drawn["px"] * (north - view["centre"][1])
        self.page.mouse.click(box["x"] + x, box["y"] + y)

    def until_state(self, word: str) -> None:
        self.send(lambda: self.page.inner_text("#tj-state") == word)

    def words(self) -> str:
        return self.page.inner_text("#tj-line") + " " + self.page.inner_text("#tj-more")

    def follow(self, **changes: Any) -> None:
        found = {
            "plan": "left-1",
            "at": 2.4,
            "duration": 6.0,
            "pace": 1.0,
            "error": {"swing": -0.014, "boom": 0.002},
            "ended": "",
            "arrived": False,
            **changes,
        }
        self.seat = {**self.seat, "follow": {"left": FollowModel(**found).model_dump()}}

    def click_side(self, out: float, up: float) -> None:
        """In the side view, metres out from the swing axis and over the ground."""
        frame = self.shown("tj-plot-side")["frame"]
        box = self.page.locator("#tj-plot-side").bounding_box()
        assert box is not None
        low, high = frame["span"]
        x = frame["left"] + out / frame["far"] * (frame["right"] - frame["left"])
        y = frame["bottom"] - (up - low) / (high - low) * (frame["bottom"] - frame["top"])
        self.page.mouse.click(box["x"] + x, box["y"] + y)


def no_overflow(feed: TrajectoryFeed, size: tuple[int, int]) -> None:
    inner = CLIPPED.replace("#pin *", "#trajectory > header *, #trajectory .row *")
    for check in (CLIPPED, inner, OUTSIDE):
        assert feed.page.evaluate(check) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
    rows = "[...document.querySelectorAll('#trajectory > *')].filter(n => n.checkVisibility())"
    tops = f"{rows}.map(n => [n.getBoundingClientRect().top, n.getBoundingClientRect().bottom])"
    ends = feed.page.evaluate(tops)
    assert all(a[1] <= b[0] + 0.6 for a, b in pairwise(ends)), ends
    assert feed.page.is_visible("#alarm-line")


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_from_a_click_to_the_goal(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = TrajectoryFeed(browser, size)
    feed.open()
    assert feed.page.is_disabled("#tj-plan")
    assert "Click the goal" in feed.words()
    feed.click(*GOAL)
    feed.send(lambda: bool(feed.drawn()["goal"]))
    np.testing.assert_allclose(feed.drawn()["goal"], GOAL, atol=0.1)
    assert feed.asked == []  # a click asks for nothing
    assert feed.of("follow") == []
    feed.page.fill("#tj-height", "1.2")
    feed.page.fill("#tj-payload", "80")
    feed.page.fill("#tj-lift", "0.5")
    feed.page.fill("#tj-speed", "50")
    feed.page.click("#tj-plan")
    feed.send(lambda: len(feed.asked) == 1)
    (asked,) = feed.asked
    assert asked.goal.end_point is not None
    np.testing.assert_allclose(asked.goal.end_point, [*GOAL, 1.2], atol=0.1)
    assert (asked.payload, asked.lift, asked.clearance, asked.ground) == (80.0, 0.5, 0.2, True)
    assert asked.limits.joint_velocities["swing"] == pytest.approx(0.45)
    assert asked.limits.joint_accelerations == {}
    feed.until_state("PLANNING")

    # On offer: its path on the plan, its ghost in the scene, its numbers in words.
    feed.offers = {"left": offer()}
    feed.until_state("READY")
    feed.send(lambda: feed.drawn()["path"] == 121)
    assert "6.0 s" in feed.words()
    assert "0.71 m at least (0.58 m asked)" in feed.words()
    assert "0.42 m to tipping" in feed.words()
    feed.send(lambda: bool(feed.of("plan")) and feed.of("plan")[-1]["rate"] == 1)
    assert feed.of("plan")[-1]["plan"] == "left-1"
    feed.page.evaluate(
        """() => { const t = document.getElementById("tj-time");
          t.value = "3"; t.dispatchEvent(new Event("input")); }"""
    )
    feed.send(lambda: feed.of("plan")[-1]["at"] == 3 and feed.of("plan")[-1]["rate"] == 0)
    feed.send(lambda: feed.drawn()["at"] == pytest.approx(document().end_point[60]))
    feed.send(lambda: feed.shown("tj-plot-swing").get("time") == 3)
    swing, lift = feed.shown("tj-plot-swing"), feed.shown("tj-plot-lift")
    assert (swing["most"], swing["limit"]) == (
        pytest.approx(math.degrees(0.4)),
        pytest.approx(math.degrees(0.5)),
    )
    assert swing["over"]  # the simple one would have tipped, the planned one does not
    assert swing["within"]
    assert (lift["limit"], lift["over"], lift["actual"]) == (0.8, False, 0)
    assert feed.shown("tj-plot-joints")["plan"] == "left-1"
    assert feed.drawn()["simple"] == 121
    for _ in range(2):  # both layouts
        layout = feed.page.evaluate("document.body.dataset.layout")
        name = f"trajectory-preview-{layout}-{size[0]}x{size[1]}.png"
        feed.page.screenshot(path=artifacts / name)
        no_overflow(feed, size)
        feed.page.keyboard.press("v")
        feed.send(lambda: True)

    # Accepted it waits for the dead-man, followed it says where it is.
    assert feed.of("follow") == []
    feed.page.click("#tj-accept")
    feed.send(lambda: bool(feed.of("follow")))
    accepted = {"type": "follow", "do": "accept", "machine": "left", "plan": "left-1"}
    assert feed.of("follow") == [accepted]
    feed.follow(at=0.0, pace=0.0)
    feed.until_state("ACCEPTED")
    assert "Hold Space to follow" in feed.words()
    assert "hold Space to follow left-1" in feed.page.inner_text("#drive-line")
    assert feed.of("plan")[-1]["plan"] is None  # the ghost is gone
    feed.page.keyboard.down("Space")
    feed.send(lambda: feed.last["enable"])
    feed.still("Enabled")
    feed.follow()
    feed.until_state("FOLLOWING")
    assert "2.4 of 6.0 s" in feed.words()
    assert "error 0.8° swing" in feed.words()
    assert feed.page.is_disabled("#tj-plan")
    feed.send(lambda: feed.drawn()["at"] == pytest.approx(document().end_point[48]))
    feed.send(lambda: feed.shown("tj-plot-swing")["actual"] == 49)
    assert feed.shown("tj-plot-lift")["time"] == 2.4
    assert feed.shown("tj-plot-joints")["actual"] == 49
    feed.page.mouse.move(*feed.at("tj-plot-swing", 0.3, 0.4))
    feed.send(lambda: "actual" in feed.page.inner_text("#hover"))
    assert "Ω_c 28.65 °/s" in feed.page.inner_text("#hover")
    feed.page.screenshot(path=artifacts / f"trajectory-following-{size[0]}x{size[1]}.png")
    no_overflow(feed, size)
    feed.follow(pace=0.0)
    feed.until_state("WAITS")
    feed.page.keyboard.up("Space")
    feed.follow(ended="arrived", arrived=True, at=6.0)
    feed.offers = {"left": offer("done")}
    feed.until_state("ARRIVED")
    assert feed.errors == []
    feed.page.close()


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_the_goal_is_set_from_the_side(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = TrajectoryFeed(browser, size)
    feed.open()
    feed.send(lambda: bool(feed.shown("tj-plot-side").get("frame")))
    assert feed.page.is_hidden("#tj-plot-swing")
    assert feed.page.is_visible("#slice-0")
    assert feed.shown("tj-plot-side")["goal"] is None
    feed.click(*GOAL)
    feed.send(lambda: feed.shown("tj-plot-side")["goal"] is not None)
    out = feed.shown("tj-plot-side")["goal"][0]
    feed.click_side(3.0, 1.5)
    feed.send(lambda: feed.shown("tj-plot-side")["goal"][0] == pytest.approx(3.0, abs=0.06))
    assert float(feed.page.input_value("#tj-height")) == pytest.approx(1.5, abs=0.11)
    # In the same direction as before, seen from the swing axis.
    first, then = np.array(GOAL), np.array(feed.drawn()["goal"])
    assert np.linalg.norm(then - first) == pytest.approx(abs(3.0 - out), abs=0.15)
    feed.click_side(2.0, -0.6)
    feed.send(lambda: feed.page.input_value("#tj-height").startswith("-0."))
    feed.page.screenshot(path=artifacts / f"trajectory-side-{size[0]}x{size[1]}.png")
    no_overflow(feed, size)
    feed.offers = {"left": offer()}
    feed.until_state("READY")
    feed.send(lambda: feed.page.is_visible("#tj-plot-joints"))
    assert feed.page.is_hidden("#tj-plot-side")
    feed.page.click("#tj-third")
    feed.send(lambda: feed.shown("tj-plot-side").get("path") == 121)
    assert feed.page.is_hidden("#tj-plot-joints")
    assert feed.shown("tj-plot-side")["simple"] == 121
    no_overflow(feed, size)
    assert feed.asked == []
    assert feed.errors == []
    feed.page.close()


def test_what_blocks_what_is_void_and_what_is_refused_is_said(browser: Browser) -> None:
    feed = TrajectoryFeed(browser, SIZES[1])
    feed.open()
    feed.click(*GOAL)
    feed.refusal = "LEFT moves (swing); a trajectory begins at rest."
    feed.send(lambda: feed.page.is_enabled("#tj-plan"))
    feed.page.click("#tj-plan")
    feed.send(lambda: "begins at rest" in feed.words())
    feed.refusal = ""
    blocked = {"blockers": ["right:stick/0", "right:stick/1", "site:pole/0"]}
    why = "the way is blocked by right:stick/0."
    feed.offers = {"left": offer("none", why=why, proven=True, **blocked)}
    feed.page.click("#tj-plan")
    feed.send(lambda: len(feed.asked) == 1)
    feed.offers = {"left": offer("none", why=why, proven=True, **blocked)}
    feed.until_state("NO WAY")
    assert "Proven: the way is blocked by RIGHT stick" in feed.words()
    assert "In the way: RIGHT stick, pole" in feed.words()
    assert feed.page.is_disabled("#tj-accept")
    feed.offers = {"left": offer("void", why="right:boom/2 is in its way now")}
    feed.until_state("VOID")
    assert "Void: RIGHT boom is in its way now" in feed.words()
    assert feed.page.is_disabled("#tj-accept")
    feed.offers = {"left": offer("unknown", why="RIGHT joint angles are 0.6 s old")}
    feed.until_state("UNKNOWN")
    assert feed.page.is_disabled("#tj-accept")
    feed.offers = {"left": offer()}
    feed.until_state("READY")
    # Without the lease there is nothing to accept, and it says what to do.
    feed.seat = {**feed.seat, "consoles": {}, "decision": {}}
    feed.send(lambda: feed.page.is_disabled("#tj-accept"))
    assert "request LEFT (R)" in feed.words()
    feed.seat = {**feed.seat, "consoles": {"left": console()}}
    feed.follow(ended="right:stick/0 is in its way now")
    feed.until_state("ENDED")
    assert "Ended: RIGHT stick is in its way now" in feed.words()
    feed.page.fill("#tj-clearance", "0.01")
    feed.send(lambda: "allowed is 0.05 to 4" in feed.words())
    assert feed.page.is_disabled("#tj-plan")
    feed.page.click("#tj-drop")
    feed.send(lambda: feed.offers == {} and feed.of("follow")[-1]["do"] == "drop")
    feed.page.keyboard.press("Escape")
    feed.send(lambda: not feed.page.is_visible("#trajectory"))
    assert [e for e in feed.errors if "409" not in e] == []
    feed.page.close()


def test_elsewhere_there_is_no_button(browser: Browser) -> None:
    feed = TrajectoryFeed(browser, SIZES[1])
    super(TrajectoryFeed, feed).send(feed.driving)
    assert not feed.page.is_visible("#trajectory-open")
    feed.page.close()
