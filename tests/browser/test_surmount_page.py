"""The panel of obstacles, with a made-up server: found, chosen, previewed, followed."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driving_frames import DriveFeed, console
from playwright.sync_api import Browser, Route, WebSocketRoute
from surmount_toy import CHOSEN, ENERGIES, candidate, document
from test_page_exact import CLIPPED, OUTSIDE, SIZES
from test_page_offline import frame
from test_page_offline import site as site_frame

from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_side import aside, base_poses, side_view, way_across
from backend.documents.surmount_state import (
    FollowedSurmount,
    SideView,
    SurmountChoice,
    SurmountOffer,
    SurmountRequest,
    SurmountStateDocument,
)
from backend.machine.load import load_machine
from backend.shell.app.driving_models import FollowModel

HEIGHT, AHEAD = 0.3, 2.5
PLAN = "left-over-1"
MINI = load_machine("mini")
START = np.array([0.0, 0.6, -1.2, -0.4])
MADE = document("left", "mini", np.eye(4), START, HEIGHT, AHEAD)
CLIMBS = next(phase for phase in MADE.phases if phase.name == "sequence 1")
HALF = round(0.5 * (CLIMBS.start + CLIMBS.end))  # [s]
ROW = next(k for k, t in enumerate(MADE.time) if t > HALF + 1e-9) - 1
SIDE = SideView.model_validate(side_view(MINI, MADE))
BOXES = [
    {
        "name": "step",
        "center": [AHEAD + 1.5, 0.0, 0.5 * HEIGHT],
        "rotation": np.eye(3).tolist(),
        "half_extents": [1.5, 2.0, 0.5 * HEIGHT],
    },
    {
        "name": "post",
        "center": [-3.0, -3.0, 1.0],
        "rotation": np.eye(3).tolist(),
        "half_extents": [0.3, 0.3, 1.0],
    },
]


def offer(state: str = "offered", **changes: Any) -> dict[str, Any]:
    made = state in ("offered", "void", "unknown", "done")
    found = {
        "plan": PLAN,
        "state": state,
        "why": "",
        "kind": "",
        "who": "anna",
        "asked": {"machine": "left", "obstacle": "step"},
        "obstacle": {"name": "step", "height": HEIGHT, "distance": AHEAD, "depth": 3.0},
        "candidate": CHOSEN if made else None,
        "parameters": MADE.parameters if made else None,
        "progress": None,
        "duration": MADE.duration if made else None,
        "energy": MADE.energy if made else None,
        "checks": MADE.checks if made else None,
        "notes": [],
        "keep": 0.4,
        "seconds": 21.0,
        "age": 0.2,
        "made": made,
        **changes,
    }
    return SurmountOffer.model_validate(found).model_dump()


def followed() -> str:
    """Until half of sequence 1, a little lower than planned."""
    rows = ROW
    axes, base = way_across(base_poses(np.array(MADE.base))), base_poses(np.array(MADE.base)[:rows])
    seen = aside(base, axes, base[0, :3, 3]) - [0.0, 0.01, 0.0]
    return FollowedSurmount(
        at=MADE.time[:rows],
        time=MADE.time[:rows],
        joints=(np.array(MADE.joints)[:rows] - 0.01).tolist(),
        base=seen.tolist(),
    ).model_dump_json()


class SurmountFeed(DriveFeed):
    """Answers /api/surmount; `offers` is the key surmounts of the snapshots."""

    def __init__(self, browser: Browser, size: tuple[int, int]) -> None:
        self.offers: dict[str, Any] = {}
        self.asked: list[SurmountRequest] = []
        self.chosen: list[int] = []
        self.refusal = ""
        super().__init__(browser, *size)

    def accept(self, socket: WebSocketRoute) -> None:
        super().accept(socket)
        socket.send(site_frame(obstacles=BOXES))
        socket.send(frame({"type": "you", "seat": "7", "who": "anna", "role": self.role}))

    def more_routes(self) -> None:
        super().more_routes()

        def answers(path: str, body: str) -> None:
            self.page.route(
                f"**/api/surmount/left/{path}",
                lambda route: route.fulfill(content_type="application/json", body=body),
            )

        self.page.route("**/api/surmount", self.reply)
        self.page.route("**/api/surmount/left", self.reply)
        other = [{**candidate(k), "chosen": k == 3} for k in range(len(ENERGIES))]
        more = MADE.model_copy(update={"energy": ENERGIES[3]}).model_dump()
        answers(PLAN, MADE.model_dump_json())
        answers(
            f"{PLAN}.3",
            SurmountDocument.model_validate({**more, "candidates": other}).model_dump_json(),
        )
        for name in (PLAN, f"{PLAN}.3"):
            answers(f"{name}/side", SIDE.model_dump_json())
            answers(f"{name}/followed", followed())
        self.page.route(f"**/api/surmount/left/{PLAN}/choose", self.choose)

    def reply(self, route: Route) -> None:
        if self.refusal:
            body = json.dumps({"detail": self.refusal})
            route.fulfill(content_type="application/json", body=body, status=409)
            return
        if route.request.method == "POST":
            self.asked.append(SurmountRequest.model_validate_json(route.request.post_data or ""))
            self.offers = {"left": offer("planning")}
        else:
            self.offers = {}
        self.answer(route)

    def choose(self, route: Route) -> None:
        wanted = SurmountChoice.model_validate_json(route.request.post_data or "")
        self.chosen.append(wanted.candidate)
        progress = {"done": 0, "of": 1, "words": "simulated"}
        self.offers = {"left": offer("planning", plan=f"{PLAN}.3", progress=progress, candidate=3)}
        self.answer(route)

    def answer(self, route: Route) -> None:
        found = SurmountStateDocument.model_validate({"surmounts": self.offers})
        route.fulfill(content_type="application/json", body=found.model_dump_json())

    def send(self, until: Any, **changes: Any) -> None:
        super().send(until, **{"surmounts": self.offers, "plans": {}, **changes})

    def open(self) -> None:
        self.send(lambda: self.page.is_visible("#surmount-open"))
        assert not self.page.is_visible("#surmount")
        self.page.keyboard.press("u")
        self.until_state("")
        self.send(lambda: bool(self.drawn()))

    def open_on_offer(self) -> None:
        self.send(lambda: self.page.is_visible("#surmount-open"))
        self.page.click("#surmount-open")
        self.until_state("READY")
        self.send(lambda: len(self.rows()) == len(ENERGIES))

    def drawn(self) -> dict[str, Any]:
        return self.shown("plan").get("surmount") or {}

    def click(self, east: float, north: float) -> None:
        view, drawn = self.shown("plan"), self.drawn()
        box = self.page.locator("#plan").bounding_box()
        assert box is not None
        x = drawn["middle"][0] + drawn["px"] * (east - view["centre"][0])
        y = drawn["middle"][1] - drawn["px"] * (north - view["centre"][1])
        self.page.mouse.click(box["x"] + x, box["y"] + y)

    def until_state(self, word: str) -> None:
        self.send(lambda: self.page.inner_text("#so-state") == word)

    def words(self) -> str:
        return self.page.inner_text("#so-line") + " " + self.page.inner_text("#so-more")

    def seek(self, t: float) -> None:
        self.page.evaluate(
            """t => { const slider = document.getElementById("so-time");
              slider.value = String(t); slider.dispatchEvent(new Event("input")); }""",
            t,
        )
        self.send(lambda: self.shown("so-plot-side").get("time") == t)

    def turn(self, which: str, kind: str) -> None:
        """Switch one of the plots on until it shows that."""
        for _ in range(3):
            if self.shown(f"so-plot-{which}").get("kind") == kind:
                return
            before = self.shown(f"so-plot-{which}").get("kind")
            self.page.click(f"#so-{which}")
            self.send(lambda b=before: self.shown(f"so-plot-{which}").get("kind") != b)
        assert self.shown(f"so-plot-{which}").get("kind") == kind

    def follow(self, **changes: Any) -> None:
        found = {
            "plan": PLAN,
            "at": MADE.time[ROW - 1],
            "duration": MADE.duration,
            "pace": 1.0,
            "error": {"swing": -0.014, "boom": 0.002},
            "ended": "",
            "arrived": False,
            **changes,
        }
        self.seat = {**self.seat, "follow": {"left": FollowModel(**found).model_dump()}}

    def rows(self) -> list[list[str]]:
        rows = self.page.locator("#so-rows tr")
        return [rows.nth(k).locator("td").all_inner_texts() for k in range(rows.count())]


def no_overflow(feed: SurmountFeed, size: tuple[int, int]) -> None:
    inner = CLIPPED.replace("#pin *", "#surmount > header *, #surmount .row *, #so-table th")
    for check in (CLIPPED, inner, OUTSIDE):
        assert feed.page.evaluate(check) == []
    root = "document.documentElement"
    assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
    rows = "[...document.querySelectorAll('#surmount > *')].filter(n => n.checkVisibility())"
    tops = f"{rows}.map(n => [n.getBoundingClientRect().top, n.getBoundingClientRect().bottom])"
    ends = feed.page.evaluate(tops)
    assert all(a[1] <= b[0] + 0.6 for a, b in pairwise(ends)), ends
    assert feed.page.is_visible("#alarm-line")
    wide = "(n => n.scrollWidth - n.clientWidth)(document.getElementById('so-table'))"
    assert feed.page.evaluate(wide) <= 0


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_from_the_list_to_the_top(browser: Browser, size: tuple[int, int], artifacts: Path) -> None:
    feed = SurmountFeed(browser, size)
    feed.open()
    # The one ahead is suggested, with its numbers; what is not ahead says so.
    feed.send(lambda: feed.drawn()["obstacle"] == "step")
    options = feed.page.locator("#so-obstacle option").all_inner_texts()
    assert options[0] == "step · 0.30 m high, 2.5 m ahead"
    assert "post · not ahead" in options[1]
    side = feed.shown("so-plot-side")
    assert side["step"] == {"height": pytest.approx(HEIGHT), "distance": pytest.approx(AHEAD)}
    assert feed.page.is_visible("#slice-0")
    assert feed.page.is_hidden("#so-plot-first")
    feed.page.screenshot(path=artifacts / f"surmount-asks-{size[0]}x{size[1]}.png")
    no_overflow(feed, size)
    feed.page.fill("#so-payload", "50")
    feed.page.click("#so-find")
    feed.send(lambda: len(feed.asked) == 1)
    (asked,) = feed.asked
    assert (asked.obstacle, asked.step, asked.payload, asked.effort) == (
        "step",
        None,
        50.0,
        "quick",
    )
    assert feed.of("follow") == []
    feed.until_state("PLANNING")
    progress = {"done": 7, "of": 24, "words": "simulated"}
    feed.offers = {"left": offer("planning", progress=progress)}
    feed.send(lambda: "simulated 7 of 24" in feed.words())
    assert feed.page.inner_text("#so-drop") == "Cancel"
    assert feed.page.evaluate("document.getElementById('so-progress').position") == pytest.approx(
        7 / 24
    )
    no_overflow(feed, size)

    # On offer: candidates, the way on the plan, the ghost, the machine from the side, the figures.
    feed.offers = {"left": offer()}
    feed.until_state("READY")
    feed.send(lambda: feed.drawn()["base"] == len(MADE.base))
    assert "5.95 kJ" in feed.words()
    assert "m to tipping" in feed.words()
    assert "% torque" in feed.words()
    rows = feed.rows()
    assert [row[1] for row in rows] == ["5950", "6100", "6400", "6600"]
    assert [row[0] for row in rows] == ["▸", "", "", ""]
    assert rows[0][2:] == ["32.0", "0.29", "29", "sim"]
    feed.send(lambda: bool(feed.of("plan")) and feed.of("plan")[-1]["rate"] == 1)
    assert feed.of("plan")[-1]["plan"] == PLAN
    feed.seek(HALF)
    feed.send(lambda: feed.of("plan")[-1]["at"] == HALF and feed.of("plan")[-1]["rate"] == 0)
    assert "sequence 1" in feed.page.inner_text("#so-at")
    side = feed.shown("so-plot-side")
    k = SIDE.time.index(max(t for t in SIDE.time if t <= HALF))
    assert side["parts"] == len(SIDE.parts)
    assert side["pivot"] == SIDE.pivots[k][-2]
    feed.send(lambda: feed.drawn()["at"] == pytest.approx(MADE.base[ROW][:2]))
    for which, kind in (("first", "rates"), ("first", "torques"), ("second", "energy")):
        feed.turn(which, kind)
        feed.send(lambda w=which: feed.shown(f"so-plot-{w}")["time"] == HALF)
    torques, energy = feed.shown("so-plot-first"), feed.shown("so-plot-second")
    assert MADE.checks is not None
    assert torques["share"] == pytest.approx(MADE.checks.worst_torque, abs=0.03)
    assert (torques["plan"], torques["phases"]) == (PLAN, len(MADE.phases))
    assert energy["bounds"] == ["heights", "slowly"]
    assert 0.0 < energy["total"] < energy["whole"]
    feed.page.mouse.move(*feed.at("so-plot-first", 0.3, 0.5))
    feed.send(lambda: "boom" in feed.page.inner_text("#hover"))
    assert "kN m" in feed.page.inner_text("#hover")
    feed.page.mouse.move(5, 5)
    feed.turn("second", "com")
    assert feed.shown("so-plot-second")["rise"] == pytest.approx(HEIGHT, abs=0.15)
    for _ in range(2):  # both layouts
        layout = feed.page.evaluate("document.body.dataset.layout")
        name = f"surmount-preview-{layout}-{size[0]}x{size[1]}.png"
        feed.send(lambda: True)
        feed.page.screenshot(path=artifacts / name)
        no_overflow(feed, size)
        feed.turn("first", "joints")
        feed.turn("second", "energy")
        feed.page.keyboard.press("v")
        feed.send(lambda: True)

    # The window goes along with the machine.
    drive = MADE.phases[0]
    assert drive.name == "drive"
    feed.seek(0)
    first = feed.shown("so-plot-side")["window"]
    feed.seek(math.ceil(drive.end))
    then = feed.shown("so-plot-side")["window"]
    way = MADE.base[-1][0] - MADE.base[0][0]
    assert 0.5 < then[0] - first[0] < way
    assert then[1] - then[0] == pytest.approx(first[1] - first[0], abs=0.02)
    # Accepted it waits for the dead-man, followed it says where it is.
    assert feed.of("follow") == []
    feed.page.click("#so-accept")
    feed.send(lambda: bool(feed.of("follow")))
    accepted = {"type": "follow", "do": "accept", "machine": "left", "plan": PLAN}
    assert feed.of("follow") == [accepted]
    feed.follow(at=0.0, pace=0.0)
    feed.until_state("ACCEPTED")
    assert "Hold Space to follow" in feed.words()
    assert feed.of("plan")[-1]["plan"] is None  # the ghost is gone
    feed.page.keyboard.down("Space")
    feed.send(lambda: feed.last["enable"])
    feed.still("Enabled")
    feed.follow()
    feed.until_state("FOLLOWING")
    assert "sequence 1 · " in feed.words()
    assert feed.page.is_disabled("#so-time")
    feed.send(lambda: feed.shown("so-plot-side")["time"] == round(MADE.time[ROW - 1], 2))
    feed.turn("first", "joints")
    feed.send(lambda: feed.shown("so-plot-first").get("actual") == ROW)
    feed.page.screenshot(path=artifacts / f"surmount-following-{size[0]}x{size[1]}.png")
    no_overflow(feed, size)
    feed.page.keyboard.up("Space")
    feed.follow(ended="arrived", arrived=True, at=MADE.duration)
    feed.offers = {"left": offer("done")}
    feed.until_state("ARRIVED")
    assert "LEFT is over it" in feed.words()
    assert feed.errors == []
    feed.page.close()


def test_another_candidate_is_worked_out_and_shown(browser: Browser) -> None:
    feed = SurmountFeed(browser, SIZES[1])
    feed.offers = {"left": offer()}
    feed.open_on_offer()
    feed.page.click("#so-rows tr[data-candidate='3'] button")
    feed.send(lambda: feed.chosen == [3])
    feed.until_state("PLANNING")
    assert len(feed.rows()) == 4  # the table stays meanwhile
    assert feed.page.is_disabled("#so-rows tr[data-candidate='0'] button")
    feed.offers = {"left": offer(plan=f"{PLAN}.3", candidate=3, energy=ENERGIES[3])}
    feed.until_state("READY")
    feed.send(lambda: feed.rows()[3][0] == "▸")
    feed.send(lambda: bool(feed.of("plan")) and feed.of("plan")[-1]["plan"] == f"{PLAN}.3")
    assert "6.60 kJ" in feed.words()
    feed.page.click("#so-drop")
    feed.send(lambda: feed.offers == {} and feed.page.is_visible("#so-find"))
    assert feed.errors == []
    feed.page.close()


def test_picked_on_the_plan_or_given_by_numbers(browser: Browser) -> None:
    feed = SurmountFeed(browser, SIZES[1])
    feed.open()
    feed.send(lambda: feed.drawn()["obstacle"] == "step")
    feed.click(-3.0, -3.0)
    feed.send(lambda: feed.drawn()["obstacle"] == "post")
    assert feed.page.is_disabled("#so-find")
    assert "post is not ahead" in feed.words()
    feed.click(AHEAD + 1.0, 0.5)
    feed.send(lambda: feed.drawn()["obstacle"] == "step")
    feed.send(lambda: feed.page.is_enabled("#so-find"))
    assert feed.asked == []  # a click asks for nothing
    feed.page.select_option("#so-obstacle", "")
    feed.page.fill("#so-height", "0.45")
    feed.page.fill("#so-distance", "1.9")
    feed.page.select_option("#so-effort", "thorough")
    feed.send(lambda: (feed.shown("so-plot-side")["step"] or {}).get("height") == 0.45)
    feed.page.click("#so-find")
    feed.send(lambda: len(feed.asked) == 1)
    (asked,) = feed.asked
    assert asked.step is not None
    assert (asked.step.height, asked.step.distance, asked.effort) == (0.45, 1.9, "thorough")
    feed.page.click("#so-drop")
    feed.send(lambda: feed.offers == {})
    feed.page.fill("#so-height", "0")
    feed.send(lambda: "allowed is -5 to 5" in feed.words())
    assert feed.page.is_disabled("#so-find")
    assert feed.errors == []
    feed.page.close()


def test_why_not_is_said_in_words(browser: Browser) -> None:
    feed = SurmountFeed(browser, SIZES[1])
    feed.open()
    feed.refusal = "LEFT moves (swing); a manoeuvre begins at rest."
    feed.send(lambda: feed.page.is_enabled("#so-find"))
    feed.page.click("#so-find")
    feed.send(lambda: "begins at rest" in feed.words())
    feed.refusal = ""
    why = "the boom would need 130 % of its torque"
    feed.page.click("#so-find")
    feed.send(lambda: len(feed.asked) == 1)
    feed.offers = {"left": offer("none", why=why, kind="torque", made=False)}
    feed.until_state("NO WAY")
    assert "Too little torque: the boom would need 130 % of its torque" in feed.words()
    assert feed.page.is_disabled("#so-accept")
    assert feed.page.is_visible("#so-find")
    feed.offers = {"left": offer("void", why="right:boom/2 is in its way: 0.12 m")}
    feed.until_state("VOID")
    assert "Void: RIGHT boom is in its way: 0.12 m" in feed.words()
    feed.offers = {"left": offer("unknown", why="RIGHT joint angles are 0.6 s old")}
    feed.until_state("UNKNOWN")
    assert feed.page.is_disabled("#so-accept")
    feed.offers = {"left": offer()}
    feed.until_state("READY")
    # Without the lease there is nothing to accept, and it says what to do.
    feed.seat = {**feed.seat, "consoles": {}, "decision": {}}
    feed.send(lambda: feed.page.is_disabled("#so-accept"))
    assert "request LEFT (R)" in feed.words()
    feed.seat = {**feed.seat, "consoles": {"left": console()}}
    feed.follow(ended="14 degrees off; plan again")
    feed.until_state("ENDED")
    assert "Ended: 14 degrees off; plan again" in feed.words()
    assert "Accept takes it up where it was left" in feed.words()
    assert feed.page.is_enabled("#so-accept")
    feed.page.click("#so-drop")
    feed.send(lambda: feed.offers == {} and feed.of("follow")[-1]["do"] == "drop")
    feed.page.keyboard.press("Escape")
    feed.send(lambda: not feed.page.is_visible("#surmount"))
    assert [e for e in feed.errors if "409" not in e] == []
    feed.page.close()


def test_one_panel_stands_in_its_place_and_elsewhere_is_no_button(browser: Browser) -> None:
    feed = SurmountFeed(browser, SIZES[1])
    feed.open()
    feed.page.click("#trajectory-open")
    feed.send(lambda: feed.page.is_visible("#trajectory") and feed.page.is_hidden("#surmount"))
    feed.page.keyboard.press("u")
    feed.send(lambda: feed.page.is_hidden("#trajectory") and feed.page.is_visible("#surmount"))
    super(SurmountFeed, feed).send(lambda: feed.page.is_hidden("#surmount"))
    assert feed.page.is_hidden("#surmount-open")
    feed.page.keyboard.press("u")
    super(SurmountFeed, feed).send(lambda: feed.page.is_hidden("#surmount"))
    assert feed.errors == []
    feed.page.close()


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_one_button_more_takes_no_name_from_the_plans_header(
    browser: Browser, size: tuple[int, int], artifacts: Path
) -> None:
    feed = SurmountFeed(browser, size)
    feed.open()
    feed.page.evaluate("() => { document.getElementById('gauge-open').hidden = false; }")
    told = """([text, kind]) => { const age = document.querySelector("#plan-panel .age");
      age.textContent = text; age.className = `age ${kind}`;
      const parts = [...document.querySelectorAll("#plan-panel > header *")];
      return parts.filter(n => n.checkVisibility() && n.clientWidth > 0
        && n.scrollWidth > n.clientWidth + 1).map(n => n.id || n.textContent); }"""
    for text, kind in (("0.2 s", ""), ("0.6 s", "old"), ("STALE 1.4 s", "stale")):
        assert feed.page.evaluate(told, [text, kind]) == []
    feed.page.screenshot(path=artifacts / f"surmount-header-{size[0]}x{size[1]}.png")
    feed.page.close()
