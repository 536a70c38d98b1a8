"""One-time links: once, not for long, and the next one stands in the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from gatehouse import HTML, Clock, House, house

from backend.control.person import Person
from backend.shell.access.links import Links

DEMO = Person("demo", "supervisor")


def links_and(told: list[str], clock: Clock) -> Links:
    return Links(DEMO, told.append, clock, lasts=100.0)


def test_a_link_works_once_and_the_next_is_told() -> None:
    told: list[str] = []
    links = links_and(told, Clock())
    first = links.make()
    assert len(first) >= 43  # 256 bits
    assert told == []
    assert links.use(first)
    assert len(told) == 1
    assert not links.use(first)
    assert not links.use("")
    assert not links.use("guessed")
    assert len(told) == 1, "the one in the terminal is still valid"
    assert links.use(told[0])
    assert first not in repr(vars(links))


def test_an_old_link_does_not_work_and_brings_a_fresh_one() -> None:
    told: list[str] = []
    clock = Clock()
    links = links_and(told, clock)
    first = links.make()
    clock.now += 100.0
    assert not links.use("guessed")
    assert told == []
    assert not links.use(first)
    assert len(told) == 1
    clock.now += 100.0
    assert not links.use(first)  # long gone
    assert len(told) == 2
    clock.now += 99.0
    links.ask()
    assert len(told) == 2
    clock.now += 1.0
    links.ask()
    assert len(told) == 3
    assert not links.use(told[1])
    assert links.use(told[2])


def test_nothing_works_before_a_link_was_made() -> None:
    links = links_and([], Clock())
    assert not links.use("")
    assert not links.use("x")


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def linked(told: list[str], tmp_path: Path) -> Iterator[House]:
    with house(tmp_path, links=Links(DEMO, told.append)) as running:
        yield running


def test_the_link_becomes_a_cookie_and_leaves_the_address(linked: House, told: list[str]) -> None:
    assert linked.access.links is not None
    token = linked.access.links.make()
    with linked.client() as first, linked.client() as second:
        bare = first.get("/", headers=HTML)
        assert (bare.status_code, bare.headers["location"]) == (303, "/login")
        page = first.get("/login").text
        assert 'data-ways="link"' in page
        assert "the cockpit has printed in its terminal" in page
        assert first.head(f"/?token={token}").status_code == 401, "looking does not use it up"
        answer = first.get(f"/?images=sun&token={token}")
        assert (answer.status_code, answer.headers["location"]) == (303, "/?images=sun")
        assert answer.headers["cache-control"] == "no-store"
        cookie = answer.headers["set-cookie"]
        assert all(flag in cookie for flag in ("HttpOnly", "SameSite=strict", "Path=/;"))
        me = first.get("/api/me").json()
        assert (me["who"], me["role"], me["how"]) == ("demo", "supervisor", "link")
        again = second.get(f"/?token={token}")
        assert (again.status_code, again.headers["location"]) == (303, "/login?link=used")
        assert "set-cookie" not in again.headers
        assert "was used already" in second.get("/login?link=used").text
        assert first.get(f"/?token={token}").headers["location"] == "/", "who is in stays in"
        assert len(told) == 1
        assert second.get(f"/?token={told[0]}").headers["location"] == "/"


def test_guessing_links_is_limited(linked: House) -> None:
    assert linked.access.links is not None
    token = linked.access.links.make()
    with linked.client() as client:
        for k in range(20):
            client.get(f"/?token=guess{k}")
        assert "set-cookie" not in client.get(f"/?token={token}").headers


def test_passwords_are_not_asked_for_where_there_are_none(linked: House) -> None:
    with linked.client() as client:
        answer = client.post("/api/login", json={"name": "demo", "password": "x"})
        assert answer.status_code == 401
        assert "printed in its terminal" in answer.json()["detail"]


def test_no_link_works_where_there_are_passwords_only(users_file: Path, tmp_path: Path) -> None:
    with house(tmp_path, users_file) as running, running.client() as client:
        answer = client.get("/?token=x", headers=HTML)
        assert answer.headers["location"] == "/login?link=used"
        assert "set-cookie" not in answer.headers
