"""A made-up player of a made-up session, as the server would answer for it."""

from __future__ import annotations

import json
import math
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
from playwright.sync_api import Route

BEGIN = 1_790_000_000.0  # s since 1970
DURATION = 600.0
PERIOD = 0.02  # of a recorded cycle [s]
NOTE = "positions synthesised from joint angles"


def event(
    kind: str, text: str, start: float, end: float | None = None, level: str | None = None
) -> dict[str, Any]:
    return {
        "kind": kind,
        "level": level,
        "machine": "left" if kind in ("alarm", "near miss") else None,
        "text": text,
        "start": start,
        "end": end,
    }


EVENTS = [
    event("note", "bucket teeth changed", 45.0),
    event("alarm", "LEFT bucket ↔ RIGHT boom · 0.62 m", 120.0, 128.0, "SLOW"),
    event("alarm", "LEFT bucket ↔ RIGHT boom · 0.15 m", 240.0, 252.0, "STOP"),
    event("near miss", "LEFT bucket ↔ RIGHT boom 0.08 m", 246.0),
    event("pin", "last 10 minutes kept", 300.0),
    event("action", "silenced", 305.0),
    event("gap", "nothing was recorded for 22.0 s", 380.0, 402.0),
    event("alarm", "RIGHT position is 0.6 s old", 450.0, 470.0, "UNKNOWN"),
]

SESSION: dict[str, Any] = {
    "title": "Trench at the north gate",
    "begin": BEGIN,
    "duration": DURATION,
    "machines": ["left", "right"],
    "origin": "live",
    "note": NOTE,
    "parts": [{"name": "part-0000.mcap", "begin": BEGIN, "end": BEGIN + DURATION}],
    "topics": {"/left/joint_states": {"type": "sensor_msgs/msg/JointState", "count": 120000}},
    "problems": [],
    "sources": ["recorded", "evaluated"],
    "index": {"state": "ready", "progress": 1.0},
    "events": EVENTS,
}

DIFF: dict[str, Any] = {
    "distance": {"pairs": {"left|right": {"max_abs": 0.042, "at": 246.3, "rms": 0.006}}},
    "levels": {
        "agree": 0.9987,
        "differences": [
            {
                "machine": "left",
                "start": 239.2,
                "end": 240.0,
                "recorded": "SLOW",
                "evaluated": "STOP",
            }
        ],
    },
    "first_warnings": [
        {
            "machine": "left",
            "name": "partner",
            "level": "SLOW",
            "recorded": 120.0,
            "evaluated": 118.6,
        },
        {"machine": "left", "name": "partner", "level": "STOP", "recorded": 240.0}
        | {"evaluated": None},
    ],
}


def clearance(t: np.ndarray) -> np.ndarray:
    """Falls to 0.6 m at 124 s and to 0.08 m at 246 s."""
    near = np.exp(-(((t - 124) / 6) ** 2)) * 0.84 + np.exp(-(((t - 246) / 9) ** 2)) * 0.98
    return np.asarray((3.8 + 0.6 * np.sin(t / 17)) * (1 - near))


def series(query: dict[str, str]) -> dict[str, Any]:
    t = np.linspace(float(query["start"]), float(query["end"]), int(query["points"]))
    shift = 0.25 if query["source"] == "evaluated" else 0.0
    unknown = (t > 450) & (t < 470)
    d = [None if u else float(v) for u, v in zip(unknown, clearance(t) - shift, strict=True)]
    level = np.select(
        [unknown, clearance(t) - shift < 0.2, clearance(t) - shift < 0.8],
        ["UNKNOWN", "STOP", "SLOW"],
        "CLEAR",
    )
    age = (0.03 + 0.02 * np.sin(t / 3) ** 2).tolist()
    old = np.where(unknown, 0.6, 0.04).tolist()
    joints = {
        "swing": (math.pi * np.sin(t / 40)).tolist(),
        "boom": (0.5 + 0.3 * np.sin(t / 9)).tolist(),
        "stick": (-1.2 + 0.6 * np.sin(t / 7)).tolist(),
        "bucket": (-0.4 + 0.9 * np.sin(t / 5)).tolist(),
    }
    return {
        "time": t.tolist(),
        "clearance": {"left|right": d},
        "ages": {
            "left": {"joints": age, "position": age},
            "right": {"joints": old, "position": old},
        },
        "joints": {"left": joints, "right": joints},
        "levels": {"left": level.tolist(), "right": level.tolist()},
    }


class Player:
    """Does what the page asks, and answers the session's API."""

    def __init__(self, problems: list[str] | None = None) -> None:
        self.time, self.playing, self.speed = 100.0, True, 1.0
        self.source, self.loop = "recorded", None
        self.changes: dict[str, Any] = {}  # of "playback" in the snapshot
        self.session = {**SESSION, "problems": problems or []}
        self.diff: dict[str, Any] = {"state": "none", "progress": 0.0, "result": None}
        self.after_diff: list[dict[str, Any]] = [
            {"state": "running", "progress": 0.4, "result": None},
            {"state": "done", "progress": 1.0, "result": DIFF},
        ]
        self.asked: list[tuple[str, str]] = []
        self.files: dict[str, tuple[int, str]] = {}  # path -> status, body

    def advance(self, seconds: float) -> None:
        if not self.playing:
            return
        self.time += self.speed * seconds
        if self.loop and self.time >= self.loop[1]:
            self.time = self.loop[0]
        if self.time >= DURATION:
            self.time, self.playing = DURATION, False

    def document(self) -> dict[str, Any]:
        return {
            "time": self.time,
            "duration": DURATION,
            "wall": BEGIN + self.time,
            "playing": self.playing,
            "speed": self.speed,
            "source": self.source,
            "sources": ["recorded", "evaluated"],
            "loop": self.loop,
            "catching_up": False,
            "title": self.session["title"],
            "note": NOTE,
            **self.changes,
        }

    def on_message(self, message: dict[str, Any]) -> None:
        if message.get("type") != "playback":
            return
        value = message.get("value")
        match message["do"]:
            case "play":
                self.playing = True
            case "pause":
                self.playing = False
            case "step" | "back":
                self.playing = False
                self.time += PERIOD if message["do"] == "step" else -PERIOD
            case "seek":
                self.time = value
            case "speed":
                self.speed = value
            case "loop":
                self.loop = value
            case "source":
                self.source = value
            case "next":
                self.time = min(e["start"] for e in EVENTS if e["start"] > self.time + 0.05)
            case "previous":
                self.time = max(e["start"] for e in EVENTS if e["start"] < self.time - 0.05)
            case unknown:
                raise AssertionError(f"no server knows {unknown!r}")

    def answer(self, route: Route) -> None:
        url = urlsplit(route.request.url)
        method = route.request.method
        path = url.path.removeprefix("/api/session")
        query = {key: values[0] for key, values in parse_qs(url.query).items()}
        self.asked.append((method, path + (f"?{url.query}" if url.query else "")))
        if path in self.files:
            status, body = self.files[path]
            text = body if status == 200 else json.dumps({"detail": body})
            kind = "text/html" if status == 200 else "application/json"
            disposition = {"Content-Disposition": 'attachment; filename="trench.html"'}
            route.fulfill(status=status, body=text, content_type=kind, headers=disposition)
            return
        if path == "/series":
            document: Any = series(query)
        elif path == "/diff":
            if method == "POST":
                self.diff = {"state": "running", "progress": 0.0, "result": None}
            elif self.diff["state"] == "running":
                self.diff = self.after_diff.pop(0)
            document = self.diff
        elif path == "":
            document = self.session
        else:
            route.fulfill(status=404, body="{}", content_type="application/json")
            return
        route.fulfill(body=json.dumps(document), content_type="application/json")
