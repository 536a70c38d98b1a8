"""A stretch of snapshots as a 3D scene in one HTML document that needs no server."""

from __future__ import annotations

from collections.abc import Sequence

import rich

from backend.pipeline.records import Snapshot
from cockpit.views.cameras import camera_pose
from cockpit.views.inputs import SceneSite
from cockpit.views.opening import open_server
from cockpit.views.scene import Scene

LONGEST_GAP = 2.0  # [s] that a gap between two snapshots is shown as


def replay_html(site: SceneSite, moments: Sequence[tuple[float, Snapshot]]) -> str:
    """A self-contained HTML document: the scene with a time slider.

    moments: (time since the session's begin [s], snapshot), in order of time; at least one.
    Raises ValueError without any.
    """
    if not moments:
        raise ValueError("a replay needs at least one snapshot")
    server = open_server()
    try:
        own = next(iter(site.machines))
        with server.atomic():
            scene = Scene(server.scene, site)
        pose = camera_pose("site", site, moments[0][1], own)
        camera = server.initial_camera
        camera.position, camera.look_at, camera.fov = pose.position, pose.look_at, pose.fov
        scene.update(moments[0][1], moments[0][0])
        serializer = server.get_scene_serializer()
        before = moments[0][0]
        for time, snapshot in moments[1:]:
            serializer.insert_sleep(min(max(time - before, 0.0), LONGEST_GAP))
            scene.update(snapshot, time)
            before = time
        serializer.insert_sleep(0.5)
        return serializer.as_html(dark_mode=True)
    finally:
        console = rich.get_console()
        quiet, console.quiet = console.quiet, True
        try:
            server.stop()
        finally:
            console.quiet = quiet
