"""A Zenoh configuration file under the program's own settings, and its certificates looked at.

Zenoh tries for ever to connect and says why it fails in its own log only; what is wrong with a
certificate is found here first, and said in one sentence.
"""

from __future__ import annotations

import json
import re
import socket
import ssl
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import zenoh

from backend.errors import InputError
from backend.shell.link.certificates import read_certificate
from backend.shell.private_file import check_private

_CERTIFICATES = ("root_ca_certificate", "listen_certificate", "connect_certificate")
_KEYS = ("listen_private_key", "connect_private_key")
_TLS = "transport/link/tls"
_ADDRESS = re.compile(r"tls/(\[[^\]]+\]|[^:]+):(\d+)")
REACH = 1.0  # for an answer to the first look at a partner [s]


def read_config(path: Path) -> Any:
    """The zenoh.Config of a file, its paths made absolute. Raises InputError."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file; a Zenoh configuration is needed.") from None
    try:
        config = zenoh.Config.from_json5(text)
    except zenoh.ZError as error:
        words = " ".join(str(error).replace("|", " ").split())
        raise InputError(f"{path}: is not a Zenoh configuration: {words}.") from None
    tls = json.loads(config.get_json(_TLS))
    for field in (*_CERTIFICATES, *_KEYS):
        if tls.get(field):
            tls[field] = str(path.absolute().parent / tls[field])
            config.insert_json5(f"{_TLS}/{field}", json.dumps(tls[field]))
    for field in _CERTIFICATES:
        if tls.get(field):
            _named(path, field, lambda file: read_certificate(file), Path(tls[field]))
    for field in _KEYS:
        if tls.get(field):
            _named(path, field, check_private, Path(tls[field]))
    return config


def stated(config: Any, side: str) -> list[str]:
    """The endpoints to "listen" on or to "connect" to; given by mode, those of every mode."""
    endpoints = json.loads(config.get_json(f"{side}/endpoints")) or []
    if isinstance(endpoints, dict):
        endpoints = [one for several in endpoints.values() for one in several]
    return [str(one) for one in endpoints]


def check_partners(path: Path, config: Any, endpoints: Iterable[str]) -> None:
    """Looks once at each partner that answers. Raises InputError where TLS cannot succeed.

    Partners that are not there yet are no matter: Zenoh tries again.
    """
    tls = json.loads(config.get_json(_TLS))
    if not tls.get("root_ca_certificate"):
        return
    context = ssl.create_default_context(cafile=tls["root_ca_certificate"])
    context.check_hostname = bool(tls.get("verify_name_on_connect", True))
    if tls.get("connect_certificate") and tls.get("connect_private_key"):
        try:
            context.load_cert_chain(tls["connect_certificate"], tls["connect_private_key"])
        except ssl.SSLError:
            raise InputError(
                f"{path}: connect_private_key is not the key of connect_certificate."
            ) from None
    for endpoint in endpoints:
        found = _ADDRESS.match(endpoint)
        if found is not None:
            _look(path, endpoint, context, found[1].strip("[]"), int(found[2]))


def _look(path: Path, endpoint: str, context: ssl.SSLContext, host: str, port: int) -> None:
    try:
        with (
            socket.create_connection((host, port), timeout=REACH) as plain,
            context.wrap_socket(plain, server_hostname=host) as secure,
        ):
            secure.settimeout(REACH / 4)
            secure.recv(1)  # a refusal of our certificate comes after the handshake
    except ssl.SSLCertVerificationError as error:
        raise InputError(
            f"{path}: {endpoint}: its certificate is not accepted: "
            f"{error.verify_message.rstrip('.')}."
        ) from None
    except ssl.SSLError as error:
        alert = re.search(r"alert ([a-z ]+)", str(error))
        if alert is not None:
            raise InputError(
                f"{path}: {endpoint} does not accept connect_certificate ({alert[1].strip()}); "
                "did the same authority sign it, and is it still valid there?"
            ) from None
    except OSError:
        return  # not there, or silent: it has not refused


def _named(path: Path, field: str, check: Any, file: Path) -> None:
    try:
        check(file)
    except InputError as error:
        raise InputError(f"{path}: {field}: {error}") from None
