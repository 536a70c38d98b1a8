"""What a page may say over its websocket, by the role of who sits there."""

from __future__ import annotations

import pytest

from backend.control.person import OPERATOR, SUPERVISOR, VIEWER, Person
from cockpit.desk import SHARED, may_say


@pytest.mark.parametrize("kind", sorted(SHARED))
def test_who_only_looks_changes_nothing_that_others_see(kind: str) -> None:
    assert not may_say({"type": kind}, None)
    assert not may_say({"type": kind}, Person("vic", VIEWER))
    assert may_say({"type": kind}, Person("ann", OPERATOR))
    assert may_say({"type": kind}, Person("sue", SUPERVISOR))


@pytest.mark.parametrize("kind", ["camera", "own", "ghost", "zones", "hello", None])
def test_one_s_own_page_is_anybody_s(kind: str | None) -> None:
    assert may_say({"type": kind}, Person("vic", VIEWER))
