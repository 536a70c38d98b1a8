"""What a monitoring system reads of a running backend: GET /metrics, in Prometheus' text format.

The names are part of the interface: dashboards and alerts elsewhere hang on them.
"""

from __future__ import annotations

import hmac
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fastapi import APIRouter, HTTPException, Request, Response

from backend.errors import InputError
from backend.fusion.pose import Validity
from backend.pipeline.people_records import OBJECT, PERSON
from backend.pipeline.records import Snapshot
from backend.shell.app.feed import Frames
from backend.shell.private_file import check_private

CONTENT = "text/plain; version=0.0.4; charset=utf-8"
SHORTEST = 16  # characters of a token
RECORDER = ("on", "off", "trouble")


@dataclass
class Metric:
    """One name and its values by label. kind: "gauge", or "counter" for what only rises."""

    name: str
    kind: str
    help: str
    values: list[tuple[Mapping[str, str], float]] = field(default_factory=list)

    def add(self, value: float, **labels: str) -> None:
        self.values.append((labels, value))


def metrics_router(
    frames: Frames,
    backend: Callable[[], dict[str, Any]],
    recording: Callable[[], dict[str, Any]] | None,
    token: str,
) -> APIRouter:
    """GET /metrics for whoever sends `token` as a bearer token; 404 for all when it is empty.

    backend: live timings; recording: the recorder's state, None where nothing is recorded.
    """
    router = APIRouter(include_in_schema=False)

    @router.get("/metrics")
    def metrics(request: Request) -> Response:
        if not token:
            raise HTTPException(404, "no token for metrics was given at the start")
        scheme, _, given = request.headers.get("authorization", "").partition(" ")
        right = hmac.compare_digest(given.strip().encode(), token.encode())
        if scheme.lower() != "bearer" or not right:
            raise HTTPException(401, "the token is not right", {"WWW-Authenticate": "Bearer"})
        found = [*_of_backend(backend()), *_of_frames(frames), *_of_recorder(recording)]
        return Response(
            exposition(found), media_type=CONTENT, headers={"Cache-Control": "no-store"}
        )

    return router


def read_token(path: Path) -> str:
    """The token in a file (0600). Raises InputError."""
    check_private(path)
    try:
        token = path.read_text(encoding="ascii").strip()
    except UnicodeDecodeError:
        token = ""
    if len(token) < SHORTEST or not token.isprintable() or " " in token:
        raise InputError(
            f"{path}: holds no token; allowed are {SHORTEST} or more letters, digits and signs "
            "without spaces, as of `openssl rand -hex 32`."
        )
    return token


def exposition(metrics: Iterable[Metric]) -> str:
    """Prometheus' text format, version 0.0.4."""
    lines = []
    for metric in metrics:
        if metric.values:
            lines += [
                f"# HELP {metric.name} {metric.help}",
                f"# TYPE {metric.name} {metric.kind}",
            ]
        for labels, value in metric.values:
            inside = ",".join(f'{name}="{_escaped(text)}"' for name, text in labels.items())
            lines.append(f"{metric.name}{{{inside}}} {_number(value)}")
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("\n", "\\n").replace('"', '\\"')


def _number(value: float) -> str:
    if math.isnan(value):
        return "NaN"
    return repr(float(value)) if math.isfinite(value) else f"{'+' if value > 0 else '-'}Inf"


def _of_backend(backend: dict[str, Any]) -> Iterator[Metric]:
    seconds = Metric("cockpit_loop_seconds", "gauge", "How long a turn of a loop takes.")
    rate = Metric("cockpit_loop_rate_hertz", "gauge", "Turns of a loop in a second.")
    for loop, timing in backend.items():
        if not isinstance(timing, dict):
            continue
        for quantile in ("50", "95", "99"):
            seconds.add(timing[f"p{quantile}"] / 1e3, loop=loop, quantile=f"0.{quantile}")
        rate.add(timing["rate"], loop=loop)
    failure = Metric("cockpit_failure", "gauge", "1 while a part of the backend does not run.")
    failure.add(bool(backend.get("failure")))
    yield from (seconds, rate, failure)


def _of_frames(frames: Frames) -> Iterator[Metric]:
    clients = Metric("cockpit_clients", "gauge", "Pages and programs on the websocket.")
    clients.add(frames.clients)
    age = Metric("cockpit_snapshot_age_seconds", "gauge", "Since the newest snapshot.")
    newest, since = frames.hub.latest(), frames.hub.age()
    age.add(math.inf if since is None else since)
    yield from (clients, age)
    if newest is None:
        return
    cycles = Metric("cockpit_cycles_total", "counter", "Cycles of the pipeline.")
    cycles.add(newest.cycle)
    alarms = Metric("cockpit_alarms", "gauge", "Alarms that stand.")
    alarms.add(len(newest.alarms))
    images = Metric("cockpit_image_age_seconds", "gauge", "Age of the state that an image shows.")
    for (kind, key), image in frames.hub.images().items():
        images.add(newest.time - image.state_time + (since or 0.0), kind=kind, key=key)
    yield from (cycles, alarms, images, *_of_machines(newest), *_of_link(newest))
    yield from _of_people(newest)


def _of_machines(snapshot: Snapshot) -> Iterator[Metric]:
    valid = Metric("cockpit_pose_valid", "gauge", "1 while a machine's pose is valid.")
    validity = Metric("cockpit_pose_validity", "gauge", "1 for the validity that a pose has.")
    age = Metric("cockpit_stream_age_seconds", "gauge", "Age of a stream's newest sample.")
    rate = Metric("cockpit_stream_rate_hertz", "gauge", "Samples in a second.")
    received = Metric("cockpit_stream_received_total", "counter", "Samples that came.")
    refused = Metric("cockpit_stream_rejected_total", "counter", "Samples that were refused.")
    for name, state in snapshot.machines.items():
        pose = state.pose
        valid.add(pose.validity is Validity.VALID, machine=name)
        for one in Validity:
            validity.add(pose.validity is one, machine=name, validity=one.value)
        for stream, status in pose.streams.items():
            age.add(status.age, machine=name, stream=stream)
            rate.add(status.rate, machine=name, stream=stream)
            received.add(status.received, machine=name, stream=stream)
            refused.add(status.rejected, machine=name, stream=stream)
    yield from (valid, validity, age, rate, received, refused)


def _of_people(snapshot: Snapshot) -> Iterator[Metric]:
    people = snapshot.people
    if people is None:
        return
    age = Metric("cockpit_people_age_seconds", "gauge", "Since the newest scan of a LiDAR.")
    age.add(people.age)
    known = Metric("cockpit_people_known", "gauge", "1 while it is known who is around.")
    known.add(not people.reason)
    tracks = Metric("cockpit_people_tracks", "gauge", "People and objects that are followed.")
    for kind in (PERSON, OBJECT):
        tracks.add(people.tracked.kind.count(kind), kind=kind)
    lost = Metric("cockpit_people_lost", "gauge", "Those who are told as last seen somewhere.")
    lost.add(len(people.lost))
    yield from (age, known, tracks, lost)


def _of_link(snapshot: Snapshot) -> Iterator[Metric]:
    malformed = Metric(
        "cockpit_malformed_total", "counter", "Messages that could not be read, by key."
    )
    foreign = Metric(
        "cockpit_foreign_total", "counter", "Messages of machines that the site does not list."
    )
    lost = Metric("cockpit_lost_total", "counter", "Messages that were dropped unread.")
    for key, count in snapshot.health.malformed.items():
        malformed.add(count, key=key)
    for prefix, count in snapshot.health.foreign.items():
        foreign.add(count, prefix=prefix)
    lost.add(snapshot.health.lost)
    yield from (malformed, foreign, lost)


def _of_recorder(recording: Callable[[], dict[str, Any]] | None) -> Iterator[Metric]:
    state = Metric("cockpit_recorder", "gauge", "1 for the state that the recorder is in.")
    now = recording()["state"] if recording is not None else "off"
    for one in RECORDER:
        state.add(now == one, state=one)
    yield state
