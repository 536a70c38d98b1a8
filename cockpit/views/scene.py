"""The shared scene: everything that all browsers see alike."""

from __future__ import annotations

import viser

from backend.pipeline.records import Snapshot
from cockpit.views import palette
from cockpit.views.cameras import extent
from cockpit.views.ground import GaugeNodes, Ground, ground_height, light
from cockpit.views.inputs import SceneSite
from cockpit.views.machines import MachineNodes
from cockpit.views.nearest import PairNodes
from cockpit.views.people import PeopleNodes
from cockpit.views.people_seen import seen_people
from cockpit.views.sight_nodes import SightNodes


class Scene:
    """Nodes are made here once; `update` sets the properties that changed."""

    def __init__(self, scene: viser.SceneApi, site: SceneSite) -> None:
        light(scene)
        self._scene = scene
        self._site = site
        self._ground: Ground | None = None
        self._machines = {
            name: MachineNodes(scene, name, entry, palette.TINTS[k % len(palette.TINTS)])
            for k, (name, entry) in enumerate(site.machines.items())
        }
        self._pairs = PairNodes(scene, site)
        self._gauge = GaugeNodes(scene, site)
        self._people = PeopleNodes(scene)
        self._sight = SightNodes(scene, site.machines)

    @property
    def ground(self) -> float:
        """Height of the ground [m]."""
        return self._ground.height if self._ground else 0.0

    def update(
        self,
        snapshot: Snapshot,
        now: float,
        lost: float = 0.0,
    ) -> None:
        """now: a monotonic clock [s]; lost: seconds without a snapshot, 0 while they come."""
        self._place_ground(snapshot)
        self._gauge.update(snapshot.gauge.choice)
        for name, nodes in self._machines.items():
            if name in snapshot.machines:
                stands = snapshot.stability.get(name)
                tips = stands is not None and not stands.reason and stands.share <= 0.0
                nodes.update(snapshot.machines[name], self.ground, now, lost, tips)
        self._pairs.update(snapshot, now, lost)
        self._people.update(
            seen_people(snapshot.people, snapshot.time), snapshot.time, self.ground, now, lost
        )
        watched = snapshot.people is not None
        self._sight.update(snapshot.machines, watched, self.ground, now)

    def _place_ground(self, snapshot: Snapshot) -> None:
        placed = {n: s.body for n, s in snapshot.machines.items() if s.body is not None}
        known = [body for name, body in placed.items() if name in self._site.machines]
        if self._ground is None:
            # Around the first machines that are placed; the grid never moves afterwards.
            if len(known) < len(self._site.machines) and snapshot.cycle < GRID_PATIENCE:
                return
            center, across, along = extent(self._site, snapshot)
            x, y = float(center[0]), float(center[1])
            self._ground = Ground(self._scene, self._site, (x, y), (across, along))
        heights = [float(body.link_poses[0, 2, 3]) for body in known]
        height = ground_height(heights, self._ground.height)
        if height != self._ground.height:
            self._ground.height = height


GRID_PATIENCE = 100  # cycles to wait for all machines before the grid is laid
