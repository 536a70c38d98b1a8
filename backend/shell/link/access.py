"""Who may say what on the wire: Zenoh's access control, derived from the one topic table.

A party is known by its certificate's common name. Whatever no rule allows is refused: a machine
says only what its rows of the table say that machines say, under its own prefix, and hears only
what is meant for it. Backends are believed when they pass on what machines said, because a machine
may be connected to another backend than the one that asks.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from backend.shell.link.topics import TOPICS, Direction, Topic

FOREIGN_KEYS = ("*/gnss/*", "*/status")
"""Slow streams that betray machines the site does not list; backends listen to them."""

_FIELD = re.compile(r"\{\w+\}")


class Role(Enum):
    """listener: hears machines and backends, and says nothing."""

    MACHINE = "machine"
    BACKEND = "backend"
    LISTENER = "listener"


@dataclass(frozen=True)
class Party:
    """name: its certificate's common name; prefix: of a machine's keys."""

    name: str
    role: Role
    prefix: str = ""


def access_control(own: Party, parties: Iterable[Party]) -> dict[str, Any]:
    """The section `access_control` of `own`'s configuration. parties: all of the site, `own` too.

    The rules stand on both sides of every link: a party that was taken over can neither send more
    than the others accept, nor be sent more than its own rules accept.
    """
    everyone = tuple(parties)
    machines = [party.prefix for party in everyone if party.role is Role.MACHINE]
    rules: list[dict[str, Any]] = []
    subjects: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    alike: list[tuple[list[_Allowed], list[str]]] = []
    for other in everyone:
        allowed = _between(own, other, machines)
        if other.name == own.name or not allowed:
            continue
        for known, names in alike:
            if known == allowed:
                names.append(other.name)
                break
        else:
            alike.append((allowed, [other.name]))
    for allowed, names in alike:
        subject = ", ".join(names)
        mine = []
        for flow, messages, keys in allowed:
            rule = {
                "id": f"{subject}: {flow} {', '.join(messages)}",
                "permission": "allow",
                "flows": [flow],
                "messages": list(messages),
                "key_exprs": list(dict.fromkeys(keys)),
            }
            rules.append(rule)
            mine.append(rule["id"])
        subjects.append({"id": subject, "cert_common_names": names})
        policies.append({"rules": mine, "subjects": [subject]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


_Allowed = tuple[str, tuple[str, ...], list[str]]
_OTHER_WAY: Mapping[str, str] = {"ingress": "egress", "egress": "ingress"}


def _between(own: Party, other: Party, machines: list[str]) -> list[_Allowed]:
    """What `own` lets through from ("ingress") and to ("egress") `other`."""
    roles = {own.role, other.role}
    if roles == {Role.MACHINE, Role.BACKEND}:
        machine = own if own.role is Role.MACHINE else other
        rows = _of_machine("ingress", machine.prefix)
    elif roles == {Role.BACKEND, Role.LISTENER}:
        rows = _of_listener("ingress", machines)
    elif roles == {Role.BACKEND}:
        return _of_backend("ingress", machines) + _of_backend("egress", machines)
    else:
        return []  # machines and listeners have nothing to say to each other
    if other.role is Role.BACKEND:  # seen from the other end
        return [(_OTHER_WAY[flow], messages, keys) for flow, messages, keys in rows]
    return rows


def _of_machine(incoming: str, prefix: str) -> list[_Allowed]:
    """As a backend lets through, `incoming` being what comes from the machine."""
    said, told, asked = (_keys(rows, prefix) for rows in (_SAID, _TOLD, _ASKED))
    outgoing = _OTHER_WAY[incoming]
    return [
        (incoming, ("put",), said),
        (incoming, ("declare_subscriber",), told),
        (incoming, ("declare_queryable", "reply"), asked),
        (outgoing, ("put",), told),
        (outgoing, ("query",), asked),
        (outgoing, ("declare_subscriber",), [f"{prefix}/**", *said, *FOREIGN_KEYS]),
    ]


def _of_listener(incoming: str, machines: list[str]) -> list[_Allowed]:
    published = [key for prefix in machines for key in _keys((*_SAID, *_TOLD), prefix)]
    published += _keys(_CONCLUDED)
    below = [f"{prefix}/**" for prefix in machines] + ["cockpit/**"]
    return [
        (incoming, ("declare_subscriber",), [*below, *published]),
        (_OTHER_WAY[incoming], ("put",), published),
    ]


def _of_backend(flow: str, machines: list[str]) -> list[_Allowed]:
    published = [key for prefix in machines for key in _keys((*_SAID, *_TOLD), prefix)]
    published += _keys(_CONCLUDED)
    asked = [key for prefix in machines for key in _keys(_ASKED, prefix)]
    below = [f"{prefix}/**" for prefix in machines] + ["cockpit/**"]
    return [
        (flow, ("put",), published),
        (flow, ("declare_subscriber",), [*below, *published, *FOREIGN_KEYS]),
        (flow, ("query", "declare_queryable", "reply"), asked),
    ]


def _keys(rows: Iterable[Topic], prefix: str = "") -> list[str]:
    """Key expressions of rows; a field stands for any one segment."""
    return [_FIELD.sub("*", row.template.replace("{machine}", prefix)) for row in rows]


_ASKED = tuple(row for row in TOPICS if row.queryable)
_SAID = tuple(r for r in TOPICS if r.direction is Direction.FROM_MACHINE and not r.queryable)
_TOLD = tuple(row for row in TOPICS if row.direction is Direction.TO_MACHINE)
_CONCLUDED = tuple(row for row in TOPICS if row.direction is Direction.FROM_COCKPIT)
