"""Telling where the page is, and opening it."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import webbrowser

from backend.shell.access.access import Access
from backend.shell.priority import AFTER, set_niceness
from backend.site.site import Site
from cockpit.entry import Entry, link


def _open(url: str) -> bool:
    """A browser goes after what moves machines: it is started by a thread that does so, too."""
    opened: list[bool] = []

    def run() -> None:
        set_niceness(AFTER)
        with contextlib.suppress(webbrowser.Error):
            opened.append(webbrowser.open(url))

    thread = threading.Thread(target=run, name="browser")
    thread.start()
    thread.join()
    return any(opened)


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
        opened = _open(url)
    if not opened:
        print(f"No browser could be opened here: open {url} yourself.", flush=True)
