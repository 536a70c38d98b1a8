"""One machine's streams: the samples of the last two seconds, the newest always winning.

`ingest` takes one sample and returns new streams. A sample is applied at most once and never steps
backward: what is not newer than the newest of its stream is rejected and counted, as is anything
implausible. Memory is bounded by `SPAN` and `CAPACITY`.

Three times meet here: the machine's stamps, the local clock of arrival, and (through the clock's
offset) the local time of measurement. Without a round-trip estimate the smallest recent
`arrival - stamp` stands in for the offset: ages are then at least the arrival ages, and flagged.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from operator import attrgetter

from backend.fusion import clock, plausible
from backend.fusion.clock import Clock
from backend.fusion.plausible import Entry
from backend.fusion.rig import Rig
from backend.fusion.samples import (
    AttitudeSample,
    ClockSample,
    Fix,
    FixSample,
    HeadingSample,
    JointSample,
    ProjectedSample,
    Sample,
)

SPAN = 2.0  # of stamps kept [s]
CAPACITY = 512
FUTURE = 0.010  # how far ahead of its arrival the clock's bounds may put a sample [s]
STEP_AHEAD = 0.5  # without an estimate: a stamp this far ahead of, or ...
STEP_BACK = 2.0  # ... behind the recent ones tells of a stepped clock [s]
SILENCE = 0.5  # nothing accepted for this long: a step is believed [s]
SLIDE = 1.0  # the smallest delay is over the last one to two of these [s]


_arrival = attrgetter("arrival")


@dataclass(frozen=True)
class Buffer:
    """One stream. entries: oldest first; last: the newest ever accepted, kept for drawing."""

    entries: tuple[Entry, ...] = ()
    last: Entry | None = None
    since: float = math.inf  # arrival of the first sample
    received: int = 0  # all that came
    rejected: int = 0

    def rate(self, now: float) -> float:
        """Accepted samples per second [Hz] of arrival over the last 2 s."""
        window = min(SPAN, max(now - self.since, 0.1))
        if len(self.entries) == CAPACITY:
            window = min(window, max(now - self.entries[0].arrival, 1e-3))
        # Arrivals are in order but for clock steps, which empty the buffer.
        first = bisect_left(self.entries, now - window, key=_arrival)
        return (len(self.entries) - first) / window


EMPTY = Buffer()


@dataclass(frozen=True)
class Streams:
    """All of one machine. buffers: "joints", "position", "heading" and "imu/..." for each IMU.

    delays: smallest arrival - stamp [s] of the present and of the previous slice of time, which
    began at `slice_start`.
    """

    buffers: Mapping[str, Buffer] = field(default_factory=dict)
    strangers: int = 0  # samples of IMUs on links that the machine does not have
    no_fix: float = -math.inf  # stamp of the newest message that said "no fix"
    clock: Clock = field(default_factory=Clock)
    stepped: float = -math.inf  # arrival at which a step was seen without round trips
    delays: tuple[float, float] = (math.inf, math.inf)
    slice_start: float = -math.inf
    accepted: float = -math.inf  # newest arrival of an accepted sample

    @property
    def joints(self) -> Buffer:
        return self.buffers.get("joints", EMPTY)

    @property
    def position(self) -> Buffer:
        return self.buffers.get("position", EMPTY)

    @property
    def heading(self) -> Buffer:
        return self.buffers.get("heading", EMPTY)

    @property
    def attitudes(self) -> dict[str, Buffer]:
        """By the IMU's link name, as published."""
        return {key[4:]: buffer for key, buffer in self.buffers.items() if key[:4] == "imu/"}

    def offset(self, now: float) -> tuple[float, float, str] | None:
        """(lower, upper, source) of local minus remote [s]; None before any sample.

        source: "offset" from round trips, or "arrival": the smallest delay taken for no delay.
        """
        bounds = self.clock.offset(now)
        if bounds is not None:
            return bounds[0], bounds[1], "offset"
        least = min(self.delays)
        return None if least == math.inf else (least, least, "arrival")

    @property
    def last_step(self) -> float:
        """Local time of the newest step of the machine's clock, -inf for never [s]."""
        return max(self.clock.stepped, self.stepped)


def ingest(rig: Rig, streams: Streams, sample: Sample) -> Streams:
    """The streams after one sample of this machine. Never raises for what a sample contains."""
    match sample:
        case ClockSample():
            after = clock.update(streams.clock, sample)
            stepped = after.stepped != streams.clock.stepped
            return replace(_forget(streams) if stepped else streams, clock=after)
        case JointSample():
            return _take(rig, streams, "joints", sample, plausible.joints(rig, sample))
        case FixSample() if sample.fix is Fix.NONE:
            return _lost_fix(streams, sample)
        case FixSample():
            return _take(rig, streams, "position", sample, plausible.fix(rig, sample))
        case ProjectedSample():
            return _take(rig, streams, "position", sample, plausible.projected(rig, sample))
        case HeadingSample():
            return _take(rig, streams, "heading", sample, plausible.heading(rig, sample))
        case AttitudeSample():
            if sample.link not in rig.imus:
                return replace(streams, strangers=streams.strangers + 1)
            entry = plausible.attitude(rig, sample)
            return _take(rig, streams, f"imu/{sample.link}", sample, entry)


def _take(
    rig: Rig,
    streams: Streams,
    key: str,
    sample: JointSample | FixSample | ProjectedSample | HeadingSample | AttitudeSample,
    entry: Entry | None,
) -> Streams:
    """The streams with `entry` appended to the stream `key`, or the sample counted as rejected."""
    stepped = False
    if entry is not None:
        timing = _timing(streams, key, sample.stamp, sample.arrival)
        if timing == "impossible":
            entry = None
        elif timing == "step":
            streams, stepped = _forget(streams), True
    buffer = streams.buffers.get(key, EMPTY)
    if entry is None or _repeats(rig, key, buffer, entry):
        since = min(buffer.since, sample.arrival)
        counted = Buffer(
            buffer.entries, buffer.last, since, buffer.received + 1, buffer.rejected + 1
        )
        return replace(streams, buffers={**streams.buffers, key: counted})
    entries = buffer.entries
    drop = max(0, len(entries) - CAPACITY + 1)
    while drop < len(entries) and entries[drop].stamp < entry.stamp - SPAN:
        drop += 1
    since = min(buffer.since, entry.arrival)
    entries = (*entries[drop:], entry)
    taken = Buffer(entries, entry, since, buffer.received + 1, buffer.rejected)
    delay = entry.arrival - entry.stamp
    delays, slice_start = streams.delays, streams.slice_start
    if entry.arrival - slice_start > SLIDE:
        delays, slice_start = (delay, delays[0]), entry.arrival
    elif delay < delays[0]:
        delays = (delay, delays[1])
    # Written out: `replace` takes three times as long, and this runs for every message.
    return Streams(
        buffers={**streams.buffers, key: taken},
        strangers=streams.strangers,
        no_fix=streams.no_fix,
        clock=streams.clock,
        stepped=entry.arrival if stepped else streams.stepped,
        delays=delays,
        slice_start=slice_start,
        accepted=entry.arrival,
    )


def _timing(streams: Streams, key: str, stamp: float, arrival: float) -> str:
    """One of "possible", "impossible", and "step": the machine's clock was set, begin anew."""
    if not plausible.timely(stamp, arrival):
        return "impossible"
    bounds = streams.clock.offset(arrival)
    if bounds is not None:
        # Nothing is measured after it arrived. By bounds that hold now, what was taken earlier
        # can lie ahead only if its stamp is from before a step.
        if stamp + bounds[0] > arrival + FUTURE:
            return "impossible"
        entries = streams.buffers.get(key, EMPTY).entries
        ahead = bool(entries) and entries[-1].stamp + bounds[0] > arrival + FUTURE
        return "step" if ahead else "possible"
    least = min(streams.delays)
    if least == math.inf or -STEP_AHEAD <= arrival - stamp - least <= STEP_BACK:
        return "possible"
    # One stray message must neither block a stream nor reset it: silence decides.
    return "step" if arrival - streams.accepted > SILENCE else "impossible"


def _repeats(rig: Rig, key: str, buffer: Buffer, entry: Entry) -> bool:
    """Whether an entry is a duplicate, out of order, or further off than the machine can move.

    Steps are refused for half a second after the last good sample (positions: one second); a value
    that stays is believed after that, and the stream was stale in between.
    """
    if not buffer.entries:
        return False
    newest = buffer.entries[-1]
    dt = entry.stamp - newest.stamp
    if dt <= 0.0:
        return True
    if key == "joints" and dt < 0.5:
        moved = zip(entry.value, newest.value, rig.max_velocity, strict=True)
        for (new, old, fastest), turns in zip(moved, rig.continuous, strict=True):
            step = abs(new - old)
            if step > math.pi and turns:
                step = abs(math.remainder(new - old, math.tau))
            if step > 0.3 + 3.0 * fastest * dt:
                return True
    if key == "heading" and dt < 0.5:
        turned = math.remainder(entry.value[0] - newest.value[0], math.tau)
        return abs(turned) > 0.5 + 3.0 * dt
    if key == "position" and dt < 1.0:
        fastest = rig.machine.tracks.max_speed
        return math.dist(entry.value, newest.value) > 5.0 + 3.0 * fastest * dt
    return False


def _lost_fix(streams: Streams, sample: FixSample) -> Streams:
    """A receiver that says it has no fix: known at once, though it gives no position."""
    buffer = streams.position
    since = min(buffer.since, sample.arrival)
    timing = _timing(streams, "position", sample.stamp, sample.arrival)
    late = bool(buffer.entries) and sample.stamp <= buffer.entries[-1].stamp
    bad = timing != "possible" or late or sample.stamp <= streams.no_fix
    counted = Buffer(
        buffer.entries, buffer.last, since, buffer.received + 1, buffer.rejected + int(bad)
    )
    no_fix = streams.no_fix if bad else sample.stamp
    return replace(streams, buffers={**streams.buffers, "position": counted}, no_fix=no_fix)


def _forget(streams: Streams) -> Streams:
    """The streams without anything stamped by the old clock; last values and counts stay."""
    return replace(
        streams,
        buffers={key: replace(buffer, entries=()) for key, buffer in streams.buffers.items()},
        no_fix=-math.inf,
        delays=(math.inf, math.inf),
        slice_start=-math.inf,
    )
