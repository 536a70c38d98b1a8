"""One machine: its links, its name, its end-point and its workspace on the ground."""

from __future__ import annotations

import math

import numpy as np
import viser

from backend.fusion.pose import Validity
from backend.pipeline.records import Body3D, MachineState
from backend.safety.record import Level
from backend.spatial.rotation import to_quaternion
from backend.spatial.types import Array
from cockpit.views import palette
from cockpit.views.inputs import SceneMachine
from cockpit.views.labels import Words, name_text, oldest
from cockpit.views.shapes import circle

STILL = 2e-4  # change of a pose's entries that is worth a message [m, -]
GHOST = 0.5  # opacity of a stale machine
DROP = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]], dtype=np.float32)


class MachineNodes:
    """Nodes are made here; `update` only moves and recolours what changed."""

    def __init__(
        self, scene: viser.SceneApi, name: str, entry: SceneMachine, tint: palette.Rgb
    ) -> None:
        self._entry = entry
        root = f"/machines/{name}"
        self._root = scene.add_frame(root, show_axes=False, visible=False)
        self._frames: dict[int, viser.FrameHandle] = {}
        self._paint: list[tuple[viser.MeshHandle, palette.Rgb]] = []
        visuals = [visual for link in entry.model.links for visual in link.visuals]
        self._one_color = len({visual.color for visual in visuals}) <= 1
        for index in range(len(entry.model.links)):
            self._add_link(scene, f"{root}/{index}", index, tint)
        self._poses = np.full((len(entry.model.links), 4, 4), np.nan)
        self._tip = scene.add_icosphere(
            f"{root}/tip",
            radius=0.012 * entry.model.max_reach,
            color=palette.TEXT,
            subdivisions=2,
            cast_shadow=False,
        )
        self._drop = _lines(scene, f"{root}/drop", DROP, palette.SECONDARY, 1.0)
        self._reach_now = _lines(scene, f"{root}/now", circle(), palette.REACH_NOW, 1.6)
        self._reach_max = _lines(
            scene, f"{root}/max", circle(144, dashed=True), palette.REACH_MAX, 1.6
        )
        self._reach_max.scale = entry.model.max_reach
        self._name = Words(
            scene.add_label(
                f"{root}/name", entry.label, font_screen_scale=1.4, anchor="bottom-center"
            )
        )
        self._name_height: float | None = None
        self._coloured = False, False  # whether as a ghost, whether in red

    def _add_link(self, scene: viser.SceneApi, root: str, index: int, tint: palette.Rgb) -> None:
        meshes, edges = self._entry.looks[index].meshes, self._entry.looks[index].edges
        if self._one_color:
            meshes = [(vertices, faces, None) for vertices, faces, _ in meshes]
        if not meshes:
            return
        self._frames[index] = scene.add_frame(root, show_axes=False)
        for k, (vertices, faces, own_color) in enumerate(meshes):
            color = palette.tint(own_color or self._plain(index), tint)
            handle = scene.add_mesh_simple(
                f"{root}/{k}",
                vertices,
                faces,
                color=color,
                flat_shading=True,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            self._paint.append((handle, color))
        if len(edges):
            _lines(scene, f"{root}/edges", edges, palette.EDGE, 1.2)

    def _plain(self, link: int) -> palette.Rgb:
        """The colour of a link in a machine described without colours, or with a single one."""
        dark = self._entry.model.links[link].part in ("tracks", "bucket")
        return palette.IRON if dark else palette.PAINT

    def update(
        self, state: MachineState, ground: float, now: float, lost: float, tips: bool = False
    ) -> None:
        """lost: seconds for which no snapshot came, 0 while they do; ground: its height [m]; tips:
        whether an edge of its support bears everything, as in Yamashita's figures in red.
        """
        body, validity = state.body, state.pose.validity
        if lost > 0.0:
            validity = Validity.STALE
        self._root.visible = body is not None
        if body is None:
            self._name.hide()
            return
        self._move(body)
        self._draw_reach(body, ground)
        valid = validity is Validity.VALID
        self._colour(ghostly=not valid, tips=valid and tips)
        age = oldest(state.pose) + lost
        words = name_text(self._entry.label, validity, age)
        if valid and tips:
            words = f"{words} · TIPS OVER"
        self._name.show(words, (validity, valid and tips), now)

    def _move(self, body: Body3D) -> None:
        change = np.abs(body.link_poses - self._poses).max(axis=(1, 2))
        moved = [k for k in self._frames if not change[k] < STILL]
        if not moved:
            return
        quaternions = to_quaternion(body.link_poses[moved][:, :3, :3])
        for k, wxyz in zip(moved, quaternions, strict=True):
            self._frames[k].wxyz = wxyz
            self._frames[k].position = body.link_poses[k, :3, 3]
        self._poses[moved] = body.link_poses[moved]

    def _draw_reach(self, body: Body3D, ground: float) -> None:
        center = (float(body.swing_center[0]), float(body.swing_center[1]), ground + 0.03)
        _place(self._reach_max, center)
        _place(self._reach_now, center)
        if not math.isclose(_scale(self._reach_now), body.reach, abs_tol=0.005):
            self._reach_now.scale = float(body.reach)
        _place(self._tip, body.end_point)
        _place(self._drop, body.end_point)
        fall = max(float(body.end_point[2]) - ground, 1e-3)
        if not math.isclose(_scale(self._drop), fall, abs_tol=0.005):
            self._drop.scale = fall
        if self._name_height is None:
            upper = [k for k in range(len(body.boxes)) if self._part(k) in ("upper", "tracks")]
            corners = body.boxes.corners()[upper or slice(None)]
            top = float(corners[..., 2].max())
            self._name_height = top - float(body.swing_center[2]) + 0.25
        x, y, z = body.swing_center
        _place(self._name.label, (float(x), float(y), float(z) + self._name_height))

    def _part(self, body: int) -> str:
        return self._entry.model.part_of_body(body)

    def _colour(self, ghostly: bool, tips: bool) -> None:
        if (ghostly, tips) == self._coloured:
            return
        self._coloured = ghostly, tips
        red = palette.LEVEL[Level.STOP]
        for handle, color in self._paint:
            handle.color = palette.STALE if ghostly else red if tips else color
            handle.opacity = GHOST if ghostly else None
        self._tip.visible = self._drop.visible = self._reach_now.visible = not ghostly


def _lines(
    scene: viser.SceneApi, name: str, lines: np.ndarray, color: palette.Rgb, pixels: float
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(
        name, lines, palette.line(color), thickness=pixels, thickness_units="screen"
    )


def _scale(node: viser.LineSegmentsHandle) -> float:
    return float(node.scale) if isinstance(node.scale, float | int) else float(node.scale[0])


def _place(node: viser.SceneNodeHandle, p_site: Array | tuple[float, float, float]) -> None:
    """Move a node if the change can be seen (0.5 mm)."""
    x, y, z = node.position
    if max(abs(x - p_site[0]), abs(y - p_site[1]), abs(z - p_site[2])) > 5e-4:
        node.position = (float(p_site[0]), float(p_site[1]), float(p_site[2]))
