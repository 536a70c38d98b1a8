"""The way in as people take it: the link in the terminal of `cockpit demo` and `cockpit play`."""

from __future__ import annotations

import re
import time
import urllib.error
from pathlib import Path

import pytest
from live import Backend, backend, playback
from playwright.sync_api import Browser

pytestmark = [pytest.mark.browser, pytest.mark.processes, pytest.mark.timeout(300)]


def links(running: Backend, count: int) -> list[str]:
    """The links that the terminal shows, once there are so many."""
    deadline = time.monotonic() + 10.0
    while True:
        found = re.findall(r"http://\S+/\?token=\S+", "\n".join(running.output))
        if len(found) >= count:
            return found
        assert time.monotonic() < deadline, running.output
        time.sleep(0.05)


def test_the_demo_is_entered_by_its_link(browser: Browser) -> None:
    with backend("demo", "--no-record", login=()) as running:
        (link,) = links(running, 1)
        stranger = browser.new_page()
        stranger.goto(running.url)
        assert stranger.url == f"{running.url}/login"
        assert "printed in its terminal" in stranger.locator(".link").inner_text()
        assert stranger.locator("form").count() == 2
        assert not stranger.locator(".passwords").is_visible()
        context = browser.new_context()
        page, errors = context.new_page(), []
        page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
        page.goto(link)
        assert page.url == f"{running.url}/"
        deadline = time.monotonic() + 60.0
        while page.inner_text("#mode") != "DEMO":
            assert time.monotonic() < deadline, "the page's websocket brings nothing"
            time.sleep(0.1)
        me = page.request.get(f"{running.url}/api/me").json()
        assert (me["who"], me["role"], me["how"]) == ("demo", "supervisor", "link")
        stranger.goto(link)
        assert "used already" in stranger.get_by_role("alert").inner_text()
        stranger.goto(links(running, 2)[1])
        assert stranger.url == f"{running.url}/"
        stranger.close()
        context.close()
        assert errors == []


def test_playback_is_entered_by_its_link(repository: Path, browser: Browser) -> None:
    session = repository / "scenes" / "sessions" / "near-miss.mcap"
    with playback(session, login=()) as running:
        with pytest.raises(urllib.error.HTTPError, match="401"):
            running.get("/api/session")
        page = browser.new_page()
        page.goto(links(running, 1)[0])
        assert page.url == f"{running.url}/"
        assert page.request.get(f"{running.url}/api/me").json()["who"] == "playback"
        page.close()


def test_serve_prints_a_link_when_told_so() -> None:
    arguments = ("--site", "demo", "--listen", "tcp/127.0.0.1:0", "--no-record")
    with backend("serve", *arguments, login=("--one-time-link",)) as running:
        assert len(links(running, 1)) == 1
        with pytest.raises(urllib.error.HTTPError, match="401"):
            running.get("/api/site")
        assert running.get("/api/health").keys() == {"ok", "status"}
