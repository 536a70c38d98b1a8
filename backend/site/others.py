"""Tables of a site file on other programs' recordings."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import Field

from backend.site.base import Name, RosTopic, Table


class MachineTopics(Table):
    """ROS 2 topics that one machine's streams have in other people's recordings.

    A stream that is not named is looked for under its own key, "/left/joint_states"; imu: by link
    ("base", "boom"). One topic may serve two streams of one machine, as an INS's orientation does.
    """

    joint_states: RosTopic | None = None
    gnss_fix: RosTopic | None = None
    gnss_heading: RosTopic | None = None
    gnss_projected: RosTopic | None = None
    points: RosTopic | None = None
    imu: dict[Name, RosTopic] = Field(default_factory=dict)

    @property
    def streams(self) -> dict[str, str]:
        """Topic by stream: "joint_states", "gnss/fix", "imu/base", ..."""
        named = {
            "joint_states": self.joint_states,
            "gnss/fix": self.gnss_fix,
            "gnss/heading": self.gnss_heading,
            "gnss/projected": self.gnss_projected,
            "points": self.points,
        }
        imus = {f"imu/{link}": topic for link, topic in self.imu.items()}
        return {stream: topic for stream, topic in named.items() if topic} | imus


class Can(Table):
    """CAN logs. map: which signal is what; a path seen from the site file, see scenes/can."""

    map: Annotated[str, Field(min_length=1)] | None = None


def refuse_shared_topics(machines: Iterable[tuple[str, MachineTopics]]) -> None:
    """A topic carries one machine's data. Raises ValueError, for pydantic."""
    owners: dict[str, str] = {}
    for name, topics in machines:
        for topic in topics.streams.values():
            owner = owners.setdefault(topic, name)
            if owner != name:
                raise ValueError(
                    f'machine has the topic "{topic}" for "{owner}" and for "{name}"; '
                    "allowed is one machine a topic"
                )
