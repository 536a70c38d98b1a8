"""How the scene's server is opened: on the loopback only, and never shared."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
import rich
import viser
from viser import _messages

from cockpit.views import palette


def open_server() -> viser.ViserServer:
    """A viser server on 127.0.0.1, on any free port, that never opens a public tunnel."""
    console = rich.get_console()
    quiet, console.quiet = console.quiet, True  # viser prints a panel of addresses otherwise
    try:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    finally:
        console.quiet = quiet
    for request in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(request)
    server.request_share_url = _no_tunnel  # type: ignore[method-assign]
    server.gui.configure_theme(
        dark_mode=True, show_logo=False, show_share_button=False, control_width="small"
    )
    server.gui.main_panel.minimize()
    server.scene.set_up_direction("+z")
    server.scene.world_axes.visible = False
    server.scene.set_background_image(np.full((2, 2, 3), palette.PAGE, np.uint8), format="png")
    return server


def _no_tunnel(*_: object, **__: object) -> NoReturn:
    raise PermissionError("the cockpit's scene is never shared through a public tunnel")
