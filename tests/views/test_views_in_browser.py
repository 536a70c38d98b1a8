"""Joint space, ghost and exact zones in two real browser windows, each with its own choice."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import shapely
import toy_site as toy
from PIL import Image
from playwright.sync_api import Browser, Page
from viewing import until

from backend.cspace.cells import FREE, PARTNER, SELF, SITE
from cockpit.views.server import View, start

GHOST = {"swing": 1.2, "boom": 0.9, "stick": -1.2, "bucket": -0.6}
ZONE = shapely.box(0.0, -2.5, 5.0, 3.0).difference(shapely.box(1.6, -0.6, 3.6, 1.8))


def cells() -> np.ndarray:
    """Something of everything: a partner's column, the site below, the machine itself behind."""
    boom, stick, bucket = np.meshgrid(*[np.arange(24)] * 3, indexing="ij")
    away = np.hypot(boom - 17, stick - 9)
    found = np.where(away < 4, PARTNER, np.where(away > 5, FREE, 0)).astype(np.uint8)
    found[bucket + boom < 8] = SITE
    found[stick > 21] = SELF
    return found


class Scene:
    """A view whose images stay new until `frozen`."""

    def __init__(self) -> None:
        self.source = toy.Source()
        self.frozen, self._stop = threading.Event(), threading.Event()
        self._cycle = 0
        self._volume = cells()
        self._feed()
        self.view: View = start(toy.site(), self.source)
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _feed(self) -> None:
        self._cycle += 1
        now = time.monotonic()
        self.source.put(toy.snapshot(self._cycle, now))
        if not self.frozen.is_set():
            zone = toy.ExactZone(now, as_is=ZONE, any_swing=ZONE.buffer(0.7), any_posture=None)
            self.source.images[("zone", "left<-right")] = zone
            self.source.images[("exact", "left")] = toy.own_image(self._volume, now - 0.1)

    def _run(self) -> None:
        while not self._stop.wait(0.04):
            self._feed()

    def ports(self) -> set[int]:
        connections = dict(self.view._server._websock_server._live_connections)
        return {connection.remote_address[1] for connection in connections.values()}

    def open(self, browser: Browser, page: str) -> Page:
        """A window whose connection is known to the view as `page`."""
        before = self.ports()
        window = browser.new_page(viewport={"width": 808, "height": 436})
        window.goto(f"http://127.0.0.1:{self.view.port}/?hideViserLogo&darkMode")
        assert until(lambda: len(self.ports() - before) == 1, 30.0)
        self.view.attach(page, (self.ports() - before).pop())
        # Only looked at: what is made for a window is made under the view's own lock.
        assert until(lambda: len(self.view._clients(page)) == 1, 30.0)
        return window

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.view.stop()


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    made.close()


def picture(window: Page, path: Path | None = None) -> np.ndarray:
    data = window.screenshot(path=path)
    shown = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=int)
    return shown[110:]  # below the client's own notices


def wait_for(window: Page, path: Path, true: Callable[[np.ndarray], bool]) -> np.ndarray:
    end = time.monotonic() + 40.0
    while True:
        shot = picture(window, path)
        if true(shot):
            return shot
        assert time.monotonic() < end, f"{path.name} does not show it"
        time.sleep(0.4)


def purple(shot: np.ndarray) -> int:
    r, g, b = np.moveaxis(shot, 2, 0)
    return int(((b > g + 25) & (r > g + 10)).sum())


def green(shot: np.ndarray) -> int:
    r, g, b = np.moveaxis(shot, 2, 0)
    return int(((g > r + 30) & (g > b)).sum())


def red(shot: np.ndarray) -> int:
    r, g, b = np.moveaxis(shot, 2, 0)
    return int(((r > g + 45) & (abs(g - b) < 40)).sum())


@pytest.mark.browser
def test_each_window_has_its_own_views(scene: Scene, browser: Browser, artifacts: Path) -> None:
    first, second = scene.open(browser, "first"), scene.open(browser, "second")
    errors: list[str] = []
    for window in (first, second):
        window.on("pageerror", lambda error: errors.append(str(error)))
    site = wait_for(second, artifacts / "zone-exact.png", lambda s: purple(s) > 4000)
    wait_for(first, artifacts / "zone-exact-first.png", lambda s: purple(s) > 4000)

    scene.view.set_ghost("left", GHOST, "first", colliding=True)
    wait_for(first, artifacts / "ghost-contact.png", lambda s: red(s) > red(site) + 300)
    assert red(picture(second)) < red(site) + 60
    scene.view.set_ghost(None, None, "first")
    wait_for(first, artifacts / "ghost-gone.png", lambda s: red(s) < red(site) + 60)

    scene.view.set_camera("joints", "first")
    joints = wait_for(
        first, artifacts / "joints.png", lambda s: purple(s) > 3000 and green(s) > 1500
    )
    assert purple(picture(second)) == pytest.approx(purple(site), rel=0.2)
    scene.frozen.set()
    wait_for(
        first,
        artifacts / "joints-stale.png",
        lambda s: purple(s) < 0.02 * purple(joints) and green(s) < 0.1 * green(joints),
    )
    wait_for(second, artifacts / "zone-stale.png", lambda s: purple(s) < 0.05 * purple(site))
    assert not errors
    first.close()
    second.close()
