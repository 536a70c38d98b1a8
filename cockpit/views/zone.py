"""What one operator sees of the own machine: its base point and its warning zones on the ground.

The zone forbids the base point, so the base is drawn as a cross.
"""

from __future__ import annotations

import numpy as np
import viser

from backend.pipeline.records import Snapshot
from cockpit.views import palette
from cockpit.views.exact_zone import ExactZoneNodes, known
from cockpit.views.inputs import SnapshotSource, ZoneImage
from cockpit.views.shapes import NO_LINE, filled, polyline

OLD = 1.0  # [s] after which an image is no longer coloured
EXACT, SUN = "exact", "sun"
ZONE_KINDS = (EXACT, SUN)
AROUND = {"site": palette.SITE, "people": palette.PEOPLE}
CROSS = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]]], dtype=np.float32)


class OwnNodes:
    """Nodes of one browser, in its own scope of the scene tree."""

    def __init__(self, scene: viser.SceneApi, own: str, size: float) -> None:
        """size: half the length of the cross [m]."""
        self._scene = scene
        self.own = own
        self._cross = scene.add_line_segments(
            "/own/base",
            size * CROSS,
            palette.line(palette.TEXT),
            thickness=3.0,
            thickness_units="screen",
            visible=False,
        )
        self._zones: dict[str, ZoneNodes] = {}
        self._exact: dict[str, ExactZoneNodes] = {}

    def remove(self) -> None:
        """Take all of it out of the browser."""
        self._scene.remove_by_name("/own")

    def update(
        self,
        snapshot: Snapshot,
        images: SnapshotSource,
        ground: float,
        lost: float,
        kind: str = EXACT,
    ) -> None:
        """The zones of all partners of `own`, of people and the site; ground: its height [m];
        lost: as in Scene [s].

        kind: "exact" draws the exact zone of each partner, and Sun's while there is none.
        """
        state = snapshot.machines.get(self.own)
        body = state.body if state is not None else None
        self._cross.visible = body is not None
        if body is not None:
            x, y, _ = body.swing_center
            self._cross.position = (float(x), float(y), ground + 0.03)
        # No images are made of far pairs: an old zone would only look like a warning.
        far = {frozenset((pair.a, pair.b)) for pair in snapshot.pairs if not pair.near}
        now = snapshot.state_time + lost
        for partner in snapshot.machines:
            if partner == self.own:
                continue
            near = frozenset((self.own, partner)) not in far
            key = f"{self.own}<-{partner}"
            exact = images.image("zone", key) if near and kind == EXACT else None
            if not known(exact):
                exact = None
            sun = images.image("sun", key) if near and exact is None else None
            if sun is not None and partner not in self._zones:
                self._zones[partner] = ZoneNodes(self._scene, f"/own/zone/{partner}")
            if exact is not None and partner not in self._exact:
                self._exact[partner] = ExactZoneNodes(self._scene, f"/own/exact/{partner}")
            if partner in self._zones:
                self._zones[partner].update(sun, now, ground)
            if partner in self._exact:
                self._exact[partner].update(exact, now, ground)
        self._around(images, now, ground, kind)

    def _around(self, images: SnapshotSource, now: float, ground: float, kind: str) -> None:
        """Nothing of people while nobody knows where they are: the page says so."""
        for layer, color in AROUND.items():
            zone = images.image("zone", f"{self.own}<-layer:{layer}") if kind == EXACT else None
            if not known(zone):
                zone = None
            node = f"layer:{layer}"
            if zone is not None and node not in self._exact:
                self._exact[node] = ExactZoneNodes(
                    self._scene, f"/own/around/{layer}", color, ("as_is", "any_swing")
                )
            if node in self._exact:
                self._exact[node].update(zone, now, ground)


class ZoneNodes:
    """One zone: filled, with an outline; grey without a fill when old."""

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
        self._edge = scene.add_line_segments(
            f"{name}/edge",
            NO_LINE,
            palette.each(palette.PARTNER, NO_LINE),
            thickness=2.5,
            thickness_units="screen",
            position=(0.0, 0.0, 0.006),
        )
        self._image: ZoneImage | None = None
        self._old = False

    def update(self, image: ZoneImage | None, now: float, ground: float) -> None:
        """now: on the clock of the image's state time [s]."""
        if image is not None and image is not self._image:
            self._draw(np.asarray(image.zone, dtype=float))
        self._image = image
        self._root.visible = image is not None and len(image.zone) >= 3
        if image is None:
            return
        self._root.position = (0.0, 0.0, ground + 0.015)
        old = not now - image.state_time <= OLD
        if old != self._old:
            self._old = old
            self._fill.visible = not old
            self._paint_edge()

    def _draw(self, zone: np.ndarray) -> None:
        vertices, faces = filled(zone)
        if not len(faces):
            self._root.visible = False
            return
        self._fill.vertices = vertices
        self._fill.faces = faces
        outline = polyline(zone, closed=True)
        same = len(outline) == len(self._edge.points)
        self._edge.points = outline
        if not same:
            self._paint_edge()

    def _paint_edge(self) -> None:
        color = palette.STALE if self._old else palette.PARTNER
        self._edge.colors = palette.each(color, self._edge.points)
