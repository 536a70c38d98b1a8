"""Which topic of a recording is which stream of which machine.

Pure. A cockpit's own recordings and other people's ROS 2 recordings are read through it alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from backend.errors import InputError
from backend.shell.link.topics import Topic, match
from backend.shell.session.format import OWN
from backend.site.site import Site

_SHOWN = 8  # topics in one sentence


@dataclass(frozen=True)
class Stream:
    """One stream of one machine. suffix: its key below the machine's prefix, "gnss/fix"."""

    machine: str
    prefix: str
    suffix: str
    row: Topic
    fields: tuple[tuple[str, str], ...]  # of the key: ("link", "base")

    @property
    def topic(self) -> str:
        """The topic that a session of ours has for it."""
        return f"/{self.prefix}/{self.suffix}"


@dataclass(frozen=True)
class Mapped:
    """streams: by topic of the recording, more than one where an INS gives attitude and heading.

    unused: in words, what is of the site but not of use; lacking: what machines have no data for.
    unknown: topics that are of no machine of the site.
    """

    streams: dict[str, tuple[Stream, ...]]
    unused: tuple[str, ...]
    lacking: tuple[str, ...]
    unknown: tuple[str, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.unused, *self.lacking)


def stream_of(site: Site, topic: str) -> Stream | None:
    """The stream whose own name `topic` is ("/left/gnss/fix"); None when it is of no machine."""
    key = topic.removeprefix("/")
    for machine in site.machines:
        if key.startswith(machine.prefix + "/"):
            return _stream(machine.name, machine.prefix, key[len(machine.prefix) + 1 :])
    return None


def map_topics(site: Site, types: Mapping[str, str]) -> Mapped:
    """What the topics of a recording are. types: ROS 2 type by topic.

    A topic that the site file names under [machine.topics] is that stream, and a topic that has a
    stream's own name is it as well, unless the file names another that is in the recording.
    """
    streams: dict[str, list[Stream]] = {}
    notes: list[str] = []
    named: set[tuple[str, str]] = set()
    for machine in site.machines:
        for suffix, topic in machine.topics.streams.items():
            stream = _stream(machine.name, machine.prefix, suffix)
            if topic in types and stream is not None:
                named.add((machine.name, suffix))
                streams.setdefault(topic, []).append(stream)
    claimed = {topic for machine in site.machines for topic in machine.topics.streams.values()}
    unknown = []
    for topic in types:
        own = None if topic in claimed else stream_of(site, topic)
        if own is None:
            if topic not in streams and not topic.startswith(OWN):
                unknown.append(topic)
        elif (own.machine, own.suffix) in named:
            notes.append(f"{topic} is not used: the site file names another topic for it.")
        else:
            streams.setdefault(topic, []).append(own)
    fitting: dict[str, tuple[Stream, ...]] = {}
    for topic, found in streams.items():
        right = tuple(stream for stream in found if stream.row.type == types[topic])
        if right:
            fitting[topic] = right
        notes += [
            f"{topic} is not used: its type is {types[topic]}; allowed is {stream.row.type}."
            for stream in found
            if stream not in right
        ]
    return Mapped(fitting, tuple(notes), _missing(site, fitting), tuple(sorted(unknown)))


def refuse_nothing(mapped: Mapped, where: str) -> None:
    """Raises InputError when no topic of a recording is of a machine of the site."""
    if mapped.streams:
        return
    if mapped.unused and not mapped.unknown:
        raise InputError(f"{where}: {mapped.unused[0]}")
    present = ", ".join(mapped.unknown[:_SHOWN]) or "none"
    more = f" and {len(mapped.unknown) - _SHOWN} more" if len(mapped.unknown) > _SHOWN else ""
    raise InputError(
        f"{where}: none of its topics is of a machine of the site; there are {present}{more}. "
        "Name them under [machine.topics] in the site file."
    )


def _missing(site: Site, streams: Mapping[str, tuple[Stream, ...]]) -> tuple[str, ...]:
    """One sentence for each machine whose pose cannot be told from what is there."""
    notes = []
    for machine in site.machines:
        have = {s.suffix for found in streams.values() for s in found if s.machine == machine.name}
        lacking = [] if "joint_states" in have else ["joint_states"]
        if not have & {"gnss/fix", "gnss/projected"}:
            lacking.append("gnss/fix")
        if "gnss/heading" not in have:
            lacking.append("gnss/heading")
        if lacking:
            notes.append(
                f'machine "{machine.name}" has no {", ".join(lacking)} here, '
                "so its pose stays unknown."
            )
    return tuple(notes)


def _stream(machine: str, prefix: str, suffix: str) -> Stream | None:
    found = match(suffix)
    if found is None or found[0].queryable:
        return None
    return Stream(machine, prefix, suffix, found[0], tuple(found[1].items()))
