"""Where the cameras stand: "site", "plan", "follow", "behind <machine>" and "joints"."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.pipeline.records import Body3D, Snapshot
from backend.spatial.types import Array
from cockpit.views.inputs import SceneSite
from cockpit.views.joint_frame import PLACE, SIZE

FOV = np.deg2rad(45.0)  # vertical
PLAN_FOV = np.deg2rad(24.0)
ELEVATION = np.deg2rad(32.0)  # of the site camera
ASPECT = 1.65  # width to height that the cameras are laid out for
JOINTS_FOV = np.deg2rad(30.0)
JOINTS_FROM = np.array([0.5, -1.0, 0.5])  # of the box of the joint-space view
JOINTS_MARGIN = 1.1  # what the axes' names take, as a share of the box
REACH_UNPLACED = 8.0  # [m] drawn around the origin before any machine is placed


@dataclass(frozen=True)
class CameraPose:
    """position, look_at: (3,) site frame [m]; fov: vertical [rad]."""

    position: Array
    look_at: Array
    fov: float


def camera_names(site: SceneSite) -> tuple[str, ...]:
    """Every name that `camera_pose` knows."""
    return ("site", "plan", "follow", *(f"behind {name}" for name in site.machines), "joints")


def camera_pose(
    name: str, site: SceneSite, snapshot: Snapshot | None, own: str, aspect: float = ASPECT
) -> CameraPose:
    """The camera called `name`, for the machines where they are now.

    "behind left" takes a machine's name or label, in any case; "follow" is behind `own` and is
    asked for again in each cycle. aspect: width to height of the picture.
    Raises ValueError naming the cameras there are.
    """
    placed = _placed(snapshot)
    if name == "follow":
        return _behind(site, own, placed)
    if name == "joints":
        return _joints(aspect)
    if name.startswith("behind"):
        wanted = name.removeprefix("behind").strip(" :").lower()
        for machine, entry in site.machines.items():
            if wanted in (machine.lower(), entry.label.lower()):
                return _behind(site, machine, placed)
    center, across, along = extent(site, snapshot)
    radius = max(along, across / min(max(aspect, 0.5), ASPECT))
    if name == "plan":
        # A hair south of straight down, so that north is up.
        height = 1.25 * radius / np.tan(PLAN_FOV / 2.0)
        above = center + np.array([0.0, -0.002 * height, height])
        return CameraPose(above, center, float(PLAN_FOV))
    if name == "site":
        distance = 0.88 * radius / np.tan(FOV / 2.0)
        away = _across(placed)
        offset = np.append(away * np.cos(ELEVATION), np.sin(ELEVATION)) * distance
        nearer = center + np.append(0.14 * radius * away, 0.0)
        return CameraPose(nearer + offset, nearer, float(FOV))
    raise ValueError(f'no camera "{name}"; there are {", ".join(camera_names(site))}')


def _placed(snapshot: Snapshot | None) -> dict[str, Body3D]:
    if snapshot is None:
        return {}
    states = snapshot.machines.items()
    return {name: state.body for name, state in states if state.body is not None}


def extent(site: SceneSite, snapshot: Snapshot | None) -> tuple[Array, float, float]:
    """Centre (3,) on the ground of all workspaces, and how far they go from it in x and y [m]."""
    placed = {name: body for name, body in _placed(snapshot).items() if name in site.machines}
    bases = [(body.swing_center, site.machines[name].model) for name, body in placed.items()]
    if not bases:
        return np.zeros(3), REACH_UNPLACED, REACH_UNPLACED
    lows = np.min([center[:2] - model.max_reach for center, model in bases], axis=0)
    highs = np.max([center[:2] + model.max_reach for center, model in bases], axis=0)
    ground = min(float(body.link_poses[0, 2, 3]) for body in placed.values())
    across, along = (highs - lows) / 2.0
    return np.append((lows + highs) / 2.0, ground), float(across), float(along)


def _across(placed: dict[str, Body3D]) -> Array:
    """(2,) unit, from the south side, square to the line between the first and the last machine."""
    centers = [body.swing_center[:2] for body in placed.values()]
    line = centers[-1] - centers[0] if len(centers) > 1 else np.array([1.0, 0.6])
    length = float(np.linalg.norm(line))
    if length < 1e-6:
        return np.array([0.0, -1.0])
    across = np.array([line[1], -line[0]]) / length
    return np.asarray(across if across[1] <= 0.0 else -across)


def _behind(site: SceneSite, name: str, placed: dict[str, Body3D]) -> CameraPose:
    reach = site.machines[name].model.max_reach
    body = placed.get(name)
    base = np.zeros(3) if body is None else body.swing_center
    ground = 0.0 if body is None else float(body.link_poses[0, 2, 3])
    azimuth = 0.0 if body is None else body.azimuth
    ahead = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    side = np.array([ahead[1], -ahead[0], 0.0])
    on_ground = np.array([base[0], base[1], ground])
    # Over the right shoulder, so that the own upper body does not hide the bucket.
    position = on_ground - 1.15 * reach * ahead + 0.45 * reach * side
    position[2] += 1.05 * reach
    return CameraPose(position, on_ground + 0.45 * reach * ahead + [0, 0, 0.1 * reach], float(FOV))


def _joints(aspect: float) -> CameraPose:
    """In front of the joint-space view's box, the whole of it in the picture."""
    center = np.array(PLACE) + SIZE / 2.0 + [0.0, 0.0, -0.04 * SIZE[2]]
    radius = JOINTS_MARGIN * float(np.linalg.norm(SIZE)) / 2.0
    distance = radius / np.sin(JOINTS_FOV / 2.0) / min(max(aspect, 0.3) / 1.3, 1.0)
    away = JOINTS_FROM / np.linalg.norm(JOINTS_FROM)
    return CameraPose(center + distance * away, center, float(JOINTS_FOV))
