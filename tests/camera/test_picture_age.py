"""When a picture was taken, by clocks that agree, that do not, and that are not there."""

from __future__ import annotations

import pytest

from backend.shell.camera.age import ARRIVAL, CAPTURE, Stamps, taken

WALL = 1.7e9  # at local time 0


def ages(frames: list[tuple[float, float | None, bytes]]) -> list[tuple[str, float | None]]:
    """(arrival, stamp, jpeg) -> what the age counts from, and the age on arrival."""
    stamps, found = Stamps(), []
    for now, stamp, jpeg in frames:
        stamps, when = taken(stamps, stamp, jpeg, now, WALL + now)
        found.append((stamps.by, None if when is None else now - when))
    return found


def test_stamps_of_a_clock_that_agrees_are_believed() -> None:
    found = ages([(1.0, WALL + 0.9, b"a"), (2.0, WALL + 1.7, b"b"), (9.0, WALL + 1.8, b"c")])
    assert [by for by, _ in found] == [CAPTURE] * 3
    # The third hung on the way for seven seconds: it does not pass for fresh.
    assert [age for _, age in found] == pytest.approx([0.1, 0.3, 7.2])


@pytest.mark.parametrize("off", [-3600.0, 30.0])
def test_stamps_of_another_clock_tell_what_was_late(off: float) -> None:
    found = ages(
        [(t, WALL + t - way + off, b"x") for t, way in ((1.0, 0.2), (2.0, 0.1), (3.0, 1.6))]
    )
    assert [by for by, _ in found] == [ARRIVAL] * 3
    assert [age for _, age in found] == pytest.approx([0.0, 0.0, 1.5])


def test_the_same_picture_again_is_no_new_one() -> None:
    assert ages([(1.0, WALL + 0.9, b"a"), (2.0, WALL + 0.9, b"a")])[1] == (CAPTURE, None)
    assert ages([(1.0, None, b"a"), (2.0, None, b"a"), (3.0, None, b"b")]) == [
        (ARRIVAL, 0.0),
        (ARRIVAL, None),
        (ARRIVAL, 0.0),
    ]


def test_a_stamp_from_the_near_future_is_now() -> None:
    assert ages([(1.0, WALL + 1.1, b"a")]) == [(CAPTURE, 0.0)]
