"""What one browser sees that others do not: its own machine's zones, its joint space, its ghost."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from backend.pipeline.records import Snapshot
from backend.spatial.types import Array
from cockpit.views.cameras import JOINTS
from cockpit.views.ghost import GhostNodes
from cockpit.views.inputs import SceneSite, SnapshotSource
from cockpit.views.joint_space import JointSpaceNodes
from cockpit.views.zone import OwnNodes


@dataclass
class Browser:
    """looks: the name of its camera."""

    own: OwnNodes
    joints: JointSpaceNodes
    looks: str
    ghost: GhostNodes | None = None

    def remove(self) -> None:
        """Take out what belongs to the own machine."""
        self.own.remove()
        self.joints.remove()

    def update(
        self, snapshot: Snapshot, images: SnapshotSource, ground: float, lost: float
    ) -> None:
        """ground: its height [m]; lost: seconds without a snapshot."""
        self.own.update(snapshot, images, ground, lost)
        image = images.image("exact", self.own.own)
        self.joints.update(image, snapshot.state_time + lost, self.looks == JOINTS)
        self.update_ghost(snapshot)

    def update_ghost(self, snapshot: Snapshot) -> None:
        if self.ghost is not None:
            self.ghost.update(snapshot.machines.get(self.ghost.machine))

    def show_ghost(
        self, scene: viser.SceneApi, site: SceneSite, machine: str | None, posture: Array | None
    ) -> None:
        """Another posture (n,) of a machine; without a machine, no ghost."""
        if self.ghost is not None and self.ghost.machine != machine:
            self.ghost.remove()
            self.ghost = None
        if machine is None:
            return
        if self.ghost is None:
            self.ghost = GhostNodes(scene, machine, site.machines[machine])
        self.ghost.joints = posture


def browser_of(
    scene: viser.SceneApi, site: SceneSite, own: str, old: Browser | None, looks: str
) -> Browser:
    """A browser's nodes; what `old` showed and keeps when the own machine changes."""
    entry = site.machines[own]
    nodes = OwnNodes(scene, own, 0.8 * entry.model.tracks.length)
    joints = JointSpaceNodes(scene, entry.label)
    if old is None:
        return Browser(nodes, joints, looks)
    nodes.kind = old.own.kind
    return Browser(nodes, joints, old.looks, old.ghost)
