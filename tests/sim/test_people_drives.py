"""A careless operator among people: a sample of the campaign."""

from __future__ import annotations

from backend.shell.sim.people_drives import PeopleDrive, people_drive


def test_nobody_who_is_visible_is_touched() -> None:
    drives = [people_drive(PeopleDrive(seed, seconds=6.0, people=2)) for seed in (1, 4)]
    assert all(one.contact is None for one in drives)
    assert sum(one.path for one in drives) > 1.0
    for one in drives:
        assert sum(one.levels.values()) > 150
        assert one.levels.get("UNKNOWN", 0) == 0


def test_without_the_limiter_somebody_is() -> None:
    drives = [people_drive(PeopleDrive(k, limited=False, people=2)) for k in range(8)]
    assert sum(one.contact is not None for one in drives) >= 3


def test_with_nobody_there_people_do_not_limit() -> None:
    found = people_drive(PeopleDrive(2, seconds=5.0, people=0))
    assert set(found.levels) == {"CLEAR"}
    assert found.nearest == float("inf")
