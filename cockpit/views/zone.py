"""What one operator sees of the own machine: its base point and its warning zones on the ground.

A zone forbids the base point, so the base is drawn as a cross. Zones are exact (as it is: filled
and solid; swinging freely: dashed; in any posture: dotted) or Sun's.
"""

from __future__ import annotations

import numpy as np
import viser

from backend.pipeline.images import PairImage
from backend.pipeline.records import Snapshot
from backend.pipeline.zones import ZoneImage
from cockpit.views import palette
from cockpit.views.inputs import SnapshotSource
from cockpit.views.shapes import Float32, filled, filled_area, outline, polyline

OLD = {"sun": 1.0, "zone": 2.0}
"""Seconds after which an image is no longer coloured; exact zones are made less often."""

KINDS = ("exact", "sun")
DASHES = {"as_is": 0.0, "any_swing": 0.35, "any_posture": 0.08}  # [m]
CROSS = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]]], dtype=np.float32)


class OwnNodes:
    """Nodes of one browser, in its own scope of the scene tree."""

    def __init__(self, scene: viser.SceneApi, own: str, size: float) -> None:
        """size: half the length of the cross [m]."""
        self._scene = scene
        self.own = own
        self.kind = "exact"
        self._cross = scene.add_line_segments(
            "/own/base",
            size * CROSS,
            palette.line(palette.TEXT),
            thickness=3.0,
            thickness_units="screen",
            visible=False,
        )
        self._zones: dict[str, ZoneNodes] = {}

    def remove(self) -> None:
        """Take all of it out of the browser."""
        self._scene.remove_by_name("/own")

    def update(
        self, snapshot: Snapshot, images: SnapshotSource, ground: float, lost: float
    ) -> None:
        """The zones of all partners of `own`; ground: its height [m]; lost: as in Scene [s]."""
        state = snapshot.machines.get(self.own)
        body = state.body if state is not None else None
        self._cross.visible = body is not None
        if body is not None:
            x, y, _ = body.swing_center
            self._cross.position = (float(x), float(y), ground + 0.03)
        # No images are made of far pairs: an old zone would only look like a warning.
        far = {frozenset((pair.a, pair.b)) for pair in snapshot.pairs if not pair.near}
        for partner in snapshot.machines:
            image: PairImage | ZoneImage | None = None
            if partner != self.own and frozenset((self.own, partner)) not in far:
                key = f"{self.own}<-{partner}"
                image = images.image("zone", key) if self.kind == "exact" else None
                image = image if image is not None else images.image("sun", key)
            if image is not None and partner not in self._zones:
                self._zones[partner] = ZoneNodes(self._scene, f"/own/zone/{partner}")
            if partner in self._zones:
                self._zones[partner].update(image, snapshot.state_time + lost, ground)


class ZoneNodes:
    """One partner's zones: filled, with outlines; grey without a fill when old."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        triangle = np.array([[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]], dtype=np.float32)
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._fill = scene.add_mesh_simple(
            f"{name}/fill",
            triangle,
            np.array([[0, 1, 2]], dtype=np.uint32),
            color=palette.PARTNER,
            opacity=0.30,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._edges = {
            variant: scene.add_line_segments(
                f"{name}/{'edge' if variant == 'as_is' else variant}",
                np.zeros((1, 2, 3), dtype=np.float32),
                palette.line(palette.PARTNER),
                thickness=2.5 if variant == "as_is" else 1.8,
                thickness_units="screen",
                position=(0.0, 0.0, 0.006),
                visible=False,
            )
            for variant in DASHES
        }
        self._image: PairImage | ZoneImage | None = None
        self._old = self._empty = False

    def update(self, image: PairImage | ZoneImage | None, now: float, ground: float) -> None:
        """now: on the clock of the image's state time [s]."""
        if image is not None and image is not self._image:
            self._draw(image)
        self._image = image
        self._root.visible = image is not None and not self._empty
        if image is None:
            return
        self._root.position = (0.0, 0.0, ground + 0.015)
        old = not now - image.state_time <= OLD["zone" if isinstance(image, ZoneImage) else "sun"]
        if old != self._old:
            self._old = old
            self._fill.visible = not old
            for node in self._edges.values():
                self._paint(node)

    def _draw(self, image: PairImage | ZoneImage) -> None:
        lines: dict[str, Float32] = {}
        if isinstance(image, ZoneImage):
            vertices, faces = filled_area(image.zones["as_is"])
            lines = {name: outline(image.zones[name], dash) for name, dash in DASHES.items()}
        else:
            zone = np.asarray(image.zone, dtype=float)
            vertices, faces = filled(zone)
            if len(faces):
                lines = {"as_is": polyline(zone, closed=True)}
        self._empty = not any(len(line) for line in lines.values())
        if len(faces):
            self._fill.vertices, self._fill.faces = vertices, faces
        self._fill.visible = len(faces) > 0 and not self._old
        for name, node in self._edges.items():
            points = lines.get(name)
            node.visible = points is not None and len(points) > 0
            if points is None or not len(points):
                continue
            same = len(points) == len(node.points)
            node.points = points
            if not same:
                self._paint(node)

    def _paint(self, node: viser.LineSegmentsHandle) -> None:
        color = palette.STALE if self._old else palette.PARTNER
        shape = (len(node.points), 2, 3)
        node.colors = np.broadcast_to(np.uint8(palette.line(color)), shape)
