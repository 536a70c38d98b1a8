"""Telling where the page is, and opening it."""

from __future__ import annotations

import contextlib
import os
import sys
import webbrowser

from backend.shell.access.access import Access
from backend.site.site import Site
from cockpit.entry import Entry, link


def announce(site: Site, entry: Entry, access: Access, port: int, open_browser: bool) -> None:
    """Print the page's address; open it where there is a screen. With one-time links it is one."""
    url = entry.url(port)
    if access.links is not None:
        url = link(url, access.links.make())
    once = " (works once)" if access.links is not None else ""
    print(f"{site.title}: {url}{once}", flush=True)
    for note in entry.notes():
        print(note, flush=True)
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
