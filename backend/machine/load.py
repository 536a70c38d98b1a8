"""From files to a Machine: URDF or xacro, joint_limits.yaml, sidecar, meshes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.machine import bodies, defaults, sun_map
from backend.machine.bodies import Progress
from backend.machine.expand import urdf_text
from backend.machine.lidars import mounts
from backend.machine.limits import actuated_joint, read_joint_limits
from backend.machine.meshes import visuals_of
from backend.machine.model import PARTS, ROLES, Antenna, Joint, Link, Machine, Tracks
from backend.machine.roles import assign_roles
from backend.machine.sidecar import Sidecar, read_sidecar
from backend.machine.stroke_pins import strokes_of
from backend.machine.strokes import Stroke
from backend.machine.sweeps import cylinders_of, swept_by_cylinders
from backend.machine.urdf import Description, UrdfJoint, parse
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array, frozen

SHIPPED = Path(__file__).resolve().parents[2] / "scenes" / "machines"
_NOTHING: Array = np.zeros((0, 3, 3))
_SUFFIXES = (".urdf", ".xacro", ".xml")


@dataclass(frozen=True)
class FitTask:
    """Triangles (n, 3, 3) [m] in the link's frame, and how many boxes may stand for them."""

    triangles: Array
    max_boxes: int


@dataclass(frozen=True)
class _Description:
    """All that the files say, before any body is made. swept: by link, see `sweeps`."""

    robot_file: Path
    robot: Description
    side: Sidecar
    side_name: str
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    swept: dict[int, Array]
    strokes: tuple[Stroke, ...]
    notes: list[str]


def shipped_machines() -> list[str]:
    """Names of the machines that come with the program."""
    return sorted(folder.name for folder in SHIPPED.glob("*/") if _robot_file(folder) is not None)


def load_machine(
    model: str,
    sidecar: str | Path | None = None,
    base_folder: Path | None = None,
    progress: Progress | None = None,
) -> Machine:
    """The machine called `model`: a shipped name, or the path of a URDF or xacro file.

    Relative paths are seen from base_folder (default: the working directory). Without `sidecar`,
    NAME.toml beside the file is used, else the shipped scenes/machines/ROBOT.toml, else defaults,
    which Machine.assumptions lists. Raises InputError.
    """
    d = _describe(model, sidecar, base_folder, progress)
    robot_file, robot, links, joints, side = d.robot_file, d.robot, d.links, d.joints, d.side
    file, side_name, notes = str(robot_file), d.side_name, d.notes
    boxes, body_links = _bodies(d, progress)
    end_link, end_point = defaults.end_point(
        robot, links, joints, side, side_name, robot_file, notes
    )
    arm, sun = sun_map.derive(links, joints, end_link, end_point, file)
    machine = Machine(
        name=robot_file.parent.name if robot_file.parent.parent == SHIPPED else robot.name,
        title=side.title or robot.name,
        joints=joints,
        links=links,
        bodies=boxes,
        body_names=_body_names([links[i].part for i in body_links]),
        body_links=body_links,
        end_link=end_link,
        end_point=end_point,
        sun=sun,
        arm=arm,
        antenna=Antenna(0, frozen((0.0, 0.0, 0.0), (3,), "antenna")),
        heading_of=side.heading.of if side.heading else "upper",
        heading_offset=float(np.radians(side.heading.offset_deg)) if side.heading else 0.0,
        tracks=Tracks(1.0, 1.0, 0.1, 1.0, 0.5),
        masses_trusted=side.masses_trusted,
        payload=side.payload or 0.0,
        self_pairs=(),
        max_reach=float(np.hypot(sum(sun.lengths), arm.tip_lateral)),
        strokes=d.strokes,
    )
    machine = replace(
        machine,
        antenna=defaults.antenna(machine, side.gnss, side_name, notes),
        tracks=defaults.tracks(machine, side.tracks, notes),
        self_pairs=defaults.self_pairs(machine, side.self_collision, side_name, notes),
        eye=defaults.eye(machine, side.eye, side_name),
        lidars=mounts(links, side.lidar, side_name),
    )
    if side.heading is None:
        notes.append("the heading sensor is taken to turn with the upper body")
    if side.payload is None:
        notes.append("no rated payload is stated; 0 kg is used")
    if not side.masses_trusted:
        notes.append("masses are not trusted: nothing is concluded from them")
    notes += [f"assumed: {what}" for what in side.assumed]
    return replace(machine, assumptions=tuple(notes))


def fit_tasks(
    model: str,
    sidecar: str | Path | None = None,
    base_folder: Path | None = None,
    progress: Progress | None = None,
) -> tuple[dict[str, FitTask], Sidecar]:
    """What has to be fitted of each link that has any, by the URDF's names, and the sidecar.

    The arguments are those of `load_machine`; so is what is raised.
    """
    d = _describe(model, sidecar, base_folder, progress)
    tasks: dict[str, FitTask] = {}
    for i, stated in enumerate(d.robot.links):
        triangles = bodies.to_be_fitted(stated, d.swept.get(i, _NOTHING), d.robot_file)
        if len(triangles):
            tasks[stated.name] = FitTask(triangles, bodies.free_boxes(stated, d.side.bodies))
    return tasks, d.side


def _describe(
    model: str, sidecar: str | Path | None, base_folder: Path | None, progress: Progress | None
) -> _Description:
    robot_file = _locate(model, base_folder)
    file = str(robot_file)
    robot = parse(urdf_text(robot_file), file)
    side_file = _locate_sidecar(sidecar, robot_file, robot.name, base_folder)
    side = Sidecar() if side_file is None else read_sidecar(side_file)
    side_name = file if side_file is None else str(side_file)
    notes: list[str] = [] if side_file else ["no sidecar: defaults are used"]

    roles, guessed = assign_roles(
        robot, {str(role): name for role, name in side.joints.items()}, side_name
    )
    notes += guessed
    yaml_file = robot_file.parent / "joint_limits.yaml"
    stated = read_joint_limits(yaml_file, robot) if yaml_file.is_file() else {}
    limits = {str(role): limit for role, limit in side.limits.items()}
    for role in limits:
        if role not in roles:
            raise InputError(f"{side_name}: limits.{role}: the machine has no such joint.")
    joints = tuple(
        actuated_joint(r, j, stated.get(j.name, {}), limits.get(r), side_name, notes)
        for r, j in roles.items()
    )
    links = _links(robot, roles, robot_file, notes)
    cylinders = cylinders_of(links, joints, side, robot_file, side_name)
    swept = swept_by_cylinders(links, joints, cylinders, side_name, progress)
    strokes = strokes_of(links, joints, cylinders, side_name)
    return _Description(robot_file, robot, side, side_name, joints, links, swept, strokes, notes)


def _locate(model: str, base_folder: Path | None) -> Path:
    if not model:
        raise InputError(f"model '': a shipped machine ({_shipped()}) or a URDF path is needed.")
    if Path(model).suffix not in _SUFFIXES:
        found = _robot_file(SHIPPED / model) if "/" not in model else None
        if found is None:
            raise InputError(
                f"model '{model}' is neither a shipped machine ({_shipped()}) nor the path of a "
                f"{', '.join(_SUFFIXES)} file."
            )
        return found
    path = Path(model) if base_folder is None else base_folder / model
    if not path.is_file():
        raise InputError(f"model '{model}': there is no file {path.absolute()}.")
    return path.resolve()


def _shipped() -> str:
    return ", ".join(shipped_machines())


def _robot_file(folder: Path) -> Path | None:
    for suffix in (".urdf", ".xacro"):
        path = folder / f"{folder.name}{suffix}"
        if path.is_file():
            return path
    return None


def _locate_sidecar(
    stated: str | Path | None, robot_file: Path, robot: str, base_folder: Path | None
) -> Path | None:
    if stated is not None:
        path = Path(stated) if base_folder is None else base_folder / stated
        if not path.is_file():
            raise InputError(f"sidecar '{stated}': there is no file {path.absolute()}.")
        return path
    beside = robot_file.with_name(robot_file.name.split(".")[0] + ".toml")
    if beside.is_file():
        return beside
    shipped = SHIPPED / f"{robot}.toml"
    return (
        shipped if robot.replace("_", "").replace("-", "").isalnum() and shipped.is_file() else None
    )


def _links(
    robot: Description, roles: dict[str, UrdfJoint], robot_file: Path, notes: list[str]
) -> tuple[Link, ...]:
    order = list(roles)
    actuated = {joint.name: order.index(role) for role, joint in roles.items()}
    index = {link.name: i for i, link in enumerate(robot.links)}
    links: list[Link] = []
    for i, stated in enumerate(robot.links):
        visuals = tuple(
            visual
            for geometry in stated.visuals
            for visual in visuals_of(geometry, robot_file.parent, str(robot_file))
        )
        if i == 0:
            z = frozen((0.0, 0.0, 1.0), (3,), "axis")
            links.append(Link(stated.name, "tracks", -1, np.eye(4), z, -1, stated.inertia, visuals))
            continue
        joint = robot.joints[i - 1]
        parent = index[joint.parent]
        k = actuated.get(joint.name, -1)
        part = PARTS[ROLES.index(order[k]) + 1] if k >= 0 else links[parent].part
        if k < 0 and joint.type != "fixed":
            notes.append(f"joint '{joint.name}' is no actuator; it is kept at 0")
        T = frozen(joint.T_parent_joint, (4, 4), "T_parent_joint")
        axis = frozen(joint.axis, (3,), "axis")
        links.append(Link(stated.name, part, parent, T, axis, k, stated.inertia, visuals))
    return tuple(links)


def _bodies(d: _Description, progress: Progress | None) -> tuple[Boxes, tuple[int, ...]]:
    robot_file, links, stated = d.robot_file, d.links, d.side.bodies
    known = {link.name for link in d.robot.links}
    for name in stated.boxes:
        if name not in known:
            raise InputError(
                f"{d.side_name}: bodies.boxes.{name}: '{name}' is not a link of the robot; its "
                f"links are {', '.join(link.name for link in d.robot.links)}."
            )
    groups: list[Boxes] = []
    owners: list[int] = []
    for i, link in enumerate(d.robot.links):
        swept = d.swept.get(i, _NOTHING)
        boxes = bodies.link_boxes(link, swept, robot_file, stated, d.side_name, progress)
        groups.append(boxes)
        owners += [i] * len(boxes)
    have = {links[i].part for i in owners}
    missing = [part for part in PARTS[:5] if part not in have]
    if missing:
        raise InputError(
            f"{robot_file}: no collision or visual geometry for the {missing[0]}; without bodies "
            f"its collisions cannot be seen."
        )
    order = sorted(range(len(owners)), key=lambda b: (PARTS.index(links[owners[b]].part), b))
    return bodies.join(groups).take(np.array(order)), tuple(owners[b] for b in order)


def _body_names(parts: list[str]) -> tuple[str, ...]:
    return tuple(f"{part}/{parts[:b].count(part)}" for b, part in enumerate(parts))
