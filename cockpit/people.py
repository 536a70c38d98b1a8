"""The people loop of a running cockpit, on sites where people are watched for."""

from __future__ import annotations

from backend.pipeline.config import Config
from backend.shell.link.receiver import Receiver
from backend.shell.people_loop import PeopleLoop, people_worker


def make_people(config: Config, receiver: Receiver) -> PeopleLoop | None:
    """None on a site where nobody watches for people."""
    if config.people is None:
        return None
    return PeopleLoop(config, receiver.take_clouds, people_worker(), receiver.refuse)
