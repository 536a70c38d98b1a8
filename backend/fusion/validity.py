"""Whether a pose may be used, and in words why not."""

from __future__ import annotations

import math
from collections.abc import Mapping

from backend.fusion.pose import StreamStatus, Validity
from backend.fusion.rig import Rig
from backend.fusion.samples import Fix
from backend.fusion.streams import Buffer, Streams

WORDS = {"joints": "joint angles", "position": "position", "heading": "heading"}


def statuses(
    rig: Rig,
    streams: Streams,
    now: float,
    offset: tuple[float, float, str] | None,
    joints_from_imus: bool,
) -> dict[str, StreamStatus]:
    """Health of "joints", "position", "heading" and "attitude".

    "attitude" is as old as the oldest IMU that is needed: those on tracks and upper body, and
    those of the arm where joints come from them.
    offset: of the machine's clock, `streams.offset(now)`; ages are worst cases of its bounds.
    Joints that come from IMUs are as old as the oldest IMU and the samples that give the rest.
    """
    lower, source = (offset[0], offset[2]) if offset else (math.nan, "arrival")

    def age(buffer: Buffer) -> float:
        if not buffer.entries or offset is None:
            return math.inf
        return max(0.0, now - (buffer.entries[-1].stamp + lower))

    def status(buffer: Buffer) -> StreamStatus:
        rate = buffer.rate(now)
        return StreamStatus(age(buffer), rate, source, buffer.received, buffer.rejected)

    imus = [
        buffer
        for name, buffer in streams.attitudes.items()
        if buffer.last is not None and (joints_from_imus or rig.imus[name].joint <= 0)
    ]
    attitude = StreamStatus(
        age=max((age(buffer) for buffer in imus), default=math.inf),
        rate=min((buffer.rate(now) for buffer in imus), default=0.0),
        age_source=source,
        received=sum(b.received for b in streams.attitudes.values()) + streams.strangers,
        rejected=sum(b.rejected for b in streams.attitudes.values()) + streams.strangers,
    )
    joints = status(streams.joints)
    if joints_from_imus:
        own = joints.age if streams.joints.last is not None else 0.0
        joints = StreamStatus(
            max(own, attitude.age),
            joints.rate or attitude.rate,
            source,
            joints.received,
            joints.rejected,
        )
    return {
        "joints": joints,
        "position": status(streams.position),
        "heading": status(streams.heading),
        "attitude": attitude,
    }


def judge(
    rig: Rig,
    streams: Streams,
    now: float,
    status: Mapping[str, StreamStatus],
    fix: Fix,
    sigma_position: float,
    unknown: tuple[int, ...],
) -> tuple[Validity, tuple[str, ...]]:
    """(validity, reasons), the gravest first; no reasons when VALID.

    UNKNOWN: a needed stream was never seen, a joint is not published, the machine's clock was
    stepped within the last second, the receiver has no fix, or a fresh position is known worse
    than the limit (that of an old one has grown with its age, which is reason enough).
    STALE: a needed stream, or an IMU that has been seen and is needed, is older than its limit.
    """
    config = rig.config
    reasons = []
    seen = {
        "joints": streams.joints.last is not None or not unknown,
        "position": streams.position.last is not None,
        "heading": streams.heading.last is not None,
    }
    limits = {
        "joints": config.joints_stale,
        "position": gnss_limit(rig, streams.position),
        "heading": gnss_limit(rig, streams.heading),
    }
    since_step = now - streams.last_step
    if since_step < config.step_hold:
        reasons.append(f"machine's clock was stepped {max(0.0, since_step):.1f} s ago")
    reasons += [f"has sent no {WORDS[key]} yet" for key, had in seen.items() if not had]
    if seen["joints"]:
        why = _missing(streams) if unknown else {}
        reasons += [
            f"{rig.machine.joints[k].role} {why.get(k, 'angle is not published')}" for k in unknown
        ]
    if fix is Fix.NONE and streams.position.received:
        reasons.append("has no GNSS fix")
    elif sigma_position > config.sigma_limit and status["position"].age <= limits["position"]:
        reasons.append(
            f"position is known to {sigma_position:.2f} m, limit {config.sigma_limit:.2f} m"
        )
    undetermined = bool(reasons)
    for key, limit in limits.items():
        if seen[key] and status[key].age > limit:
            reasons.append(_old(WORDS[key], status[key].age, key == "joints"))
    attitude = status["attitude"]
    tilted = any(
        buffer.last is not None and rig.imus[name].joint <= 0
        for name, buffer in streams.attitudes.items()
    )
    if tilted and attitude.age > config.attitude_stale:
        reasons.append(_old("attitude", attitude.age, False))
    if undetermined:
        return Validity.UNKNOWN, tuple(reasons)
    return (Validity.STALE if reasons else Validity.VALID), tuple(reasons)


def gnss_limit(rig: Rig, buffer: Buffer) -> float:
    """Age beyond which a position or heading is stale: max(0.3 s, 3 periods), at most 1 s."""
    entries = buffer.entries
    if len(entries) < 3:
        return rig.config.gnss_stale
    period = (entries[-1].stamp - entries[0].stamp) / (len(entries) - 1)
    return min(max(rig.config.gnss_stale, 3.0 * period), rig.config.gnss_stale_most)


def _missing(streams: Streams) -> dict[int, str]:
    """By joint, what the newest of the samples that left it out have to say about it."""
    return {joint: why for entry in streams.joints.entries for joint, why in entry.missing}


def _old(what: str, age: float, plural: bool) -> str:
    verb = "are" if plural else "is"
    if age == math.inf:
        return f"{what} {verb} of unknown age"
    return f"{what} {verb} {age:.1f} s old"
