"""The login page in a real browser: by keyboard, in words, and from another site's link."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from gatehouse import PASSWORD, house
from playwright.sync_api import Browser, BrowserContext, Route

from backend.control.person import Person
from backend.shell.access.links import Links

pytestmark = pytest.mark.browser


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    opened = browser.new_context(viewport={"width": 1366, "height": 768})
    yield opened
    opened.close()


def test_signing_in_and_out_by_keyboard(
    users_file: Path, tmp_path: Path, context: BrowserContext, artifacts: Path
) -> None:
    with house(tmp_path, users_file) as running:
        page = context.new_page()
        errors: list[str] = []
        page.on("console", lambda m: errors.append(m.text) if m.type != "log" else None)
        page.goto(running.url)
        assert page.url == f"{running.url}/login"
        assert page.evaluate("document.activeElement.id") == "name"
        assert page.get_by_label("Password").get_attribute("type") == "password"
        assert not page.locator(".link").is_visible()
        assert not page.locator(".inside").is_visible()
        page.screenshot(path=artifacts / "login.png")
        assert errors == []
        page.keyboard.type("otto")
        page.keyboard.press("Tab")
        page.keyboard.type("wrong password")
        page.keyboard.press("Enter")
        page.get_by_role("alert").get_by_text("Name or password is wrong.").wait_for()
        page.keyboard.type("otto")
        page.keyboard.press("Tab")
        page.keyboard.type(PASSWORD)
        page.keyboard.press("Enter")
        page.wait_for_url(f"{running.url}/")
        page.goto(f"{running.url}/login")
        assert page.locator(".inside").inner_text().startswith("Signed in as otto.")
        assert not page.locator(".passwords").is_visible()
        page.keyboard.press("Tab")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.locator(".passwords").wait_for()
        assert page.request.get(f"{running.url}/api/me").status == 401


def test_a_link_on_another_site_s_page_signs_in(tmp_path: Path, context: BrowserContext) -> None:
    """The cookie is Strict: the redirect goes without it, and the login page asks once more."""
    told: list[str] = []
    links = Links(Person("demo", "supervisor"), told.append)
    with house(tmp_path, links=links) as running:
        link = f"{running.url}/?token={links.make()}"
        html = f"<!doctype html><title>mail</title><a href='{link}'>the link</a>"

        def elsewhere(route: Route) -> None:
            route.fulfill(body=html, content_type="text/html")

        context.route("http://localhost:1/", elsewhere)
        page = context.new_page()
        page.goto("http://localhost:1/")
        page.click("a")
        page.wait_for_url(f"{running.url}/")
        assert len(told) == 1
        (cookie,) = context.cookies()
        assert (cookie["sameSite"], cookie["httpOnly"]) == ("Strict", True)
        assert page.request.get(f"{running.url}/api/me").json()["who"] == "demo"


def test_a_page_whose_session_is_over_leads_to_the_login_page(
    users_file: Path, tmp_path: Path, context: BrowserContext
) -> None:
    with house(tmp_path, users_file) as running:
        token = running.token("otto")
        cookie = {"name": running.access.cookie, "value": token, "url": running.url}
        context.add_cookies([cookie])  # type: ignore[list-item]
        page = context.new_page()
        page.goto(running.url)
        assert page.url == f"{running.url}/"
        page.wait_for_timeout(500)
        running.access.sessions.end(token)
        page.wait_for_url(f"{running.url}/login", timeout=15_000)
