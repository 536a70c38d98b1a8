"""One node of lines whose number and colours change."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from cockpit.views import palette
from cockpit.views.shapes import NO_LINE, Float32


class Lines:
    """Made once, and out of sight until there is something to draw."""

    def __init__(self, scene: viser.SceneApi, name: str, pixels: float) -> None:
        self.node = scene.add_line_segments(
            name,
            NO_LINE,
            palette.each(palette.TEXT, NO_LINE),
            thickness=pixels,
            thickness_units="screen",
            visible=False,
        )

    def draw(self, parts: Sequence[Float32], colors: Sequence[palette.Rgb]) -> None:
        """parts: lines (k, 2, 3) that have one colour each; none hides the node."""
        points = np.concatenate([NO_LINE[:0], *parts])
        if not len(points):
            if self.node.visible:
                self.node.visible = False
            return
        inks = np.concatenate([palette.each(c, p) for c, p in zip(colors, parts, strict=True)])
        if not np.array_equal(points, self.node.points):
            self.node.points = points
        if not np.array_equal(inks, self.node.colors):
            self.node.colors = inks
        if not self.node.visible:
            self.node.visible = True
