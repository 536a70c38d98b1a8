"""When a picture was taken, as far as it can be known. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

AGREES = (-0.2, 5.0)
"""A stamp that is so much older than its arrival is of a clock that agrees with this one [s]."""
CAPTURE, ARRIVAL = "capture", "arrival"


@dataclass(frozen=True)
class Picture:
    """A JPEG. taken: local monotonic time of the capture, or of the arrival where the camera does
    not say when that was [s]; by: which of both; serial: counts pictures of one camera.
    """

    jpeg: bytes
    taken: float
    by: str
    serial: int


@dataclass(frozen=True)
class Stamps:
    """What is known of one connection's stamps.

    by: decided by the first one, so that a camera that hangs cannot pass for one that does not;
    quickest: the least time from a stamp to its arrival so far [s], in a clock that does not agree;
    last: the newest stamp; jpeg: the newest picture.
    """

    by: str = ""
    quickest: float = 0.0
    last: float | None = None
    jpeg: bytes = b""


def taken(
    stamps: Stamps, stamp: float | None, jpeg: bytes, now: float, wall: float
) -> tuple[Stamps, float | None]:
    """When a picture that arrives now was taken, on the monotonic clock [s].

    None when it is no new one: its stamp is that of the one before, or it has none and is the same
    to the last bit, which no two exposures are. stamp: the camera's, None without; now, wall: the
    local monotonic clock and the time since 1970 [s]. In a clock that does not agree stamps tell
    how much later than the quickest one a picture came.
    """
    if stamp is None:
        if stamps.jpeg == jpeg:
            return stamps, None
        return replace(stamps, by=ARRIVAL, last=None, jpeg=jpeg), now
    if stamp == stamps.last:
        return stamps, None
    way = wall - stamp
    if not stamps.by or stamps.last is None:
        by = CAPTURE if AGREES[0] <= way <= AGREES[1] else ARRIVAL
        stamps = replace(stamps, by=by, quickest=way)
    stamps = replace(stamps, quickest=min(stamps.quickest, way), last=stamp, jpeg=b"")
    delay = way if stamps.by == CAPTURE else way - stamps.quickest
    return stamps, now - max(0.0, delay)
