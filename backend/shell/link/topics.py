"""The one table of everything on the wire.

Publishers, subscribers, the recorder and the documentation read it. Keys are ROS topic names, so a
ROS 2 machine behind zenoh-bridge-ros2dds connects as it is. Congestion control is the same for all
rows of one priority, because a blocking message holds up the droppable ones of its priority.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum


class Direction(Enum):
    FROM_MACHINE = "machine → cockpit"
    TO_MACHINE = "cockpit → machine"
    FROM_COCKPIT = "cockpit → others"


class Priority(Enum):
    """Zenoh's priorities, highest first; the names are Zenoh's own."""

    REAL_TIME = "REAL_TIME"
    INTERACTIVE_HIGH = "INTERACTIVE_HIGH"
    INTERACTIVE_LOW = "INTERACTIVE_LOW"
    DATA_HIGH = "DATA_HIGH"
    DATA = "DATA"
    DATA_LOW = "DATA_LOW"
    BACKGROUND = "BACKGROUND"


class Congestion(Enum):
    DROP = "DROP"
    BLOCK = "BLOCK"


@dataclass(frozen=True)
class Topic:
    """One row. template: key with `{machine}` and at most one more field, which fills one segment.

    type: ROS 2 type in CDR, "JSON" or "bytes". max_bytes: larger messages are malformed.
    queryable: asked for, not published.
    """

    name: str
    template: str
    type: str
    rate: str  # [Hz], for the reader
    priority: Priority
    congestion: Congestion
    express: bool  # sent at once, not batched with others
    recorded: bool
    direction: Direction
    max_bytes: int
    description: str
    queryable: bool = False

    @property
    def of_machine(self) -> bool:
        return self.template.startswith("{machine}/")


def _pose(name: str, template: str, type_: str, rate: str, description: str) -> Topic:
    """What a pose is made from: fresh or worthless, so never queued behind a full link."""
    return Topic(
        name=name,
        template=template,
        type=type_,
        rate=rate,
        priority=Priority.INTERACTIVE_HIGH,
        congestion=Congestion.DROP,
        express=True,
        recorded=True,
        direction=Direction.FROM_MACHINE,
        max_bytes=16_384,
        description=description,
    )


def _order(name: str, template: str, type_: str, description: str) -> Topic:
    """What moves a machine: repeated with a time-to-live, and late is worthless."""
    return Topic(
        name=name,
        template=template,
        type=type_,
        rate="20–50",
        priority=Priority.REAL_TIME,
        congestion=Congestion.DROP,
        express=True,
        recorded=True,
        direction=Direction.TO_MACHINE,
        max_bytes=16_384,
        description=description,
    )


def _asked(name: str, template: str, type_: str, max_bytes: int, description: str) -> Topic:
    """What a machine answers at once."""
    return Topic(
        name=name,
        template=template,
        type=type_,
        rate="2",
        priority=Priority.INTERACTIVE_HIGH,
        congestion=Congestion.DROP,
        express=True,
        recorded=False,
        direction=Direction.FROM_MACHINE,
        max_bytes=max_bytes,
        description=description,
        queryable=True,
    )


def _concluded(name: str, template: str, priority: Priority, rate: str, description: str) -> Topic:
    """What a backend concluded, for other hosts. Only warnings may block: none may be lost."""
    blocking = priority is Priority.DATA_HIGH
    return Topic(
        name=name,
        template=template,
        type="bytes" if "{" in template else "JSON",
        rate=rate,
        priority=priority,
        congestion=Congestion.BLOCK if blocking else Congestion.DROP,
        express=blocking,
        recorded="{" not in template,  # images follow from the poses
        direction=Direction.FROM_COCKPIT,
        max_bytes=16_777_216,
        description=description,
    )


TOPICS: tuple[Topic, ...] = (
    _pose(
        "joint_states",
        "{machine}/joint_states",
        "sensor_msgs/msg/JointState",
        "10–200",
        "joint angles [rad] by URDF name or role, or strokes [m] by cylinder (`boom_cylinder`); "
        "velocities [rad/s, m/s] if known",
    ),
    _pose(
        "imu",
        "{machine}/imu/{link}",
        "sensor_msgs/msg/Imu",
        "≤ 200",
        "attitude of one link in east-north-up; `imu/base` gives pitch and roll of the tracks",
    ),
    _pose(
        "gnss_fix",
        "{machine}/gnss/fix",
        "sensor_msgs/msg/NavSatFix",
        "5–20",
        "antenna position: latitude, longitude [deg], ellipsoidal height [m]",
    ),
    _pose(
        "gnss_heading",
        "{machine}/gnss/heading",
        "sensor_msgs/msg/Imu",
        "5–20",
        "heading as an orientation in east-north-up, yaw counter-clockwise from east",
    ),
    _pose(
        "gnss_projected",
        "{machine}/gnss/projected",
        "geometry_msgs/msg/PointStamped",
        "5–20",
        "antenna position already in the site's projected CRS [m]; instead of gnss/fix",
    ),
    Topic(
        name="points",
        template="{machine}/points",
        type="sensor_msgs/msg/PointCloud2",
        rate="10",
        priority=Priority.DATA_LOW,
        congestion=Congestion.DROP,
        express=False,
        recorded=True,
        direction=Direction.FROM_MACHINE,
        max_bytes=33_554_432,
        description="LiDAR points in the frame named by the header [m]",
    ),
    _order(
        "cmd",
        "{machine}/cmd",
        "cockpit_msgs/msg/JointVelocityCommand",
        "joint and track velocities with sequence, time-to-live and the lease's token; "
        "the machine stops by itself when they cease",
    ),
    _order(
        "limits",
        "{machine}/limits",
        "cockpit_msgs/msg/MotionLimits",
        "fractions of full speed per motion and direction, with sequence and "
        "time-to-live; without fresh ones the machine stands still",
    ),
    _asked(
        "lease",
        "{machine}/lease",
        "JSON",
        4_096,
        "request, refresh, release, hand over or take over the machine's lease; the answer holds "
        "the fencing token that commands must carry",
    ),
    Topic(
        name="status",
        template="{machine}/status",
        type="cockpit_msgs/msg/AgentStatus",
        rate="10",
        priority=Priority.INTERACTIVE_LOW,
        congestion=Congestion.DROP,
        express=False,
        recorded=True,
        direction=Direction.FROM_MACHINE,
        max_bytes=16_384,
        description="the machine agent's mode, holder, applied limit and age of the last command",
    ),
    _asked(
        "clock",
        "{machine}/clock",
        "builtin_interfaces/msg/Time",
        64,
        "the machine's clock, asked for by round trips; without it ages are by arrival",
    ),
    Topic(
        name="camera",
        template="{machine}/camera/{camera}",
        type="sensor_msgs/msg/CompressedImage",
        rate="5",
        priority=Priority.DATA_LOW,
        congestion=Congestion.DROP,
        express=False,
        recorded=False,
        direction=Direction.FROM_MACHINE,
        max_bytes=1_048_576,
        description="the newest picture of one camera, a JPEG stamped with the time it shows; "
        "asked for, one at a time, while somebody watches",
        queryable=True,
    ),
    Topic(
        name="truth",
        template="{machine}/truth",
        type="cockpit_msgs/msg/TrueState",
        rate="50",
        priority=Priority.BACKGROUND,
        congestion=Congestion.DROP,
        express=False,
        recorded=False,
        direction=Direction.FROM_MACHINE,
        max_bytes=16_384,
        description="simulated machines only: the state without noise or delay, for tests",
    ),
    _concluded(
        "snapshot",
        "cockpit/snapshot",
        Priority.DATA,
        "10",
        "what the backend concluded: poses, distances, concerns",
    ),
    _concluded(
        "alarm",
        "cockpit/alarm",
        Priority.DATA_HIGH,
        "on change",
        "alarms that came, changed or went",
    ),
    _concluded(
        "image",
        "cockpit/image/{kind}",
        Priority.DATA_LOW,
        "10",
        "C-space images, stamped with the time of the state they were computed from",
    ),
)

_BY_NAME = {topic.name: topic for topic in TOPICS}
_FIELD = re.compile(r"\{(\w+)\}")
_PATTERNS = [
    (topic, re.compile(_FIELD.sub(r"(?P<\1>[^/]+)", topic.template.removeprefix("{machine}/"))))
    for topic in TOPICS
    if topic.of_machine
]


def topic(name: str) -> Topic:
    """The row called `name`; KeyError when there is none."""
    return _BY_NAME[name]


def key(name: str, machine: str = "", **fields: str) -> str:
    """The Zenoh key of a row. machine: the machine's key prefix."""
    return _BY_NAME[name].template.format(machine=machine, **fields)


def match(suffix: str) -> tuple[Topic, dict[str, str]] | None:
    """The row whose key below a machine's prefix is `suffix` ("imu/base"), and its fields.

    None when the table has no such row.
    """
    for row, pattern in _PATTERNS:
        found = pattern.fullmatch(suffix)
        if found:
            return row, found.groupdict()
    return None
