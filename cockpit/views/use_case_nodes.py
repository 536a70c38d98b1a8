"""A run as it plays: a ghost where it begins, its deciding pair where one is known, and the tool's
path, as it went and as it was meant. Use cases of the working gauge are runs, and plans are.

Its title says what it is, and it is drawn with the colours of ghosts: no alarm looks like it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import viser

from backend.machine import kinematics
from backend.pipeline.records import Snapshot
from backend.spatial.types import Array, IntArray
from cockpit.views import palette
from cockpit.views.ghost import GhostNodes
from cockpit.views.inputs import SceneMachine
from cockpit.views.lines import Lines, ink
from cockpit.views.shapes import Float32

TITLE = "USE CASE · simulated"
ASKED = 3.0
"""[s] without a word of its page after which a run is out of sight."""
NEAR = 0.5
"""[m] between the real base and the ghost's within which the latter is not drawn once more."""
RAISED = 1.1  # [m] of its title over the arm: above the name of the real machine
THINNED = 5  # every so many instants of the tool's path are drawn
DROP = 0.15  # [m] of the distance's label under the line


@dataclass(frozen=True, eq=False)
class Played:
    """A run as it is drawn. machine: of the site; T_site_root: (4, 4) where it stands; words: of
    the method; times: (m,) [s]; q: (m, n) [rad]; distance: (m,) of the deciding pair [m]; pair:
    (m,) index into pairs, in words; points: (m, 2, 3) of it; tool, designed: (m, 3) where the tool
    was and was meant to be; all in the machine's root frame [m]. Without pairs no pair is drawn.
    Of a machine whose base moves, too: roots: (m, 4, 4) in place of T_site_root, which is where it
    begins and what the paths stay in; parts: (m) names of what it does, in place of words.
    """

    machine: str
    T_site_root: Array
    words: str
    times: Array
    q: Array
    distance: Array
    pair: IntArray
    pairs: tuple[str, ...]
    points: Array
    tool: Array
    designed: Array
    title: str = TITLE
    roots: Array | None = None
    parts: tuple[str, ...] = ()

    def instant(self, t: float) -> int:
        """The last instant not after t [s]; the first, the last where t is outside."""
        k = int(np.searchsorted(self.times, t + 1e-9, side="right")) - 1
        return min(max(k, 0), len(self.times) - 1)

    def root(self, k: int) -> Array:
        """T_site_root (4, 4) at an instant."""
        return self.T_site_root if self.roots is None else np.asarray(self.roots[k])

    def said(self, k: int) -> str:
        """What stands beside the ghost at an instant."""
        return f"{self.title} · {self.parts[k] if self.parts else self.words}"


@dataclass(frozen=True, eq=False)
class Shown:
    """at: the moment of the run [s] that was shown at `since` of a monotonic clock [s], from which
    it goes on `rate` times as fast as it was.
    """

    run: Played
    at: float
    rate: float
    since: float

    def instant(self, now: float) -> int | None:
        """Which instant is shown, None when nobody has asked for it lately."""
        ago = now - self.since
        return None if ago > ASKED else self.run.instant(self.at + self.rate * max(ago, 0.0))


class UseCaseNodes:
    """Nodes of one browser; kept when hidden. machine: of the site, whose ghost it is."""

    def __init__(self, scene: viser.SceneApi, machine: str, entry: SceneMachine) -> None:
        self.machine = machine
        self._model = entry.model
        self._ghost = GhostNodes(scene, machine, entry, "/usecase", RAISED)
        root = f"/usecase/{machine}/pair"
        self._line = Lines(scene, f"{root}/line", 3.0)
        self._path = Lines(scene, f"/usecase/{machine}/path", 2.5)
        self._meant = Lines(scene, f"/usecase/{machine}/meant", 1.5)
        self._label = scene.add_label(
            f"{root}/words", "", font_screen_scale=1.4, anchor="top-center", visible=False
        )
        self._drawn: tuple[Played, int, bool] | None = None

    def hide(self) -> None:
        """Take it out of sight."""
        if self._drawn is None:
            return
        self._drawn = None
        self._ghost.hide()
        for lines in (self._line, self._path, self._meant):
            lines.draw(np.zeros((0, 2, 3), dtype=np.float32), ink(palette.TEXT))
        self._label.visible = False

    def update(self, shown: Shown, snapshot: Snapshot, now: float) -> None:
        """now: of the monotonic clock [s]."""
        run, k = shown.run, shown.instant(now)
        if k is None:
            self.hide()
            return
        poses = kinematics.link_poses(self._model, run.q[k], run.root(k))
        on_it = self._stands_there(snapshot, poses)
        if (key := (run, k, on_it)) == self._drawn:
            return
        if self._drawn is None or self._drawn[0] is not run:
            self._line.draw(np.zeros((0, 2, 3), dtype=np.float32), ink(palette.TEXT))
            self._label.visible = False
            self._path.draw(_way(run.tool, run.T_site_root), ink(palette.TEXT))
            self._meant.draw(_way(run.designed, run.T_site_root), ink(palette.STALE))
        self._drawn = key
        fixed = np.arange(len(poses)) == 0
        touches = bool(run.pairs) and bool(run.distance[k] < 0.0)
        self._ghost.stand(poses, fixed & on_it, run.said(k), touches)
        if run.pairs:
            self._draw_pair(run, k)

    def _draw_pair(self, run: Played, k: int) -> None:
        points = _moved(run.points[k], run.T_site_root)
        self._line.draw(points[None].astype(np.float32), ink(palette.TEXT))
        self._label.position = points.mean(axis=0) - [0.0, 0.0, DROP]
        self._label.text = f"{run.pairs[run.pair[k]]} {run.distance[k]:.2f} m"
        self._label.visible = True

    def _stands_there(self, snapshot: Snapshot, poses: Array) -> bool:
        """Whether the real machine's base is where the ghost's is."""
        state = snapshot.machines.get(self.machine)
        if state is None or state.body is None:
            return False
        real = state.body.link_poses[0]
        turned = float(np.abs(real[:3, :3] - poses[0, :3, :3]).max())
        return bool(np.linalg.norm(real[:3, 3] - poses[0, :3, 3]) < NEAR and turned < 0.1)


def _moved(points: Array, T: Array) -> Array:
    """(m, 3) in another frame."""
    return np.asarray(points @ T[:3, :3].T + T[:3, 3])


def _way(points: Array, T_site_root: Array) -> Float32:
    """(k, 2, 3) the pieces of a path through points (m, 3)."""
    kept = _moved(points[::THINNED], T_site_root).astype(np.float32)
    return np.stack([kept[:-1], kept[1:]], axis=1)
