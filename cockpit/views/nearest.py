"""The line between the nearest points of two machines, with the distance."""

from __future__ import annotations

import numpy as np
import viser

from backend.pipeline.records import PairDistance, Snapshot
from backend.safety.record import Level
from cockpit.views import palette
from cockpit.views.inputs import SceneSite
from cockpit.views.labels import Words, distance_text, pair_level
from cockpit.views.shapes import NO_LINE

WIDTH: dict[Level, float] = {Level.CLEAR: 2.0, Level.SLOW: 4.0, Level.STOP: 6.0}


class PairNodes:
    """One line and one label per pair of machines that was ever near; made when first needed."""

    def __init__(self, scene: viser.SceneApi, site: SceneSite) -> None:
        self._scene = scene
        self._site = site
        # The label hangs under the line, clear of the arms and of the names over the machines.
        reach = min(entry.model.max_reach for entry in site.machines.values())
        self._drop = np.array([0.0, 0.0, 0.03 * reach])
        self._drawn: dict[tuple[str, str], tuple[viser.LineSegmentsHandle, Words]] = {}
        self._levels: dict[tuple[str, str], Level] = {}

    def update(self, snapshot: Snapshot, now: float, lost: float) -> None:
        """lost: seconds for which no snapshot came; then every clearance is unknown."""
        seen = set()
        for pair in snapshot.pairs:
            seen.add((pair.a, pair.b))
            if lost > 0.0:
                level = Level.UNKNOWN
            else:
                level = pair_level(snapshot, pair, self._site.slow_below, self._site.stop_below)
            self._show(snapshot, pair, level, now)
        for key in self._drawn.keys() - seen:
            self._hide(key)

    def _show(self, snapshot: Snapshot, pair: PairDistance, level: Level, now: float) -> None:
        key = (pair.a, pair.b)
        points = pair.points if level is not Level.UNKNOWN else _between(snapshot, pair)
        if points is None:
            self._hide(key)
            return
        line, words = self._nodes(key)
        line.visible = level is not Level.UNKNOWN
        if level is not self._levels.get(key):
            line.colors = palette.each(palette.LEVEL[level], line.points)
            line.thickness = WIDTH.get(level, 2.0)
            self._levels[key] = level
        if np.abs(line.points[0] - points).max() > 5e-4:
            line.points = points[None].astype(np.float32)
            words.label.position = points.mean(axis=0) - self._drop
        words.show(distance_text(pair.distance, level, pair.near), level, now)

    def _hide(self, key: tuple[str, str]) -> None:
        if key in self._drawn:
            line, words = self._drawn[key]
            line.visible = False
            words.hide()

    def _nodes(self, key: tuple[str, str]) -> tuple[viser.LineSegmentsHandle, Words]:
        if key not in self._drawn:
            name = f"/nearest/{key[0]} {key[1]}"
            line = self._scene.add_line_segments(
                f"{name}/line",
                NO_LINE,
                palette.each(palette.SECONDARY, NO_LINE),
                thickness=2.0,
                thickness_units="screen",
            )
            label = self._scene.add_label(
                f"{name}/distance", "", font_screen_scale=1.6, anchor="top-center"
            )
            self._drawn[key] = (line, Words(label))
        return self._drawn[key]


def _between(snapshot: Snapshot, pair: PairDistance) -> np.ndarray | None:
    """Where to say that the clearance is unknown: between the bases, over the machines. (2, 3)."""
    ends = []
    for name in (pair.a, pair.b):
        state = snapshot.machines.get(name)
        if state is None or state.body is None:
            return None
        ends.append(state.body.swing_center + np.array([0.0, 0.0, 1.5]))
    return np.array(ends)
