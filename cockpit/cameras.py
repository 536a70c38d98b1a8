"""The cameras of a site's machines, as a running cockpit fetches them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from backend.shell.camera.sharing import Pictures, SharedCamera
from backend.shell.camera.sources import asked, mjpeg
from backend.site.cameras import Camera
from backend.site.site import Site


def make_cameras(site: Site, session: Any) -> dict[str, SharedCamera]:
    """By "machine/index"; those that a page opens by itself are not among them."""
    return {
        f"{machine.name}/{index}": SharedCamera(
            _source(camera, session, machine.prefix), patient=camera.kind == "link"
        )
        for machine in site.machines
        for index, camera in enumerate(machine.camera)
        if camera.kind != "whep"
    }


def whep_origins(site: Site) -> tuple[str, ...]:
    """Where a page may open streams by itself."""
    cameras = (camera for machine in site.machines for camera in machine.camera)
    return tuple(dict.fromkeys(c.origin for c in cameras if c.kind == "whep"))


def _source(camera: Camera, session: Any, prefix: str) -> Callable[[], Pictures]:
    if camera.kind == "link":
        return partial(asked, session, prefix, camera.name or "")
    return partial(mjpeg, camera.url or "")
