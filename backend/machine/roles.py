"""Which URDF joint is the swing, the boom, the stick, the bucket, the tilt, the rotator."""

from __future__ import annotations

import re

from backend.errors import InputError
from backend.machine.model import ROLES
from backend.machine.urdf import Description, UrdfJoint

_REQUIRED = ROLES[:4]
_PATTERNS = {
    "swing": r"swing|slew|swivel|turret|house|cabin|upper|body_?(yaw|rot)",
    "boom": r"boom",
    "stick": r"stick|dipper|(^|_)arm|jib",
    "bucket": r"bucket|shovel",
    "tilt": r"tilt",
    "rotate": r"rotat",
}
_NOT_AN_ACTUATOR = re.compile(
    r"(^|_)(end|tip|tcp|tooth|teeth|cyl\w*|rod|imu|gnss|gps|camera)(_|\d|$)"
)
# "boom_swing" and "boom_offset" turn the boom's bracket, "bucket_tilt" tilts the bucket.
_FOREIGN = {"swing": ("boom",), "boom": ("swing", "offset", "slew"), "bucket": ("tilt", "rotat")}
_END = re.compile(r"(^|_)(end|tip|tcp|tooth|teeth)(_|\d|$)")


def assign_roles(
    robot: Description, stated: dict[str, str], file: str
) -> tuple[dict[str, UrdfJoint], list[str]]:
    """The joint of each role that the machine has, and in words what was guessed.

    stated: role -> joint name, from the sidecar; it wins over the joints' names, which win over
    the structure (the first four joints of the longest chain). Raises InputError when swing, boom,
    stick and bucket cannot be told, or do not follow each other.
    """
    named = {joint.name: joint for joint in robot.joints}
    turning = [joint for joint in robot.joints if joint.type in ("revolute", "continuous")]
    roles: dict[str, UrdfJoint] = {}
    notes: list[str] = []
    for role, name in stated.items():
        if name not in named:
            raise InputError(
                f"{file}: joints.{role} = '{name}' is not a joint of the robot; its turning joints "
                f"are {_names(turning)}."
            )
        if named[name] not in turning:
            raise InputError(
                f"{file}: joints.{role} = '{name}' is {named[name].type}; it must be revolute or "
                f"continuous."
            )
        roles[role] = named[name]
    twice = {j.name for j in roles.values() if list(roles.values()).count(j) > 1}
    if twice:
        raise InputError(f"{file}: joint '{min(twice)}' has two roles under [joints].")
    _guess(roles, [j for j in turning if j.name not in {r.name for r in roles.values()}], notes)
    if any(role not in roles for role in _REQUIRED):
        _from_structure(robot, roles, notes)
    for role in _REQUIRED:
        if role not in roles:
            raise InputError(
                f"{file}: no joint for '{role}'; the turning joints are {_names(turning)}. Name it "
                f"under [joints] in the sidecar."
            )
    _check_chain(robot, roles, file)
    return {role: roles[role] for role in ROLES if role in roles}, notes


def marks_end(joint: UrdfJoint) -> bool:
    """True for the joint of a bucket-end or tooth marker."""
    return bool(_END.search(joint.name.lower()) or _END.search(joint.child.lower()))


def _guess(roles: dict[str, UrdfJoint], joints: list[UrdfJoint], notes: list[str]) -> None:
    for role, pattern in _PATTERNS.items():
        if role in roles:
            continue
        taken = {joint.name for joint in roles.values()}
        fits = [
            joint
            for joint in joints
            if joint.name not in taken
            and re.search(pattern, joint.name.lower())
            and not _NOT_AN_ACTUATOR.search(joint.name.lower())
            and not any(word in joint.name.lower() for word in _FOREIGN.get(role, ()))
        ]
        if len(fits) == 1:
            roles[role] = fits[0]
            notes.append(f"joint '{fits[0].name}' is taken as the {role}")


def _from_structure(robot: Description, roles: dict[str, UrdfJoint], notes: list[str]) -> None:
    chains = [_chain(robot, link.name) for link in robot.links]
    longest = max(chains, key=len)
    if len(longest) < 4:
        return
    first = dict(zip(_REQUIRED, longest[:4], strict=True))
    if any(role in roles and roles[role] != joint for role, joint in first.items()):
        return
    for role, joint in first.items():
        if role not in roles:
            roles[role] = joint
            notes.append(f"joint '{joint.name}' is taken as the {role} by its place in the chain")


def _chain(robot: Description, link: str) -> list[UrdfJoint]:
    """The turning joints between the root and a link, the root's first, markers left out."""
    carrier = {joint.child: joint for joint in robot.joints}
    chain: list[UrdfJoint] = []
    while link in carrier:
        joint = carrier[link]
        if joint.type in ("revolute", "continuous") and not marks_end(joint):
            chain.insert(0, joint)
        link = joint.parent
    return chain


def _check_chain(robot: Description, roles: dict[str, UrdfJoint], file: str) -> None:
    order = [roles[role] for role in ROLES if role in roles]
    chain = _chain(robot, order[-1].child)
    if order[-1] not in chain:
        chain.append(order[-1])
    places = [chain.index(joint) if joint in chain else -1 for joint in order]
    if -1 in places or places != sorted(places):
        found = ", ".join(f"{role} = '{joint.name}'" for role, joint in roles.items())
        raise InputError(
            f"{file}: the joints must follow each other from the tracks to the bucket as "
            f"{', '.join(role for role in ROLES if role in roles)}; got {found}."
        )


def _names(joints: list[UrdfJoint]) -> str:
    return ", ".join(f"'{joint.name}'" for joint in joints) or "none"
