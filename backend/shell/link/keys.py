"""Everything that a site needs for an authenticated link: one folder per party."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from backend.errors import InputError
from backend.shell.link.access import Party, Role, access_control
from backend.shell.link.certificates import (
    CA_CERTIFICATE,
    CERTIFICATE,
    KEY,
    issue,
    make_authority,
    read_authority,
    read_certificate,
    write_authority,
)
from backend.site.site import Site

AUTHORITY = "authority"
"""Folder of the authority's key; it belongs on none of the site's computers."""
CONFIG = "link.json5"
PORT = 7447
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}")
_HOST = re.compile(r"\[?[0-9A-Fa-f:.]+\]?|[A-Za-z0-9](?:[A-Za-z0-9.-]{0,251}[A-Za-z0-9])?")


@dataclass(frozen=True)
class Backend:
    """hosts: names and addresses under which machines connect to it; the first one is used."""

    name: str
    hosts: tuple[str, ...]


def read_backend(text: str) -> Backend:
    """NAME=HOST,HOST. Raises InputError."""
    name, _, hosts = text.partition("=")
    found = tuple(host.strip() for host in hosts.split(",") if host.strip())
    if not _NAME.fullmatch(name) or not found or not all(map(_HOST.fullmatch, found)):
        raise InputError(
            f"--backend: {text!r}; allowed is NAME=HOST,HOST with the names or addresses under "
            "which machines reach it, such as cockpit=192.168.1.5,cockpit.local."
        )
    return Backend(name, found)


def parties_of(
    site: Site, backends: Iterable[Backend], listeners: Iterable[str]
) -> tuple[Party, ...]:
    """All parties of a site. Raises InputError where two have one name."""
    parties = [Party(m.name, Role.MACHINE, m.prefix) for m in site.machines]
    parties += [Party(backend.name, Role.BACKEND) for backend in backends]
    for name in listeners:
        if not _NAME.fullmatch(name):
            raise InputError(f"--listener: {name!r}; allowed are letters, digits, - and _.")
        parties.append(Party(name, Role.LISTENER))
    names = [party.name for party in parties] + [AUTHORITY]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f'{site.path}: "{name}" is the name of two parties; machines, backends and '
                f'listeners need different names, and none may be called "{AUTHORITY}".'
            )
    return tuple(parties)


def make_keys(
    site: Site,
    out: Path,
    backends: tuple[Backend, ...],
    listeners: tuple[str, ...] = (),
    days: int = 365,
    renew: bool = False,
    port: int = PORT,
) -> dict[str, bool]:
    """Writes `out`; whether each party got a new certificate. Raises InputError.

    An authority that is there signs again, and a certificate that is there and valid stays, unless
    `renew`; configurations are always written anew, for they follow from the site.
    """
    parties = parties_of(site, backends, listeners)
    if (out / AUTHORITY).is_dir():
        authority = read_authority(out / AUTHORITY)
    else:
        authority = make_authority(site.name)
        write_authority(out / AUTHORITY, authority)
        renew = True  # what another authority signed is worth nothing
    hosts = {backend.name: backend.hosts for backend in backends}
    made = {}
    for party in parties:
        folder = out / party.name
        made[party.name] = renew or not _stands(folder)
        if made[party.name]:
            issue(folder, authority, party.name, hosts.get(party.name, ()), days)
        text = json.dumps(configuration(party, parties, backends, port), indent=2)
        (folder / CONFIG).write_text(_words(party) + text + "\n", encoding="utf-8")
    return made


def configuration(
    party: Party, parties: tuple[Party, ...], backends: tuple[Backend, ...], port: int = PORT
) -> dict[str, Any]:
    """A party's Zenoh configuration; file names are relative to the file's own folder."""
    backend = party.role is Role.BACKEND
    to_backends = [f"tls/{_endpoint_host(b.hosts[0])}:{port}" for b in backends]
    listen = [f"tls/0.0.0.0:{port}"] if backend else []
    return {
        "mode": "router" if backend else "peer",
        "listen": {"endpoints": listen},
        "connect": {"endpoints": [] if backend else to_backends[:1]},
        "scouting": {"multicast": {"enabled": False}},
        "transport": {
            "link": {
                "protocols": ["tls"],
                "tls": {
                    "root_ca_certificate": CA_CERTIFICATE,
                    "enable_mtls": True,
                    "verify_name_on_connect": True,
                    "close_link_on_expiration": True,
                    "listen_certificate": CERTIFICATE,
                    "listen_private_key": KEY,
                    "connect_certificate": CERTIFICATE,
                    "connect_private_key": KEY,
                },
            }
        },
        "access_control": access_control(party, parties),
    }


def _stands(folder: Path) -> bool:
    try:
        read_certificate(folder / CERTIFICATE)
    except InputError:
        return False
    return (folder / KEY).is_file()


def _endpoint_host(host: str) -> str:
    return f"[{host.strip('[]')}]" if ":" in host else host


def _words(party: Party) -> str:
    return (
        f"// Zenoh for the {party.role.value} {party.name!r}: TLS on both sides, and what each\n"
        "// certificate may say. Paths are relative to this file. Made anew by `cockpit keys`.\n"
    )
