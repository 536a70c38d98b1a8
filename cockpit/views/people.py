"""People and objects that LiDARs see: boxes with names, tails, foretold places, and who was lost.

Few nodes hold all of them: lines of one kind are one node, whose points are sent when they change.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence

import numpy as np
import viser

from backend.safety.record import Level
from backend.safety.swing_risk import Risk
from backend.spatial.types import AnyArray, Array
from backend.tracking.records import Status
from cockpit.views import palette, people_shapes
from cockpit.views.labels import Words
from cockpit.views.lines import Lines, ink
from cockpit.views.people_records import SeenLost, SeenPeople, SeenTrack
from cockpit.views.shapes import NO_LINE, Float32, box_mesh

PERIOD = 0.09  # between two drawings, unless a level changed [s]
OLD = 0.5  # age of the newest scan from which nobody counts as seen [s]
TAIL = 3.0  # [s]
JUMP = 3.0  # between two drawings: another time of a recording, not a way that was walked [m]
RAISED = 0.02  # over the ground, so that lines are not in it [m]
WHITE, TEXT, DIM, STALE = (
    ink(c) for c in (palette.PEOPLE, palette.TEXT, palette.SECONDARY, palette.STALE)
)
INKS = {
    Risk.SAFE: WHITE,
    Risk.WARNING: ink(palette.LEVEL[Level.SLOW]),
    Risk.EMERGENCY: ink(palette.LEVEL[Level.STOP]),
}


class PeopleNodes:
    """Nodes are made with the first people, so that a site without LiDARs has none."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._lines: dict[str, Lines] = {}
        self._fill: viser.MeshHandle | None = None
        self._words: dict[str, Words] = {}
        self._past: dict[int, list[tuple[float, Array]]] = {}
        self._drawn = -math.inf
        self._levels: tuple[object, ...] | None = None

    def update(
        self, people: SeenPeople | None, time: float, ground: float, now: float, lost: float
    ) -> None:
        """time: of the snapshot [s]; ground: its height [m]; now: a monotonic clock [s]; lost:
        seconds for which no snapshot came, 0 while they do.
        """
        if people is None:
            self._clear()
            return
        known = not people.reason and people.age + lost <= OLD
        levels = (known, *((t.id, t.status, t.risk) for t in people.tracks))
        if now - self._drawn < PERIOD and levels == self._levels:
            return
        self._drawn, self._levels = now, levels
        if known:
            self._remember(people.tracks, time)
        self._draw_tracks(people.tracks, known, ground + RAISED, time)
        marks = [people_shapes.lost_mark(one.position, ground + RAISED) for one in people.lost]
        self._line("lost", 2.0).draw(_joined(marks), WHITE)
        shapes = [people_shapes.sensor_mark(one.position) for one in people.sensors]
        fresh = [TEXT if one.age + lost <= OLD else STALE for one in people.sensors]
        self._line("sensors", 1.6).draw(_joined(shapes), _each(fresh, [len(s) for s in shapes]))
        self._say(people, known, now)

    def _draw_tracks(self, tracks: Sequence[SeenTrack], known: bool, z: float, time: float) -> None:
        boxes, inks = [], []
        for status in Status:
            some = [t for t in tracks if t.status is status]
            if some:
                lines = people_shapes.box_lines(*_placed(some), status)
                boxes.append(lines.reshape(-1, 2, 3))
                own = [INKS[t.risk] if known else STALE for t in some]
                inks.append(_each(own, [lines.shape[1]] * len(some)))
        self._line("boxes", 2.4).draw(_joined(boxes), _joined_inks(inks))
        sure = [t for t in tracks if t.status is not Status.TENTATIVE] if known else []
        self._fill_boxes([t for t in sure if t.status is Status.CONFIRMED])
        ways = people_shapes.foretold(
            np.array([t.position for t in sure]).reshape(-1, 3),
            np.array([t.ahead for t in sure]).reshape(-1, 2),
            np.array([t.cov for t in sure]).reshape(-1, 2, 2),
            z,
        )
        self._line("ahead", 1.4).draw(ways.reshape(-1, 2, 3), WHITE)
        shown = tracks if known else ()
        recent = [[p for at, p in self._past.get(t.id, []) if at >= time - TAIL] for t in shown]
        walked = [np.array(way) for way in recent if len(way) > 1]
        self._line("tails", 1.8).draw(people_shapes.tails(walked, z), DIM)
        risky = [t for t in shown if t.risk is not Risk.SAFE]
        marks = [
            people_shapes.level_mark(t.position, max(0.6, float(t.size[:2].max())), t.risk, z)
            for t in risky
        ]
        colors = _each([INKS[t.risk] for t in risky], [len(mark) for mark in marks])
        self._line("levels", 3.5).draw(_joined(marks), colors)

    def _fill_boxes(self, tracks: Sequence[SeenTrack]) -> None:
        if not tracks:
            if self._fill is not None:
                self._fill.visible = False
            return
        vertices, faces = box_mesh(people_shapes.upright(*_placed(tracks)))
        if self._fill is None:
            self._fill = self._scene.add_mesh_simple(
                "/people/fill",
                vertices,
                faces,
                color=palette.PEOPLE,
                opacity=0.22,
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
            )
        elif not np.array_equal(vertices, self._fill.vertices):
            self._fill.vertices = vertices
            if len(faces) != len(self._fill.faces):
                self._fill.faces = faces
        self._fill.visible = True

    def _remember(self, tracks: Sequence[SeenTrack], time: float) -> None:
        """Where they were; a track that is followed no more has no tail."""
        kept = {}
        for track in tracks:
            points, here = self._past.get(track.id, []), np.array(track.position[:2])
            if points and (time < points[-1][0] or np.linalg.norm(here - points[-1][1]) > JUMP):
                points = []
            kept[track.id] = [(at, p) for at, p in points if time - TAIL <= at < time]
            kept[track.id].append((time, here))
        self._past = kept

    def _say(self, people: SeenPeople, known: bool, now: float) -> None:
        texts: dict[str, tuple[str, Array, Hashable]] = {}
        for track in people.tracks:
            above = track.position + np.array([0.0, 0.0, track.size[2] / 2.0 + 0.2])
            texts[f"track/{track.id}"] = (
                track_text(track, known),
                above,
                (known, track.status, track.risk),
            )
        for one in people.lost:
            above = one.position + np.array([0.0, 0.0, 0.6])
            texts[f"lost/{one.id}"] = (lost_text(one), above, "lost")
        for name in self._words.keys() - texts.keys():
            self._words.pop(name).label.remove()
        for name, (text, place, meaning) in texts.items():
            if name not in self._words:
                self._words[name] = Words(
                    self._scene.add_label(
                        f"/people/{name}", text, font_screen_scale=1.3, anchor="bottom-center"
                    )
                )
            words = self._words[name]
            if np.abs(place - words.label.position).max() > 5e-3:
                words.label.position = place
            words.show(text, meaning, now)

    def _line(self, name: str, pixels: float) -> Lines:
        if name not in self._lines:
            self._lines[name] = Lines(self._scene, f"/people/{name}", pixels)
        return self._lines[name]

    def _clear(self) -> None:
        if not self._lines:
            return
        for words in self._words.values():
            words.label.remove()
        for lines in self._lines.values():
            lines.node.remove()
        if self._fill is not None:
            self._fill.remove()
        self._lines, self._words, self._past, self._fill = {}, {}, {}, None
        self._levels = None


def track_text(track: SeenTrack, known: bool) -> str:
    """The words over a box."""
    if not known:
        return f"? {track.code}"
    name = f"{track.code}?" if track.status is not Status.CONFIRMED else track.code
    if track.risk is Risk.SAFE:
        return name
    near = f" · {max(track.distance, 0.0):.1f} m" if math.isfinite(track.distance) else ""
    return f"{'▲ ' if track.risk is Risk.WARNING else ''}{track.risk.name} · {name}{near}"


def lost_text(one: SeenLost) -> str:
    """The words over the place of somebody who is followed no more."""
    return f"P{one.id} last seen here, {one.seen:.0f} s ago"


def _placed(tracks: Sequence[SeenTrack]) -> tuple[Array, Array, Array]:
    """Positions (n, 3), yaws (n,) and sizes (n, 3)."""
    return (
        np.array([t.position for t in tracks]),
        np.array([t.yaw for t in tracks]),
        np.array([t.size for t in tracks]),
    )


def _joined(parts: Sequence[Float32]) -> Float32:
    return np.concatenate([NO_LINE[:0], *parts])


def _joined_inks(parts: Sequence[AnyArray]) -> AnyArray:
    return np.concatenate([np.zeros((0, 3), dtype=np.uint8), *parts])


def _each(inks: Sequence[AnyArray], counts: Sequence[int]) -> AnyArray:
    """(k, 3): each colour as often as it has lines."""
    return np.repeat(np.array(inks, dtype=np.uint8).reshape(-1, 3), counts, axis=0)
