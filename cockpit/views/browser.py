"""What one browser shows of its own: own machine, joint space, ghost, stages; and its camera."""

from __future__ import annotations

import math
from collections.abc import Mapping

import viser

from backend.perception.stages import StagedScan
from backend.pipeline.records import Snapshot
from cockpit.views.cameras import CameraPose
from cockpit.views.ghost import GhostNodes
from cockpit.views.inputs import SceneSite, SnapshotSource
from cockpit.views.joint_space import JointSpace
from cockpit.views.stage_nodes import StageNodes
from cockpit.views.use_case_nodes import Shown, UseCaseNodes
from cockpit.views.zone import OwnNodes

JOINTS = "joints"  # the camera that looks at the joint space


class Browser:
    """Nodes in one client's scope. Nothing that is not looked at is made or kept current.

    following: the pose of a camera that moves with the own machine, None while it does not.
    """

    def __init__(
        self, client: viser.ClientHandle, site: SceneSite, own: str, camera: str, zone_kind: str
    ) -> None:
        self.client = client
        self.camera = camera
        self.following: CameraPose | None = None
        self.zone_kind = zone_kind
        self._site = site
        self._own = self._own_nodes(own)
        self._joints: JointSpace | None = None
        self._ghosts: dict[str, GhostNodes] = {}
        self._ghost: str | None = None
        self._stages: StageNodes | None = None
        self._stages_shown: frozenset[str] = frozenset()
        self._stages_until = -math.inf
        self._use_case: UseCaseNodes | None = None
        self._use_case_shown: Shown | None = None

    @property
    def own(self) -> str:
        """The own machine."""
        return self._own.own

    @own.setter
    def own(self, name: str) -> None:
        if name == self.own:
            return
        self._own.remove()
        self._own = self._own_nodes(name)
        if self._joints is not None:
            self._joints.remove()
            self._joints = None

    def _own_nodes(self, own: str) -> OwnNodes:
        tracks = self._site.machines[own].model.tracks
        return OwnNodes(self.client.scene, own, 0.8 * tracks.length)

    def show_ghost(
        self, machine: str | None, joints: Mapping[str, float] | None, colliding: bool | None
    ) -> None:
        """A ghost of `machine` at these joints in place of the one before; None for none."""
        if self._ghost is not None and self._ghost != machine:
            self._ghosts[self._ghost].hide()
        self._ghost = machine
        if machine is None or joints is None:
            return
        if machine not in self._ghosts:
            entry = self._site.machines[machine]
            self._ghosts[machine] = GhostNodes(self.client.scene, machine, entry)
        self._ghosts[machine].pose(joints, colliding)

    def show_use_case(self, shown: Shown | None) -> None:
        """A run of a use case from one of its instants on, None for none."""
        self._use_case_shown = shown

    def show_stages(self, shown: frozenset[str], until: float) -> bool:
        """Which stages of detection are shown until then [s], none of none; whether that is new."""
        new = shown != self._stages_shown
        self._stages_shown, self._stages_until = shown, until
        return new

    def looks_at_stages(self, now: float) -> bool:
        """Whether this window shows stages of detection. now: a monotonic clock [s]."""
        return bool(self._stages_shown) and now <= self._stages_until

    def update_stages(self, stages: StagedScan | None, now: float) -> None:
        """stages: the newest, None when there are none or they are old."""
        if not self.looks_at_stages(now):
            stages = None
        if self._stages is None and stages is None:
            return
        with self.client.atomic():
            self._stages = self._stages or StageNodes(self.client.scene)
            self._stages.update(stages, self._stages_shown)

    def update(
        self, snapshot: Snapshot, images: SnapshotSource, ground: float, now: float, lost: float
    ) -> None:
        """ground: its height [m]; now: a monotonic clock; lost: as in Scene [s]."""
        with self.client.atomic():
            self._own.update(snapshot, images, ground, lost, self.zone_kind)
            if self._ghost is not None:
                self._ghosts[self._ghost].update(snapshot)
            self._update_use_case(snapshot, now)
            looked_at = self.camera == JOINTS
            if looked_at and self._joints is None:
                label = self._site.machines[self.own].label
                self._joints = JointSpace(self.client.scene, label)
            if self._joints is not None:
                image = images.image("exact", self.own) if looked_at else None
                self._joints.update(image, snapshot.state_time + lost, now, looked_at)

    def _update_use_case(self, snapshot: Snapshot, now: float) -> None:
        shown = self._use_case_shown
        machine = None if shown is None else shown.run.machine
        if self._use_case is not None and self._use_case.machine != machine:
            self._use_case.hide()
        if shown is None or machine is None:
            return
        if self._use_case is None or self._use_case.machine != machine:
            entry = self._site.machines[machine]
            self._use_case = UseCaseNodes(self.client.scene, machine, entry)
        self._use_case.update(shown, snapshot, now)
