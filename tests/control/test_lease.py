"""One lease, one holder: tokens, refreshing, handing over, taking over, expiry, races."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.control.lease import LONGEST, TERM, Kind, Lease, Request, ask, fresh


def request(kind: Kind, who: str = "ann", **fields: object) -> Request:
    return Request(kind, who, **fields)  # type: ignore[arg-type]


def granted(lease: Lease, now: float, who: str = "ann", kind: Kind = Kind.REQUEST, **f: object):
    lease, answer = ask(lease, request(kind, who, **f), now)
    assert answer.granted, answer.why
    return lease, answer.token


def refused(lease: Lease, now: float, who: str, kind: Kind = Kind.REQUEST, **f: object) -> str:
    after, answer = ask(lease, request(kind, who, **f), now)
    assert not answer.granted
    assert answer.token == 0
    assert after == lease
    return answer.why


def test_the_second_operator_is_refused_and_told_who_is_in_control() -> None:
    lease, token = granted(fresh(), 0.0)
    assert lease.admits(token, 0.5)
    assert refused(lease, 0.5, "bob") == "ann is in control"


def test_a_lease_that_is_not_refreshed_ends_within_a_second() -> None:
    lease, token = granted(fresh(), 0.0)
    assert TERM <= 1.0
    assert lease.admits(token, 0.99)
    assert not lease.admits(token, 1.0)
    assert "ended" in refused(lease, 1.0, "ann", Kind.REFRESH, token=token)
    lease, second = granted(lease, 1.0, "bob")
    assert second > token
    assert not lease.admits(token, 1.1)


def test_refreshing_keeps_the_token_and_needs_it() -> None:
    lease, token = granted(fresh(), 0.0)
    lease, same = granted(lease, 0.8, kind=Kind.REFRESH, token=token)
    assert same == token
    assert lease.admits(token, 1.7)
    assert refused(lease, 1.0, "ann", Kind.REFRESH, token=token - 1)
    assert refused(lease, 1.0, "bob", Kind.REFRESH, token=token)


def test_a_page_loaded_again_is_no_rival_and_fences_the_old_page() -> None:
    lease, old = granted(fresh(), 0.0)
    lease, new = granted(lease, 0.1)
    assert new > old
    assert not lease.admits(old, 0.2)
    assert lease.admits(new, 0.2)


def test_hand_over_only_to_the_one_named() -> None:
    lease, token = granted(fresh(), 0.0)
    assert refused(lease, 0.1, "bob", Kind.HAND_OVER, token=token, to="bob")
    assert refused(lease, 0.1, "ann", Kind.HAND_OVER, token=token)
    lease, _ = granted(lease, 0.1, kind=Kind.HAND_OVER, token=token, to="bob")
    assert lease.admits(token, 0.2)  # still in control until the other takes it
    assert refused(lease, 0.2, "eve")
    lease, new = granted(lease, 0.3, "bob")
    assert not lease.admits(token, 0.3)
    assert lease.admits(new, 0.3)
    assert refused(lease, 0.4, "ann")


def test_take_over_by_a_supervisor_with_a_reason_only() -> None:
    lease, token = granted(fresh(), 0.0)
    assert "supervisor" in refused(lease, 0.1, "sue", Kind.TAKE_OVER, reason="ann is ill")
    assert "reason" in refused(lease, 0.1, "sue", Kind.TAKE_OVER, role="supervisor", reason=" ")
    lease, answer = ask(
        lease, request(Kind.TAKE_OVER, "sue", role="supervisor", reason="ann is ill"), 0.1
    )
    assert (answer.granted, answer.why, answer.holder) == (True, "ann is ill", "sue")
    assert not lease.admits(token, 0.1)


def test_release_frees_at_once() -> None:
    lease, token = granted(fresh(), 0.0)
    assert refused(lease, 0.1, "bob", Kind.RELEASE, token=token)
    lease, answer = ask(lease, request(Kind.RELEASE, token=token), 0.1)
    assert answer.granted
    assert not lease.admits(token, 0.1)
    granted(lease, 0.1, "bob")


def test_a_stop_by_anybody_ends_the_lease_and_says_who_until_it_is_granted_anew() -> None:
    assert "nobody" in refused(fresh(), 0.0, "vic", Kind.STOP)
    lease, token = granted(fresh(), 0.0)
    lease, answer = ask(lease, request(Kind.STOP, "vic", role="viewer"), 0.1)
    assert (answer.granted, answer.token, answer.holder) == (True, 0, "")
    assert not lease.admits(token, 0.1)
    assert refused(lease, 0.2, "ann", Kind.REFRESH, token=token) == "vic pressed stop"
    lease, again = granted(lease, 0.3)
    assert (again, lease.stopped_by) == (token + 1, "")


@pytest.mark.parametrize("who", ["", "  ", "x" * (LONGEST + 1)])
def test_nobody_holds_no_lease(who: str) -> None:
    assert refused(fresh(), 0.0, who)


def test_an_agent_started_again_issues_no_token_twice() -> None:
    _, first = granted(fresh(1_000), 0.0)
    _, again = granted(fresh(2_000), 0.0)
    assert 1_000 < first < 2_000 < again


KINDS = st.sampled_from(list(Kind))


@given(st.lists(st.tuples(KINDS, st.sampled_from("abc"), st.integers(0, 6), st.floats(0, 0.6))))
def test_tokens_never_fall_and_one_at_most_is_good(asked: list[tuple]) -> None:
    lease, now = fresh(), 0.0
    for kind, who, token, dt in asked:
        now += dt
        before = lease
        role = "supervisor" if who == "c" else "operator"
        lease, _ = ask(lease, Request(kind, who, role, token, "b", "because"), now)
        assert lease.token >= before.token
        assert sum(lease.admits(t, now) for t in range(20)) <= 1
        if lease.held(now) and lease.holder != before.holder and before.held(now):
            assert lease.token > before.token  # a new holder is a new token


def test_ten_thousand_races_never_overlap() -> None:
    """Two operators ask in random order with random delays; at no time do two hold good tokens."""
    rng = random.Random(1)
    overlaps = 0
    for _ in range(10_000):
        lease, now = fresh(rng.randrange(1000)), 0.0
        tokens: dict[str, int] = {}
        for _ in range(rng.randrange(2, 8)):
            now += rng.choice([0.0, 0.001, 0.4, 0.7, 1.1])
            who = rng.choice(["ann", "bob"])
            kind = rng.choice([Kind.REQUEST, Kind.REQUEST, Kind.REFRESH, Kind.RELEASE])
            lease, answer = ask(lease, Request(kind, who, token=tokens.get(who, 0)), now)
            if answer.granted and answer.token:
                tokens[who] = answer.token
            overlaps += sum(lease.admits(t, now) for t in tokens.values()) > 1
    assert overlaps == 0
