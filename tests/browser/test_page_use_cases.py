"""The panel of use cases, with a made-up server: started, compared, followed, stopped, refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from exact_frames import margins
from playwright.sync_api import Browser, Route, WebSocketRoute
from test_page_exact import CLIPPED, OUTSIDE, SIZES, ExactFeed
from test_page_offline import frame

from backend.documents.gauge_choice import GaugeStateDocument
from backend.documents.use_case import WORDS, UseCaseDocument, use_case_document
from backend.documents.use_case_state import UseCaseStateDocument
from backend.machine.load import load_machine
from backend.planning.use_cases import METHODS, MODEL, run_use_case

GAUGE = {"choice": "a", "own_tracks": {}}
NO_GAUGE = GaugeStateDocument(choice="a", editable=True, volumes=[], drawn=[]).model_dump()
OFFER = {
    "name": "pole",
    "title": "Towards a pole and back",
    "figures": "Figs. 4.2-4.4",
    "machine": "left",
    "label": "LEFT",
    "seconds": 12.0,
}


@pytest.fixture(scope="module")
def documents() -> dict[str, UseCaseDocument]:
    machine = load_machine(MODEL)
    return {
        method: use_case_document(machine, MODEL, [run_use_case("pole", method, machine)])
        for method in METHODS
    }


class UseCaseFeed(ExactFeed):
    """Answers /api/use-case: a run takes as long as two questions."""

    def __init__(
        self, browser: Browser, size: tuple[int, int], documents: dict[str, UseCaseDocument]
    ) -> None:
        self.documents = documents
        self.done: list[str] = []
        self.running: tuple[str, float] | None = None
        self.refusal = ""
        self.requests: list[str] = []
        super().__init__(browser, *size)

    def more_routes(self) -> None:
        self.page.route("**/api/gauge", lambda route: _answer(route, NO_GAUGE))
        self.page.route("**/api/use-case", self.reply)
        self.page.route(
            "**/api/use-case/pole/*",
            lambda route: _answer(
                route, self.documents[route.request.url.rsplit("/", 1)[1]].model_dump()
            ),
        )

    def accept(self, socket: WebSocketRoute) -> None:
        super().accept(socket)
        socket.send(frame({"type": "you", "seat": "7", "who": "anna", "role": "operator"}))

    def reply(self, route: Route) -> None:
        method = route.request.method
        self.requests.append(method)
        if method == "POST":
            if self.refusal:
                _answer(route, {"detail": self.refusal}, 409)
                return
            self.running = (json.loads(route.request.post_data or "")["method"], 0.0)
        elif method == "DELETE":
            self.running = None
        elif self.running is not None:
            name, share = self.running
            self.running = (name, share + 0.6) if share < 0.5 else None
            if self.running is None:
                self.done.append(name)
        _answer(route, self.state())

    def state(self) -> dict[str, Any]:
        now = self.running and {"name": "pole", "method": self.running[0], "progress": 0.4}
        found = UseCaseStateDocument.model_validate(
            {
                "offered": [OFFER],
                "why": "",
                "running": now,
                "trouble": "",
                "methods": [{"name": name, "words": WORDS[name]} for name in METHODS],
                "done": [{"name": "pole", "method": method} for method in self.done],
            }
        )
        return found.model_dump()

    def open(self) -> None:
        self.until(lambda: self.page.is_visible("#gauge-open"))
        assert not self.page.is_visible("#use-cases")
        self.page.click("#gauge-open")
        self.until(lambda: self.page.is_visible("#use-cases-open"))
        self.page.click("#use-cases-open")
        self.until(lambda: self.page.is_visible("#use-cases"))
        assert not self.page.is_visible("#gauge")

    def until(self, true: Any) -> None:
        self.send(true, gauge=GAUGE, margins=margins())

    def told(self) -> dict[str, Any]:
        """What the page last said to the 3D scene."""
        found = self.of("use_case")
        return found[-1] if found else {}

    def row(self, method: str) -> str:
        return self.page.inner_text(f'tr[data-row="{method}"]')


def _answer(route: Route, document: Any, status: int = 200) -> None:
    route.fulfill(content_type="application/json", body=json.dumps(document), status=status)


@pytest.mark.parametrize("size", SIZES, ids=lambda s: f"{s[0]}x{s[1]}")
def test_methods_are_compared_and_one_is_followed(
    browser: Browser, size: tuple[int, int], documents: Any, artifacts: Path
) -> None:
    feed = UseCaseFeed(browser, size, documents)
    feed.open()
    assert feed.page.inner_text("#uc-badge") == "USE CASE · simulated"
    assert feed.told() == {}  # nothing moves unasked
    feed.page.click("#uc-all")
    feed.until(lambda: "working it out" in feed.row("none") and "waits" in feed.row("scaling"))
    feed.until(lambda: bool(feed.shown("uc-distance").get("playing")))
    assert feed.done == list(METHODS)
    shown = feed.shown("uc-distance")
    assert (shown["upper"], shown["lower"], shown["method"]) == (0.8, 0.2, "scaling")
    assert set(shown["runs"]) == set(METHODS)
    assert feed.told()["name"] == "pole"
    assert (feed.told()["method"], feed.told()["rate"]) == ("scaling", 1)
    feed.until(lambda: feed.shown("uc-distance")["time"] > 2.0)
    assert "to pole" in feed.page.inner_text("#uc-words")
    nearest = documents["scaling"].runs[0].nearest.distance
    assert f"{nearest:.2f} m" in feed.row("scaling")

    # Dragged to a moment it stays there, and all three plots and the scene say that moment.
    feed.page.evaluate(
        """() => { const t = document.getElementById("uc-time");
          t.value = "4.9"; t.dispatchEvent(new Event("input")); }"""
    )
    feed.until(lambda: feed.shown("uc-joints").get("time") == 4.9)
    run = documents["scaling"].runs[0]
    feed.until(lambda: feed.told()["at"] == 4.9 and feed.told()["rate"] == 0)
    k = round(4.9 / documents["scaling"].step)
    assert feed.shown("uc-distance")["at"]["distance"] == pytest.approx(run.distance[k])
    assert feed.shown("uc-error")["at"]["error"] == pytest.approx(run.error[k])
    swing = feed.shown("uc-joints")["at"]["swing"]
    assert swing == pytest.approx(57.2958 * run.rates[k][0], abs=0.01)
    assert "cut to" in feed.page.inner_text("#uc-words")
    for _ in range(2):  # both layouts
        layout = feed.page.evaluate("document.body.dataset.layout")
        feed.page.mouse.move(*feed.at("uc-distance", 0.4, 0.4))
        feed.page.screenshot(path=artifacts / f"use-case-{layout}-{size[0]}x{size[1]}.png")
        for check in (CLIPPED, OUTSIDE, CLIPPED.replace("#pin *", "#use-cases *")):
            assert feed.page.evaluate(check) == [], layout
        root = "document.documentElement"
        assert feed.page.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == list(size)
        assert feed.page.is_visible("#alarm-line")
        feed.page.keyboard.press("v")
        feed.until(lambda: True)
    assert "potential field" in feed.page.inner_text("#hover")

    # Another method goes on at the same moment; the lower plots turn to angles and position.
    feed.page.click('[data-method="constrained"]')
    feed.page.click("#uc-second")
    feed.page.click("#uc-third")
    feed.until(lambda: feed.shown("uc-joints")["kind"] == "angles")
    feed.until(lambda: feed.shown("uc-error")["kind"] == "position")
    feed.until(lambda: feed.told()["method"] == "constrained")
    assert feed.told()["at"] == 4.9
    feed.page.screenshot(path=artifacts / f"use-case-angles-{size[0]}x{size[1]}.png")
    feed.page.click("#uc-third")
    feed.until(lambda: feed.shown("uc-error")["kind"] == "attitude")
    yaw = documents["constrained"].runs[0].tool[k][3]
    assert feed.shown("uc-error")["at"]["tool"][0] == pytest.approx(57.2958 * yaw, abs=0.01)
    feed.page.keyboard.press("Escape")
    feed.until(lambda: not feed.page.is_visible("#use-cases"))
    assert feed.told()["name"] is None
    assert feed.errors == []
    feed.page.close()


def test_it_is_stopped_and_refusals_are_told(browser: Browser, documents: Any) -> None:
    feed = UseCaseFeed(browser, SIZES[1], documents)
    feed.open()
    feed.page.click("#uc-start")
    feed.until(lambda: "POST" in feed.requests)
    feed.until(lambda: feed.page.inner_text("#uc-start") == "Stop")
    feed.page.click("#uc-start")
    feed.until(lambda: "DELETE" in feed.requests and feed.running is None)
    feed.until(lambda: feed.page.inner_text("#uc-start") == "Start")
    assert feed.told() == {}
    feed.refusal = "use case pole by none is being worked out; allowed is one at a time."
    feed.page.click("#uc-start")
    feed.until(lambda: "one at a time" in feed.page.inner_text("#uc-words"))
    feed.refusal = ""
    feed.page.click("#uc-start")
    feed.until(lambda: bool(feed.shown("uc-distance").get("playing")))
    assert feed.done == ["scaling"]
    feed.page.click("#uc-pause")
    feed.until(lambda: feed.told()["rate"] == 0)
    feed.page.click("#uc-start")  # takes the ghost away
    feed.until(lambda: feed.told()["name"] is None)
    assert [e for e in feed.errors if "409" not in e] == []
    feed.page.close()
