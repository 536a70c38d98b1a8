"""What if: a machine's ghost in another posture, which must not pass for the machine."""

from __future__ import annotations

import numpy as np
import viser

from backend.machine.kinematics import link_poses
from backend.pipeline.records import MachineState
from backend.spatial.rotation import to_quaternion
from backend.spatial.types import Array
from cockpit.views import palette
from cockpit.views.inputs import SceneMachine
from cockpit.views.shapes import feature_edges, link_meshes

OPACITY = 0.35


class GhostNodes:
    """The ghost of one machine. Made once; `pose` moves it along with the machine's base."""

    def __init__(self, scene: viser.SceneApi, machine: str, entry: SceneMachine) -> None:
        self.machine = machine
        self._scene = scene
        self._model = entry.model
        self._root = scene.add_frame("/ghost", show_axes=False, visible=False)
        self._frames: dict[int, viser.FrameHandle] = {}
        self._paint: list[viser.MeshHandle] = []
        for index in range(len(entry.model.links)):
            meshes = link_meshes(entry.model, index)
            if not meshes:
                continue
            name = f"/ghost/{index}"
            self._frames[index] = scene.add_frame(name, show_axes=False)
            for k, (vertices, faces, _) in enumerate(meshes):
                self._paint.append(
                    scene.add_mesh_simple(
                        f"{name}/{k}", vertices, faces, color=palette.TEXT, opacity=OPACITY,
                        flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
                    )
                )  # fmt: skip
            edges = np.concatenate([feature_edges(v, f) for v, f, _ in meshes])
            if len(edges):
                scene.add_line_segments(
                    f"{name}/edges", edges, palette.line(palette.TEXT), thickness=1.5,
                    thickness_units="screen",
                )  # fmt: skip
        self._label = scene.add_label(
            "/ghost/name", f"WHAT IF · {entry.label}", font_screen_scale=1.2, anchor="bottom-center"
        )
        self.joints: Array | None = None

    def remove(self) -> None:
        """Take it out of the browser."""
        self._scene.remove_by_name("/ghost")

    def update(self, state: MachineState | None) -> None:
        """Stand at `joints` on the machine's present base; hidden while it is not placed."""
        body = state.body if state is not None else None
        self._root.visible = body is not None and self.joints is not None
        if body is None or self.joints is None:
            return
        poses = link_poses(self._model, self.joints, body.link_poses[0])
        turns = to_quaternion(poses[list(self._frames), :3, :3])
        for k, wxyz in zip(self._frames, turns, strict=True):
            self._frames[k].wxyz = wxyz
            self._frames[k].position = poses[k, :3, 3]
        x, y, z = body.swing_center
        self._label.position = (float(x), float(y), float(z) + 0.45 * self._model.max_reach)
