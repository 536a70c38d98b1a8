"""A machine as it would be: the same bodies at other joint values, never mistaken for the machine.

It stands on the machine's present base, is translucent with bright edges, and says "WHAT IF".
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import viser

from backend.machine import kinematics
from backend.machine.model import Machine
from backend.pipeline.records import MachineState, Snapshot
from backend.spatial.rotation import to_quaternion
from backend.spatial.types import Array, BoolArray
from cockpit.views import palette
from cockpit.views.inputs import SceneMachine
from cockpit.views.shapes import LinkLooks

OPACITY = 0.42
SAME = 2e-3  # a link this close to the real one is left out [m, -]
STILL = 2e-4  # change of a pose's entries that is worth a message [m, -]
RAISED = 0.3  # the label over the arm [m]
WORDS = {None: "WHAT IF", False: "WHAT IF · free", True: "WHAT IF · CONTACT"}


def checked_joints(model: Machine, joints: Mapping[str, float] | None) -> dict[str, float]:
    """Joint values by role [rad]. Raises ValueError for a role that the machine does not have and
    for what is not a finite number.
    """
    if joints is None:
        raise ValueError("a ghost needs joint values")
    roles = [joint.role for joint in model.joints]
    found = {}
    for role, value in joints.items():
        if role not in roles:
            raise ValueError(f'no joint "{role}"; there are {", ".join(roles)}')
        number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise ValueError(f"joint {role} must be a finite angle")
        found[role] = float(value)
    return found


class GhostNodes:
    """Nodes of one machine's ghost in one browser; kept when hidden, so that it comes at once."""

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        entry: SceneMachine,
        folder: str = "/whatif",
        raised: float = RAISED,
    ) -> None:
        self._name = name
        self._raised = np.array([0.0, 0.0, raised])
        self._model = entry.model
        root = f"{folder}/{name}"
        self._root = scene.add_frame(root, show_axes=False, visible=False)
        self._frames: dict[int, viser.FrameHandle] = {}
        self._meshes: list[viser.MeshHandle] = []
        self._edges: list[viser.LineSegmentsHandle] = []
        for index in range(len(entry.model.links)):
            self._add_link(scene, f"{root}/{index}", index, entry.ghost_looks[index])
        self._label = scene.add_label(
            f"{root}/words", WORDS[None], font_screen_scale=1.4, anchor="bottom-center"
        )
        self._arm = [
            k for k in range(len(self._model.bodies)) if self._model.part_of_body(k) not in BASE
        ]
        self._poses = np.full((len(entry.model.links), 4, 4), np.nan)
        self._joints: Mapping[str, float] | None = None
        self._colliding: bool | None = None

    def _add_link(self, scene: viser.SceneApi, root: str, index: int, looks: LinkLooks) -> None:
        if not looks.meshes:
            return
        self._frames[index] = scene.add_frame(root, show_axes=False)
        for k, (vertices, faces, _) in enumerate(looks.meshes):
            handle = scene.add_mesh_simple(
                f"{root}/{k}",
                vertices,
                faces,
                color=palette.GHOST,
                opacity=OPACITY,
                flat_shading=True,
                side="front",
                cast_shadow=False,
                receive_shadow=False,
            )
            self._meshes.append(handle)
        if len(looks.edges):
            self._edges.append(
                scene.add_line_segments(
                    f"{root}/edges",
                    looks.edges,
                    palette.each(palette.TEXT, looks.edges),
                    thickness=1.6,
                    thickness_units="screen",
                )
            )

    def hide(self) -> None:
        """Take it out of sight."""
        self._joints = None
        self._root.visible = False

    def pose(self, joints: Mapping[str, float], colliding: bool | None) -> None:
        """joints: by role [rad], the others stay as they are; colliding: the verdict on it."""
        self._joints = joints
        if colliding != self._colliding:
            self.paint(colliding)
            self._label.text = WORDS[colliding]

    def paint(self, colliding: bool | None) -> None:
        """In the colour of a verdict."""
        self._colliding = colliding
        for mesh in self._meshes:
            mesh.color = palette.GHOST_HIT if colliding else palette.GHOST
        color = palette.BLOCKED if colliding else palette.TEXT
        for edges in self._edges:
            edges.colors = palette.each(color, edges.points)

    def stand(self, poses: Array, hidden: BoolArray, words: str, colliding: bool) -> None:
        """Of no machine's present state: links at poses (L, 4, 4), but for those hidden (L,)."""
        if colliding != self._colliding:
            self.paint(colliding)
        if self._label.text != words:
            self._label.text = words
        self._put(poses, hidden)
        self._root.visible = True

    def update(self, snapshot: Snapshot) -> None:
        """Follow the machine's present base; out of sight while that was never known."""
        state = snapshot.machines.get(self._name)
        if state is None or state.body is None or self._joints is None:
            self._root.visible = False
            return
        self._move(state, state.body.link_poses)
        self._root.visible = True

    def _move(self, state: MachineState, real: Array) -> None:
        poses = kinematics.link_poses(self._model, self._q(state), self._base(real))
        self._put(poses, np.abs(poses - real).max(axis=(1, 2)) < SAME)

    def _put(self, poses: Array, same: BoolArray) -> None:
        moved = np.abs(poses - self._poses).max(axis=(1, 2))
        for k, frame in self._frames.items():
            frame.visible = not same[k]
            if same[k] or moved[k] < STILL:
                continue
            frame.wxyz = to_quaternion(poses[k, :3, :3])
            frame.position = poses[k, :3, 3]
            self._poses[k] = poses[k]
        corners = kinematics.body_boxes(self._model, poses).corners()[self._arm].reshape(-1, 3)
        above = corners[np.argmax(corners[:, 2])] + self._raised
        if np.abs(above - self._label.position).max() > 5e-4:
            self._label.position = above

    def _q(self, state: MachineState) -> Array:
        q = np.array(state.pose.joints, dtype=float)
        for k, joint in enumerate(self._model.joints):
            q[k] = (self._joints or {}).get(joint.role, q[k])
        return q

    def _base(self, real: Array) -> Array:
        """T_site_root (4, 4) of links placed at `real`; the first of them never turns in it."""
        return np.asarray(real[0] @ np.linalg.inv(self._model.links[0].T_parent_joint))


BASE = ("tracks", "upper")
