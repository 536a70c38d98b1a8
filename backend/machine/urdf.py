"""URDF text to plain records: links, joints, geometries, as the file states them.

Reads what an excavator needs (link, joint, origin, axis, limit, inertial, visual, collision,
material) and ignores the rest (transmissions, gazebo tags).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from backend.errors import InputError
from backend.machine.model import Inertia
from backend.spatial import rotation, transform
from backend.spatial.types import Array

Color: TypeAlias = tuple[int, int, int]


@dataclass(frozen=True)
class Geometry:
    """One <visual> or <collision>. T_link_geometry: (4, 4); size in metres.

    kind "box": size (x, y, z); "cylinder": (radius, length) along z; "sphere": (radius,);
    "mesh": size is the scale (x, y, z) and filename the URI. color: None when not stated.
    """

    kind: str
    size: tuple[float, ...]
    filename: str
    T_link_geometry: Array
    color: Color | None


@dataclass(frozen=True)
class UrdfLink:
    name: str
    inertia: Inertia | None
    visuals: tuple[Geometry, ...]
    collisions: tuple[Geometry, ...]


@dataclass(frozen=True)
class UrdfJoint:
    """type as in URDF; T_parent_joint: (4, 4) at value 0; limits None when not stated."""

    name: str
    type: str
    parent: str
    child: str
    T_parent_joint: Array
    axis: Array
    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None = None  # [N m], None where none is stated


@dataclass(frozen=True)
class Description:
    """A URDF robot. links are listed parents first; joints[k] carries links[k + 1]."""

    name: str
    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]


_JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


def parse(text: str, file: str) -> Description:
    """The description in a URDF text. `file` names it in errors. Raises InputError."""
    try:
        robot = ET.fromstring(text)
    except (ET.ParseError, ValueError) as error:
        raise InputError(f"{file}: not well-formed XML: {error}.") from None
    if robot.tag != "robot":
        raise InputError(f"{file}: the root element is <{robot.tag}>; a URDF has <robot>.")
    name = robot.get("name") or "robot"
    colors: dict[str, Color] = {}
    for material in robot.iter("material"):
        color = _own_color(material, file)
        if color is not None and material.get("name"):
            colors[str(material.get("name"))] = color
    links = _unique([_link(e, colors, file) for e in robot.findall("link")], "link", file)
    joints = _unique([_joint(e, file) for e in robot.findall("joint")], "joint", file)
    if not links:
        raise InputError(f"{file}: no <link> in the robot; at least one is needed.")
    return _in_tree_order(name, links, joints, file)


def _unique(items: list, kind: str, file: str) -> dict:  # type: ignore[type-arg]
    named = {}
    for item in items:
        if item.name in named:
            raise InputError(f"{file}: {kind} '{item.name}' is defined twice; names are unique.")
        named[item.name] = item
    return named


def _in_tree_order(
    name: str, links: dict[str, UrdfLink], joints: dict[str, UrdfJoint], file: str
) -> Description:
    children: dict[str, list[UrdfJoint]] = {}
    carried: dict[str, str] = {}
    for joint in joints.values():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise InputError(
                    f"{file}: joint '{joint.name}' has {role} link '{link}', which is not defined; "
                    f"links are {', '.join(links)}."
                )
        if joint.child in carried:
            raise InputError(
                f"{file}: link '{joint.child}' hangs on two joints, '{carried[joint.child]}' and "
                f"'{joint.name}'; every link has one parent."
            )
        carried[joint.child] = joint.name
        children.setdefault(joint.parent, []).append(joint)
    roots = [link for link in links if link not in carried]
    if len(roots) != 1:
        found = ", ".join(roots) or "none (the joints form a loop)"
        raise InputError(f"{file}: exactly one root link is needed, found {found}.")
    ordered: list[UrdfLink] = [links[roots[0]]]
    ordered_joints: list[UrdfJoint] = []
    waiting = list(children.get(roots[0], []))
    while waiting:
        joint = waiting.pop(0)
        ordered_joints.append(joint)
        ordered.append(links[joint.child])
        waiting.extend(children.get(joint.child, []))
    if len(ordered) != len(links):
        lost = sorted(set(links) - {link.name for link in ordered})
        raise InputError(f"{file}: links {', '.join(lost)} are in a loop; a URDF is a tree.")
    return Description(name, tuple(ordered), tuple(ordered_joints))


def _link(element: ET.Element, colors: dict[str, Color], file: str) -> UrdfLink:
    name = _name(element, "link", file)
    where = f"{file}: link '{name}'"
    visuals = tuple(_geometry(e, colors, where) for e in element.findall("visual"))
    collisions = tuple(_geometry(e, colors, where) for e in element.findall("collision"))
    inertial = element.find("inertial")
    inertia = None if inertial is None else _inertia(inertial, where)
    return UrdfLink(name, inertia, visuals, collisions)


def _inertia(element: ET.Element, where: str) -> Inertia | None:
    mass = element.find("mass")
    if mass is None:
        return None
    m = _number(mass, "value", None, f"{where}, mass")
    if m < 0.0:
        raise InputError(f"{where}, mass: {m} kg; it must not be negative.")
    T = _origin(element, where)
    tensor = np.zeros((3, 3))
    given = element.find("inertia")
    if given is not None:
        for i, j, key in ((0, 0, "ixx"), (1, 1, "iyy"), (2, 2, "izz")):
            tensor[i, j] = _number(given, key, 0.0, f"{where}, inertia")
        for i, j, key in ((0, 1, "ixy"), (0, 2, "ixz"), (1, 2, "iyz")):
            tensor[i, j] = tensor[j, i] = _number(given, key, 0.0, f"{where}, inertia")
    R = T[:3, :3]
    return Inertia(m, T[:3, 3].copy(), R @ tensor @ R.T)


def _geometry(element: ET.Element, colors: dict[str, Color], where: str) -> Geometry:
    where = f"{where}, {element.tag}"
    holder = element.find("geometry")
    shape = None if holder is None or len(holder) == 0 else holder[0]
    if shape is None:
        raise InputError(f"{where}: no geometry; allowed are box, cylinder, sphere and mesh.")
    filename = ""
    size: tuple[float, ...]
    if shape.tag == "box":
        size = _numbers(shape, "size", 3, None, f"{where}, box")
    elif shape.tag == "cylinder":
        size = tuple(_number(shape, k, None, f"{where}, cylinder") for k in ("radius", "length"))
    elif shape.tag == "sphere":
        size = (_number(shape, "radius", None, f"{where}, sphere"),)
    elif shape.tag == "mesh":
        filename = shape.get("filename") or ""
        if not filename:
            raise InputError(f"{where}, mesh: no filename.")
        size = _numbers(shape, "scale", 3, (1.0, 1.0, 1.0), f"{where}, mesh")
    else:
        raise InputError(
            f"{where}: geometry <{shape.tag}> is unknown; allowed are box, cylinder, sphere, mesh."
        )
    if shape.tag != "mesh" and min(size) <= 0.0:
        raise InputError(f"{where}, {shape.tag}: size {size}; every length must be positive.")
    color = None
    material = element.find("material")
    if material is not None:
        color = _own_color(material, where) or colors.get(material.get("name") or "")
    return Geometry(shape.tag, size, filename, _origin(element, where), color)


def _own_color(material: ET.Element, where: str) -> Color | None:
    element = material.find("color")
    if element is None:
        return None
    rgba = _numbers(element, "rgba", 4, None, f"{where}, material color")
    r, g, b = (round(255 * min(max(c, 0.0), 1.0)) for c in rgba[:3])
    return (r, g, b)


def _joint(element: ET.Element, file: str) -> UrdfJoint:
    name = _name(element, "joint", file)
    where = f"{file}: joint '{name}'"
    kind = element.get("type") or ""
    if kind not in _JOINT_TYPES:
        raise InputError(f"{where}: type '{kind}'; allowed are {', '.join(_JOINT_TYPES)}.")
    ends = []
    for tag in ("parent", "child"):
        end = element.find(tag)
        link = None if end is None else end.get("link")
        if not link:
            raise InputError(f"{where}: no <{tag} link=...>.")
        ends.append(link)
    axis_element = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0])  # the URDF default
    if axis_element is not None:
        axis = np.array(_numbers(axis_element, "xyz", 3, (1.0, 0.0, 0.0), f"{where}, axis"))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise InputError(f"{where}, axis: {axis.tolist()}; it must not be zero.")
    limit = element.find("limit")
    lower, upper, velocity = _limit(limit, kind, where)
    effort = None if limit is None else _effort(limit, where)
    T = _origin(element, where)
    return UrdfJoint(name, kind, ends[0], ends[1], T, axis / length, lower, upper, velocity, effort)


def _effort(limit: ET.Element, where: str) -> float | None:
    """None where none is stated; URDF wants one in any case, so that 0 says nothing."""
    effort = _number(limit, "effort", math.nan, f"{where}, limit")
    if effort < 0.0:
        raise InputError(f"{where}, limit effort: {effort}; it must not be negative.")
    return effort if effort > 0.0 else None


def _limit(
    limit: ET.Element | None, kind: str, where: str
) -> tuple[float | None, float | None, float | None]:
    if limit is None:
        if kind in ("revolute", "prismatic"):
            raise InputError(f"{where}: a {kind} joint needs <limit lower=... upper=...>.")
        return None, None, None
    velocity = _number(limit, "velocity", math.nan, f"{where}, limit")
    if velocity < 0.0:
        raise InputError(f"{where}, limit velocity: {velocity}; it must not be negative.")
    stated = None if math.isnan(velocity) else velocity
    if kind not in ("revolute", "prismatic"):
        return None, None, stated
    lower = _number(limit, "lower", 0.0, f"{where}, limit")
    upper = _number(limit, "upper", 0.0, f"{where}, limit")
    if lower > upper:
        raise InputError(f"{where}, limit: lower {lower} is above upper {upper}.")
    return lower, upper, stated


def _origin(element: ET.Element, where: str) -> Array:
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    xyz = _numbers(origin, "xyz", 3, (0.0, 0.0, 0.0), f"{where}, origin")
    roll, pitch, yaw = _numbers(origin, "rpy", 3, (0.0, 0.0, 0.0), f"{where}, origin")
    # URDF: fixed-axis roll, pitch, yaw, R = Rz(yaw) Ry(pitch) Rx(roll).
    R = rotation.rz(yaw) @ rotation.ry(pitch) @ rotation.rx(roll)
    return transform.make(R, np.array(xyz))


def _name(element: ET.Element, kind: str, file: str) -> str:
    name = element.get("name")
    if not name:
        raise InputError(f"{file}: a <{kind}> has no name.")
    return name


def _number(element: ET.Element, key: str, default: float | None, where: str) -> float:
    text = element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{where}: no '{key}'; a number is needed.")
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}, {key}: '{text}' is not a finite number.")
    return value


def _numbers(
    element: ET.Element, key: str, count: int, default: tuple[float, ...] | None, where: str
) -> tuple[float, ...]:
    text = element.get(key)
    if text is None:
        if default is None:
            raise InputError(f"{where}: no '{key}'; {count} numbers are needed.")
        return default
    try:
        values = tuple(float(word) for word in text.split())
    except ValueError:
        values = ()
    if len(values) != count or not all(math.isfinite(v) for v in values):
        raise InputError(f"{where}, {key}: '{text}'; {count} finite numbers are needed.")
    return values
