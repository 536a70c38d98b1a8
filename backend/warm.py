"""Prepare what is slow the first time: compile the kernels, fit the shipped machines' bodies."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from rich.progress import track

from backend.collision.closest import closest_pairs
from backend.collision.scene import Surface, scene
from backend.collision.server import closest, pairs
from backend.cspace.driving import driving_zone, turning_zone
from backend.cspace.joint_bars import joint_bar
from backend.cspace.joint_image import certified4, joint4
from backend.cspace.margins import margins
from backend.cspace.reach_image import reach_image
from backend.cspace.regions import regions
from backend.machine.load import load_machine, shipped_machines
from backend.machine.model import Machine
from backend.machine.outline import outlines_of
from backend.perception.detect import detect
from backend.perception.lzf_kernel import expanded, expanded_size
from backend.pipeline.along_cycle import Cycle
from backend.pipeline.along_track import Placement, Question, along_track
from backend.pipeline.partner_risks import pieces
from backend.pipeline.partner_risks_kernel import first_meeting
from backend.pipeline.place import place
from backend.pipeline.records import Body3D
from backend.pipeline.surroundings import within as near_bodies
from backend.pipeline.watch import Cloud, Watched, watch
from backend.planning.live import rehearse
from backend.planning.trajectory import plan as trajectory
from backend.safety.approach import Motion, approach
from backend.safety.limiter import Wish, limit, open_latch
from backend.safety.limits import Delay
from backend.safety.record import Concern, Level
from backend.safety.swing_arcs import Objects, judge_swing
from backend.safety.swing_risk import Boundaries, Swing
from backend.safety.working_area import Stand, within, working_area
from backend.site.named_bodies import SiteBodies
from backend.spatial import rotation, transform
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.stability.masses import mass_model
from backend.stability.polygon import support_polygon
from backend.stability.resting import cells as tipping_cells
from backend.stability.resting import resting, tips
from backend.stability.state import stability
from backend.stability.zmp import edge_moments
from backend.tracking import tracker
from backend.tracking.association import associate
from backend.tracking.records import Detections


def forget_stale(folder: Path) -> bool:
    """Remove what was compiled from other texts than the kernels below `folder` have now.

    A compiled kernel holds the kernels of other files that it calls, but numba compiles it anew
    only when its own file changes. Returns whether anything was removed.
    """
    texts = sorted(p for p in folder.rglob("*.py") if b"from numba" in p.read_bytes())
    digest = hashlib.sha256()
    for path in texts:
        digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    stamp = folder / "__pycache__" / "kernels.sha256"
    if stamp.exists() and stamp.read_text() == digest.hexdigest():
        return False
    for compiled in (*folder.rglob("*.nbi"), *folder.rglob("*.nbc")):
        compiled.unlink(missing_ok=True)
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(digest.hexdigest())
    return True


def compile_kernels() -> None:
    """Call every compiled kernel once, so that the first live cycle finds it ready."""
    machine = load_machine("mini")
    q = np.zeros(len(machine.joints))
    tilted = transform.make(rotation.from_attitude(0.2, 0.05, 0.03), np.zeros(3))
    body = place(machine, q, transform.make(np.eye(3), np.array([4.0, 0.0, 0.0])))
    near: Boxes = body.boxes
    closest_pairs(near, near)
    triangle = Surface("triangle", np.eye(3), np.array([[0, 1, 2]]))
    site = scene(near, machine.body_names, meshes=(triangle,)).with_cloud("cloud", np.eye(3), 0.1)
    closest(site, near, 9.0)
    pairs(near, machine.self_pair_index, 9.0)
    outlines_of(machine, near)
    margins(machine, q, near, 0.1, np.full(len(q), 0.01))
    near_bodies(near, body.swing_center, 9.0)
    stability(machine, 0.0, q, q, q, (q, q))
    motion = Motion(body.link_poses, body.link_poses[0], q, np.zeros(3), 0.0)
    rows = approach(machine, motion, machine, motion, "partner", 0.3, 0.1, 0.7)
    concern = Concern(
        *("partner", "own", Level.CLEAR, "", np.ones((len(q), 2)), np.ones(2), None, 0.0, rows)
    )
    wish = Wish(machine.max_velocity, np.ones(2))
    limit("own", machine, q, wish, (concern,), Delay(0.1, 0.2), open_latch(machine), 0.0)
    area = working_area(machine, Stand(q, q, *(0.0,) * 2, q[:2], *(0.0,) * 6), 1.0)
    within(area, np.zeros((1, 2)), np.zeros(1))
    rehearse(machine)
    trajectory.rehearse(machine)
    empty = Watched()
    cloud = Cloud("own", "lidar", 0.0, _GROUND, np.eye(4), near)
    watch(watch(empty, (cloud,))[0], (cloud,))
    edge_moments(mass_model(machine), support_polygon(machine), q, q, q)
    rest = resting(machine, 0.0, 0.1)
    tips(rest, q[None])
    tipping_cells(rest, q[:4], q[:4], (1, 1, 1, 1), q, q[:4])
    layers = {"partner": near}
    joint4(machine, layers, (3, 3, 3, 3))
    free = certified4(machine, layers, 0.1, (3, 3, 3, 3)).certified_free()
    regions(free, (0, 0, 0, 0), wraps=True)
    reach_image(machine, q, layers, (4, 4))
    joint_bar(machine, q, 0, np.array([-1.0, 1.0]), 4, layers, 0.1, np.full(len(q), 0.01))
    still = Cycle(q[None], np.zeros(0))
    here = Placement(0.0, 0.0, 0.0, 0.0)
    standing = SiteBodies(near, machine.body_names)
    along_track(machine, still, _straight, here, standing, (0.0, 0.5), Question())
    for base in (np.eye(4), tilted):
        driving_zone(machine, q, base, near, 0.1)
        turning_zone(machine, q, base, near, eta=0.1)
    follow(near)
    beside(machine, body)


def follow(machine: Boxes) -> None:
    """From a cloud's bytes to tracks."""
    packed = np.array([0, 65], np.uint8)
    expanded(packed, int(expanded_size(packed)))
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    points = np.stack([x, y, np.zeros(81)], axis=1)
    detect(points, np.zeros(3), machine)
    tracks = tracker.nothing()
    for k in range(2):
        tracks = tracker.track(tracks, Detections(0.1 * k, np.zeros((1, 7)))).tracks
    tracker.later(tracks, 1.0)
    associate(np.ones((2, 2)))


def beside(machine: Machine, body: Body3D) -> None:
    """Machines and people on the TTC-x plane."""
    poses = np.repeat(body.link_poses[None], 2, axis=0)
    seen, _ = pieces(machine, poses, np.eye(4), np.arange(len(machine.body_links)))
    some = seen.take(np.ones(seen.radius.shape[1], dtype=bool))
    first_meeting(tuple(seen), tuple(some), 0.1, 0.3)
    still = Swing(0.0, 0.0, 0.0, 1.0, 1.0)
    one = Objects(np.ones((1, 2)), np.zeros((1, 2)), *np.ones((4, 1)))
    judge_swing(body.boxes.corners(), still, one, one, 1.0, Boundaries(), 0.2)


_GROUND: Array = np.stack(
    [*np.meshgrid(np.arange(-5.0, 5.0, 0.5), np.arange(-5.0, 5.0, 0.5)), np.zeros((20, 20))], -1
).reshape(-1, 3)


def _straight(s: Array) -> Array:
    """A track along x."""
    return transform.make(np.eye(3), np.stack([s, 0.0 * s, 0.0 * s], axis=-1))


def main() -> None:
    forget_stale(Path(__file__).parent)
    steps: list[tuple[str, Callable[[], object]]] = [("kernels", compile_kernels)]
    steps += [(name, partial(load_machine, name)) for name in shipped_machines()]
    for _, prepare in track(steps, "Preparing", transient=True):
        prepare()


if __name__ == "__main__":
    main()
