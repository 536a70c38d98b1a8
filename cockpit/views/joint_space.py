"""What one operator sees of the own machine's joint space: all that is blocked at this swing.

The cells are a slice through the present swing, as boom x stick x bucket; they stand in a place of
their own, far below the site, where only the camera "joints" looks.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser

from backend.pipeline.exact import OwnImage
from cockpit.views import palette
from cockpit.views.joint_frame import PLACE, SIDE, SIZE, draw_frame, place
from cockpit.views.joint_marks import full_box, plumb_lines, stop_bars
from cockpit.views.labels import Words
from cockpit.views.shapes import NO_LINE, Float32, UInt32
from cockpit.views.surface import NAMES, UNDECIDED, surfaces

OLD = 1.0  # [s] after which an image is no longer coloured
PERIOD = 0.2  # [s] between changes of the surfaces: each one sends them again

COLORS = {
    "people": palette.PEOPLE,
    "partner": palette.PARTNER,
    "tip-over": palette.TIP_OVER,
    "site": palette.SITE,
    "self": palette.SELF,
    "other": palette.TEXT,
    UNDECIDED: palette.UNDECIDED,
}
BODY, BODY_OLD = 0.70, 0.45  # opacity of the colliding cells: the star shows through them
SHELL = 0.20  # of the undecided cells
TITLE = (0.5 * SIDE, 0.5 * SIDE, SIDE + 0.7)  # where the words stand [m]
STAR = 0.085  # radius [m]
Meshes = dict[str, tuple[Float32, UInt32]]


class JointSpace:
    """Nodes of one browser, in its own scope; made at the first look, then only changed."""

    def __init__(self, scene: viser.SceneApi, label: str) -> None:
        """label: the own machine's, as operators call it."""
        self._scene = scene
        self._label = label
        self._root = scene.add_frame("/joints", show_axes=False, position=PLACE, visible=False)
        self._cells = scene.add_frame("/joints/cells", show_axes=False, visible=False)
        self._meshes = {name: _mesh(scene, name) for name in NAMES}
        self._legend_root = scene.add_frame("/joints/cells/legend", show_axes=False)
        self._legend = [_legend(scene, name, k) for k, name in enumerate(NAMES)]
        self._star = scene.add_icosphere(
            "/joints/cells/star", STAR, (255, 255, 255), subdivisions=3, cast_shadow=False
        )
        self._outline = scene.add_icosphere(
            "/joints/cells/star/outline", 1.35 * STAR, (0, 0, 0), side="back", cast_shadow=False
        )
        # Words are never hidden by cells: they tell where the star is behind them.
        scene.add_label(
            "/joints/cells/star/name",
            label,
            position=(0.0, 0.0, 2.4 * STAR),
            font_screen_scale=0.9,
            anchor="bottom-center",
        )
        self._plumb = _lines(scene, "plumb", 1.2, palette.SECONDARY)
        self._bars = _lines(scene, "now", 4.5, palette.TEXT)
        self._full = _lines(scene, "full", 1.4, palette.TEXT)
        self._title = Words(
            scene.add_label(
                "/joints/title", "", position=TITLE, font_screen_scale=1.7, anchor="bottom-center"
            )
        )
        self._image: OwnImage | None = None
        self._edges: np.ndarray | None = None
        self._meshed: np.ndarray | None = None  # the volume that the surfaces show
        self._meshed_at = -math.inf
        self._old = False

    def remove(self) -> None:
        """Take all of it out of the browser."""
        self._scene.remove_by_name("/joints")

    def update(self, image: OwnImage | None, state_now: float, now: float, looked_at: bool) -> None:
        """state_now: on the clock of the image's state time; now: a monotonic clock [s]."""
        self._root.visible = looked_at
        if not looked_at:
            return
        self._cells.visible = image is not None
        if image is None:
            self._title.show(f"{self._label} · no joint image yet", None, now)
            return
        age = state_now - image.state_time
        old = not age <= OLD
        if image is not self._image or old != self._old:
            self._mark(image, old)
        if image.volume is not self._meshed and (now - self._meshed_at >= PERIOD):
            self._draw_cells(image, now)
        if old != self._old:
            self._old = old
            self._paint()
        self._image = image
        swing = math.degrees(math.remainder(float(image.q[0]), math.tau))
        self._title.show(title(self._label, swing, age, old), old, now)

    def _draw_cells(self, image: OwnImage, now: float) -> None:
        if self._edges is None or not np.allclose(self._edges, image.volume_edges, atol=1e-6):
            self._edges = image.volume_edges
            self._scene.remove_by_name("/joints/cells/frame")
            draw_frame(self._scene, "/joints/cells/frame", self._edges)
        if self._meshed is None or not np.array_equal(self._meshed, image.volume):
            self._send(surfaces(image.volume, SIZE))
            self._meshed_at = now
        self._meshed = image.volume

    def _send(self, meshes: Meshes) -> None:
        row = 0
        for (name, (vertices, faces)), entry in zip(meshes.items(), self._legend, strict=True):
            node = self._meshes[name]
            node.visible = entry.visible = len(faces) > 0
            if len(faces):
                node.vertices, node.faces = vertices, faces
                entry.position = legend_place(row)
                row += 1

    def _mark(self, image: OwnImage, old: bool) -> None:
        q, stopping, edges = image.q[1:4], image.stopping[1:4], image.volume_edges
        here = place(q, edges)
        if not np.allclose(self._star.position, here, atol=1e-3):
            self._star.position = here
            _draw(self._plumb, plumb_lines(here), palette.SECONDARY)
        points, colors = stop_bars(image.volume, edges, q, stopping[:, 0], old)
        self._bars.visible = len(points) > 0
        if len(points):
            _draw(self._bars, points, colors)
        _draw(self._full, full_box(edges, q, stopping[:, 1]), palette.TEXT)

    def _paint(self) -> None:
        for name, node in self._meshes.items():
            node.color = palette.STALE if self._old else COLORS[name]
            if name != UNDECIDED:
                node.opacity = BODY_OLD if self._old else BODY
        self._legend_root.visible = not self._old  # it would explain colours that are not there
        self._star.color = palette.STALE if self._old else (255, 255, 255)


def title(label: str, swing: float, age: float, old: bool) -> str:
    """What the picture shows: whose joints, at which swing [deg], how old [s]."""
    seconds = f"{max(age, 0.0):.1f} s" if math.isfinite(age) else ""
    return f"{label} at swing {swing:.0f}° · {'STALE ' if old else ''}{seconds}".rstrip()


def _mesh(scene: viser.SceneApi, name: str) -> viser.MeshHandle:
    shell = name == UNDECIDED
    return scene.add_mesh_simple(
        f"/joints/cells/{name}",
        np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]], dtype=np.float32),
        np.array([[0, 1, 2]], dtype=np.uint32),
        color=COLORS[name],
        opacity=SHELL if shell else BODY,
        side="double" if shell else "front",
        flat_shading=True,
        cast_shadow=False,
        receive_shadow=False,
        visible=False,
    )


def _legend(scene: viser.SceneApi, name: str, row: int) -> viser.FrameHandle:
    root = f"/joints/cells/legend/{name}"
    entry = scene.add_frame(root, show_axes=False, position=legend_place(row), visible=False)
    scene.add_icosphere(f"{root}/sample", 0.11, COLORS[name], subdivisions=2, cast_shadow=False)
    scene.add_label(
        f"{root}/name",
        name,
        position=(0.18, 0.12, 0.0),
        font_screen_scale=1.2,
        anchor="center-left",
    )
    return entry


def legend_place(row: int) -> tuple[float, float, float]:
    """Right of the box, from above."""
    return SIDE + 0.55, SIDE + 0.25, SIDE - 0.3 - 0.42 * row


def _lines(
    scene: viser.SceneApi, name: str, pixels: float, color: palette.Rgb
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(
        f"/joints/cells/{name}",
        NO_LINE,
        palette.each(color, NO_LINE),
        thickness=pixels,
        thickness_units="screen",
    )


def _draw(node: viser.LineSegmentsHandle, points: Float32, colors: Any) -> None:
    """New lines; colors: uint8 (k, 2, 3), or one colour."""
    node.points = points
    if not isinstance(colors, np.ndarray):
        colors = palette.each(colors, points)
    if not np.array_equal(node.colors, colors):
        node.colors = colors
