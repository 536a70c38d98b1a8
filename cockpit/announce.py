"""Telling where the page is, and opening it."""

from __future__ import annotations

import contextlib
import os
import sys
import webbrowser

from backend.site.site import Site


def announce(site: Site, port: int, host: str, open_browser: bool) -> None:
    """Print the page's address; open it where there is a screen."""
    shown = "127.0.0.1" if host in ("", "0.0.0.0", "::") else host
    url = f"http://{shown}:{port}"
    print(f"{site.title}: {url}", flush=True)
    if not open_browser:
        return
    has_screen = sys.platform in ("darwin", "win32") or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )
    opened = False
    if has_screen:
        with contextlib.suppress(webbrowser.Error):
            opened = webbrowser.open(url)
    if not opened:
        print(f"No browser could be opened here: open {url} yourself.", flush=True)
