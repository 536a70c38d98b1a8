"""The exact warning zone of one partner, people or the site on the ground: where the own base would
mean contact.

Filled with a solid outline: as the machine is now. Dashed: swinging freely. Dotted: in any posture.
"""

from __future__ import annotations

import numpy as np
import viser
from shapely.geometry.base import BaseGeometry

from cockpit.views import palette
from cockpit.views.inputs import ExactZoneImage
from cockpit.views.shapes import NO_LINE, Float32, dashed, filled_geometry, polyline, rings

OLD = 2.0  # [s] after which a zone is no longer coloured: it is made about once a second
DRAWN = 0.005  # how far the drawing may be from the zone [m]
AS_IS = "as_is"
# Per variant: lengths of dashes and gaps [m] (None: solid), width [px].
LINES: dict[str, tuple[tuple[float, float] | None, float]] = {
    AS_IS: (None, 2.5),
    "any_swing": ((0.40, 0.25), 2.2),
    "any_posture": ((0.07, 0.20), 2.6),
}


def known(image: ExactZoneImage | None) -> bool:
    """Whether an image tells where the machine must not go as it is now."""
    return image is not None and image.zones.get(AS_IS) is not None


def outline(geometry: BaseGeometry | None, dash: tuple[float, float] | None) -> Float32:
    """Every ring of a geometry as lines (k, 2, 3) [m]. dash: lengths of dash and gap, or None."""
    lines = [
        polyline(ring, closed=True) if dash is None else dashed(ring, *dash)
        for ring in rings(geometry)
    ]
    return np.concatenate([np.zeros((0, 2, 3), dtype=np.float32), *lines])


class ExactZoneNodes:
    """The variants of one zone; grey without a fill when old."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        color: palette.Rgb = palette.PARTNER,
        variants: tuple[str, ...] = tuple(LINES),
    ) -> None:
        self._color = color
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._fill = scene.add_mesh_simple(
            f"{name}/fill",
            np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]], dtype=np.float32),
            np.array([[0, 1, 2]], dtype=np.uint32),
            color=color,
            opacity=0.30,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._lines = {
            variant: scene.add_line_segments(
                f"{name}/{variant}",
                NO_LINE,
                palette.each(color, NO_LINE),
                thickness=width,
                thickness_units="screen",
                position=(0.0, 0.0, 0.006),
                visible=False,
            )
            for variant, (_, width) in LINES.items()
            if variant in variants
        }
        self._image: ExactZoneImage | None = None
        self._old = False
        self._area = False

    def update(self, image: ExactZoneImage | None, now: float, ground: float) -> None:
        """now: on the clock of the image's state time [s]; ground: its height [m]."""
        self._root.visible = image is not None
        if image is None:
            return
        old = not now - image.state_time <= OLD
        if image is not self._image or old != self._old:
            if image is not self._image:
                self._draw(image)
            self._old, self._image = old, image
            self._paint()
        self._root.position = (0.0, 0.0, ground + 0.015)

    def _draw(self, image: ExactZoneImage) -> None:
        drawn = {}
        for variant in self._lines:
            geometry = image.zones.get(variant)
            drawn[variant] = None if geometry is None else geometry.simplify(DRAWN)
        zone = drawn[AS_IS]
        self._area = zone is not None and zone.area > 0.0
        if zone is not None and self._area:
            self._fill.vertices, self._fill.faces = filled_geometry(zone)
        for variant, node in self._lines.items():
            points = outline(drawn[variant], LINES[variant][0])
            node.visible = len(points) > 0
            if len(points):
                node.points = points

    def _paint(self) -> None:
        self._fill.visible = self._area and not self._old
        color = palette.STALE if self._old else self._color
        for node in self._lines.values():
            colors = palette.each(color, node.points)
            if not np.array_equal(node.colors, colors):
                node.colors = colors
