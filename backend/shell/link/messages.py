"""The cockpit's own ROS 2 types, and their records.

What the standard lacks is defined here in ROS's own interface language, so that any ROS 2 machine
can build the package `cockpit_msgs` from it.
"""

from __future__ import annotations

from dataclasses import dataclass

from backend.spatial.types import Array

JOINT_VELOCITY_COMMAND = """\
# Wanted velocities. The machine obeys only while the newest command is younger than time_to_live,
# only with a sequence above the last one of this token, and never with an older token.
std_msgs/Header header
uint64 sequence
float64 time_to_live      # [s]
string holder             # who is in control
uint64 token              # fencing token of the holder's lease
string[] name             # joint names or roles; joints not named stand still
float64[] velocity        # [rad/s]
float64 travel_left       # [m/s], positive forwards
float64 travel_right      # [m/s]
"""

MOTION_LIMITS = """\
# How fast each motion may be, as fractions of full speed. The machine cuts every command to them;
# without limits younger than time_to_live it stands still, and so does what is not named.
std_msgs/Header header
uint64 sequence
float64 time_to_live      # [s]
uint64 token              # fencing token of the lease
string[] name             # joint names or roles, "track_left", "track_right"
float64[] negative        # 0..1
float64[] positive        # 0..1
"""

AGENT_STATUS = """\
# What the machine's own agent does.
std_msgs/Header header
string mode               # "remote", "stopped" or "hold"; simulated: "program", "rejoining", too
string holder             # of the lease, empty when nobody holds it
uint64 token              # the newest issued
uint64 sequence           # of the newest accepted command
float64 command_age       # [s], -1 when no command was ever accepted
float64 limit             # least fraction of full speed in any direction, 0..1
uint64 accepted
uint64 refused
"""

TRUE_STATE = """\
# A simulated machine's state, without noise or delay.
std_msgs/Header header
string[] name
float64[] position        # [rad]
float64[] velocity        # [rad/s]
geometry_msgs/Point base  # URDF root in the site's projected CRS [m]
float64 yaw               # of the tracks, counter-clockwise from grid east [rad]
float64 pitch             # positive raises the front [rad]
float64 roll              # [rad]
float64 travel_left       # [m/s]
float64 travel_right      # [m/s]
"""

DEFINITIONS = {
    "cockpit_msgs/msg/JointVelocityCommand": JOINT_VELOCITY_COMMAND,
    "cockpit_msgs/msg/MotionLimits": MOTION_LIMITS,
    "cockpit_msgs/msg/AgentStatus": AGENT_STATUS,
    "cockpit_msgs/msg/TrueState": TRUE_STATE,
}


@dataclass(frozen=True)
class Command:
    """Wanted velocities, as JOINT_VELOCITY_COMMAND. velocity: (n,) [rad/s]; travel [m/s]."""

    machine: str
    stamp: float
    arrival: float
    sequence: int
    time_to_live: float
    holder: str
    token: int
    names: tuple[str, ...]
    velocity: Array
    travel_left: float
    travel_right: float


@dataclass(frozen=True)
class MotionLimits:
    """Fractions of full speed, as MOTION_LIMITS. negative, positive: (k,) by name, 0..1."""

    machine: str
    stamp: float
    arrival: float
    sequence: int
    time_to_live: float
    token: int
    names: tuple[str, ...]
    negative: Array
    positive: Array


@dataclass(frozen=True)
class AgentStatus:
    """What a machine's agent reports, as AGENT_STATUS."""

    machine: str
    stamp: float
    arrival: float
    mode: str
    holder: str
    token: int
    sequence: int
    command_age: float  # [s], -1 before the first accepted command
    limit: float
    accepted: int
    refused: int


@dataclass(frozen=True)
class TrueState:
    """A simulated machine's true state, as TRUE_STATE. base: (3,) projected CRS [m]."""

    machine: str
    stamp: float
    arrival: float
    names: tuple[str, ...]
    position: Array  # (n,) [rad]
    velocity: Array  # (n,) [rad/s]
    base: Array
    yaw: float
    pitch: float
    roll: float
    travel_left: float  # [m/s]
    travel_right: float
