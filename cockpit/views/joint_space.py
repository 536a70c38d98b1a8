"""Joint space in 3D: what boom, stick and bucket would hit at the present swing, and the arm now.

It stands high above the site, where no other camera looks, each joint's range drawn as SIZE metres.
"""

from __future__ import annotations

import math

import numpy as np
import viser

from backend.cspace.cells import COLLIDING, FREE, PARTNER, SELF, SITE
from backend.pipeline.exact import ARM, OwnImage
from backend.spatial.types import Array
from cockpit.views import palette
from cockpit.views.cell_surface import exposed_faces, layer_masks
from cockpit.views.shapes import Float32

SIZE = 4.0  # [m] of each axis
ORIGIN = (0.0, 0.0, 400.0)
PERIOD = 0.4  # [s] at least between two surfaces: each is some 100 kB
OLD = 1.0  # [s] after which the image counts as stale
LAYERS = ((PARTNER, palette.PARTNER), (SITE, palette.SITE), (SELF, palette.SELF))
HITS = PARTNER | SITE | SELF
_EDGES = np.array(
    [[a, b] for a in np.ndindex(2, 2, 2) for b in np.ndindex(2, 2, 2) if sum(b) - sum(a) == 1
     and all(y >= x for x, y in zip(a, b, strict=True))],
    dtype=np.float32,
)  # fmt: skip


class JointSpaceNodes:
    """Nodes of one browser. Made once; `update` sets what changed while the view is `shown`."""

    def __init__(self, scene: viser.SceneApi, label: str) -> None:
        """label: the own machine's, as operators call it."""
        self._label = label
        self._root = scene.add_frame("/joints", show_axes=False, position=ORIGIN, visible=False)
        self._scene = scene
        triangle = np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32)
        self._surfaces = [
            scene.add_mesh_simple(
                f"/joints/{name}", *triangle, color=color, opacity=opacity, flat_shading=True,
                side="double", cast_shadow=False, receive_shadow=False, visible=False,
            )
            for name, color, opacity in (
                *((f"layer{bit}", color, None) for bit, color in LAYERS),
                ("undecided", palette.STALE, 0.18),
            )
        ]  # fmt: skip
        self._box = _lines(scene, "box", SIZE * _EDGES, palette.GRID_MAJOR, 1.5)
        self._walls = _lines(scene, "walls", np.zeros((3, 2, 3), np.float32), palette.TEXT, 1.0)
        self._stops = [
            _lines(scene, name, np.zeros((3, 2, 3), np.float32), color, pixels)
            for name, color, pixels in (
                ("stop-now", palette.TEXT, 5.0), ("stop-full", palette.SECONDARY, 2.0)
            )
        ]  # fmt: skip
        self._star = scene.add_icosphere(
            "/joints/star", radius=0.09, color=palette.TEXT, subdivisions=2, cast_shadow=False
        )
        self._title = scene.add_label(
            "/joints/title", label, font_screen_scale=1.3, anchor="bottom-center",
            position=(SIZE / 2, SIZE / 2, SIZE + 0.5),
        )  # fmt: skip
        self._ticks = _axis_labels(scene)
        self._volume: Array | None = None
        self._stale = False
        self._drawn = -math.inf
        self._limits: Array | None = None

    def remove(self) -> None:
        """Take all of it out of the browser."""
        self._scene.remove_by_name("/joints")

    def update(self, image: OwnImage | None, now: float, shown: bool) -> None:
        """now: on the clock of the image's state time [s]; shown: this browser looks at it."""
        self._root.visible = shown
        if not shown:
            return
        if image is None:
            self._title.text = f"{self._label} · no image yet"
            return
        age = now - image.state_time
        stale = not age <= OLD
        swing = math.degrees(float(image.q[0]))
        mark = "STALE" if stale else "slice"
        words = f"{self._label} at swing {swing:.0f}° · {mark} {max(age, 0.0):.1f} s old"
        if self._title.text != words:
            self._title.text = words
        if now - self._drawn >= PERIOD or now < self._drawn:
            self._drawn = now
            self._draw_surfaces(image, stale)
            self._draw_ticks(image.volume_edges)
        self._draw_state(image)

    def _draw_surfaces(self, image: OwnImage, stale: bool) -> None:
        cells = image.volume
        if stale != self._stale:
            self._stale = stale
            for node, (_, color) in zip(self._surfaces, LAYERS, strict=False):
                node.color = palette.STALE if stale else color
        if self._volume is not None and np.array_equal(cells, self._volume):
            return
        self._volume = cells
        hits = (cells & HITS) != 0
        undecided = (cells & (FREE | COLLIDING | HITS)) == 0
        masks = [*layer_masks(cells, tuple(bit for bit, _ in LAYERS)), undecided]
        scale = SIZE / np.array(cells.shape, dtype=np.float32)
        for k, (node, mask) in enumerate(zip(self._surfaces, masks, strict=True)):
            vertices, faces = exposed_faces(mask, hits if k < len(LAYERS) else hits | mask)
            node.visible = len(faces) > 0
            if len(faces):
                node.vertices, node.faces = vertices * scale, faces

    def _draw_state(self, image: OwnImage) -> None:
        low, high = image.volume_edges[:, 0], image.volume_edges[:, 1]
        scale = SIZE / (high - low)
        here = (image.q[1:4] - low) * scale
        self._star.position = tuple(float(v) for v in here)
        walls = np.repeat(here[None, None], 2, axis=1).repeat(3, axis=0)
        walls[np.arange(3), 1, np.arange(3)] = 0.0
        self._walls.points = walls.astype(np.float32)
        now = np.zeros((3, 2, 3)) + here
        now[np.arange(3), 1, np.arange(3)] += image.stopping[1:4, 0] * scale
        self._stops[0].points = now.astype(np.float32)
        full = np.zeros((3, 2, 3)) + here
        reach = image.stopping[1:4, 1] * scale
        full[np.arange(3), 0, np.arange(3)] -= reach
        full[np.arange(3), 1, np.arange(3)] += reach
        self._stops[1].points = np.clip(full, 0.0, SIZE).astype(np.float32)

    def _draw_ticks(self, edges: Array) -> None:
        if self._limits is not None and np.array_equal(edges, self._limits):
            return
        self._limits = edges
        for k, (low, name, high) in enumerate(self._ticks):
            low.text = f"{math.degrees(edges[k, 0]):.0f}°"
            high.text = f"{math.degrees(edges[k, 1]):.0f}°"
            name.text = f"{ARM[k + 1]} °"


def _axis_labels(scene: viser.SceneApi) -> list[tuple[viser.LabelHandle, ...]]:
    """(lower limit, name, upper limit) along each axis of the box."""
    labels = []
    for k in range(3):
        row = []
        for share in (0.0, 0.5, 1.0):
            at = np.full(3, -0.25)
            at[k] = share * SIZE
            row.append(
                scene.add_label(
                    f"/joints/axis{k}/{share}", ARM[k + 1], anchor="center-center", position=at
                )
            )
        labels.append(tuple(row))
    return labels


def _lines(
    scene: viser.SceneApi, name: str, points: Float32, color: palette.Rgb, pixels: float
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(
        f"/joints/{name}", points, palette.line(color), thickness=pixels, thickness_units="screen"
    )
