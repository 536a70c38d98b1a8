"""One node of lines whose number and colours change."""

from __future__ import annotations

import numpy as np
import viser

from backend.spatial.types import AnyArray
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

    def draw(self, points: Float32, colors: AnyArray) -> None:
        """points: (k, 2, 3), none hides the node; colors: (3,) or (k, 3) uint8, see `ink`."""
        if not len(points):
            if self.node.visible:
                self.node.visible = False
            return
        if not np.array_equal(points, self.node.points):
            self.node.points = points
        inks = np.broadcast_to(colors.reshape(-1, 1, 3), points.shape)
        if not np.array_equal(inks, self.node.colors):
            self.node.colors = inks
        if not self.node.visible:
            self.node.visible = True


def ink(color: palette.Rgb) -> AnyArray:
    """(3,) uint8: what to send for lines that shall show in `color`."""
    return np.array(palette.line(color), dtype=np.uint8)
