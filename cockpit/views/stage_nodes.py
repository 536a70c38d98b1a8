"""The newest scan in one browser, coloured by what detection made of each point.

Each stage has a shape of its own besides its colour, and can be shown alone.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import viser

from backend.perception.stages import GROUND, NAMES, OBJECT, StagedScan
from backend.tracking.records import Status
from cockpit.views import palette, stage_shapes
from cockpit.views.lines import Lines, ink
from cockpit.views.people_shapes import box_lines
from cockpit.views.shapes import NO_LINE

PLANE, BOXES = "plane", "boxes"
SHOWN = (*NAMES, PLANE, BOXES)
"""All that can be shown."""
MOVED = 8.0
"""So far the scan may be from where points are counted from: they are sent as float16 [m]."""
SIZE = 0.07  # of a point [m]
LOOKS: tuple[tuple[palette.Rgb, Literal["circle", "diamond", "square", "sparkle"], float], ...] = (
    (palette.OUTSIDE, "circle", 0.6),
    (palette.SELF, "diamond", 1.3),
    (palette.EARTH, "circle", 0.8),
    (palette.PEOPLE, "square", 1.2),
    (palette.TEXT, "sparkle", 1.8),
)
"""Colour, shape and size, as a share of SIZE, by code; objects have colours of their own."""
COLORS = stage_shapes.cluster_colors()
INKS = np.array([ink((int(r), int(g), int(b))) for r, g, b in COLORS], dtype=np.uint8)
GRID = ink(palette.EARTH)
NO_BOX = np.zeros((0, 12, 2, 3), dtype=np.float32)


class StageNodes:
    """Made when somebody looks for the first time; kept out of sight when nobody does."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._root = scene.add_frame("/stages", show_axes=False, visible=False)
        self._clouds = [
            scene.add_point_cloud(
                f"/stages/{name}",
                np.zeros((1, 3)),
                color,
                point_size=share * SIZE,
                point_shape=shape,
                point_shading="flat",
                visible=False,
            )
            for name, (color, shape, share) in zip(NAMES, LOOKS, strict=True)
        ]
        self._plane = Lines(scene, "/stages/plane", 1.0)
        self._boxes = Lines(scene, "/stages/boxes", 1.4)
        self._origin = np.full(3, np.nan)
        self._drawn: StagedScan | None = None
        self._shown: frozenset[str] = frozenset()
        self._centers, self._hues = np.zeros((0, 3)), np.zeros(0, np.int64)

    def update(self, stages: StagedScan | None, shown: frozenset[str]) -> None:
        """stages: None hides all; shown: of SHOWN. Nothing is sent for the same ones again."""
        if stages is None:
            if self._root.visible:
                self._root.visible = False
            return
        if stages is not self._drawn or shown != self._shown:
            if stages is not self._drawn:
                before, self._centers = self._centers, stages.objects.center
                self._hues = stage_shapes.hues(self._centers, before, self._hues)
            self._draw(stages, shown)
            self._drawn, self._shown = stages, shown
        if not self._root.visible:
            self._root.visible = True

    def _draw(self, stages: StagedScan, shown: frozenset[str]) -> None:
        """Only what is shown is sent."""
        middle = np.round(stages.points.mean(axis=0)) if len(stages.points) else np.zeros(3)
        if not np.abs(middle - self._origin).max() <= MOVED:  # also before the first
            self._origin = middle
            self._root.position = middle
        points = stages.points - self._origin.astype(np.float32)
        for k, name in enumerate(NAMES):
            of, cloud = stages.stage == k, self._clouds[k]
            visible = name in shown and bool(of.any())
            if visible:
                cloud.points = points[of].astype(np.float16)
                if k == OBJECT:
                    cloud.colors = COLORS[self._hues[stages.cluster[of]]]
            if cloud.visible != visible:
                cloud.visible = visible
        offset = self._origin.astype(np.float32)
        ground = stages.points[stages.stage == GROUND]
        plane = stages.plane if PLANE in shown else None
        lines = NO_LINE[:0] if plane is None else stage_shapes.patch(plane, ground)
        self._plane.draw(lines - offset, GRID)
        boxed = BOXES in shown and len(stages.objects.yaw)
        boxes = box_lines(*stages.objects[:3], Status.CONFIRMED) if boxed else NO_BOX
        inks = np.repeat(INKS[self._hues[: len(boxes)]], boxes.shape[1], axis=0)
        self._boxes.draw(boxes.reshape(-1, 2, 3) - offset, inks)
