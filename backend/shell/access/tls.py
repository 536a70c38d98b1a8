"""A certificate for HTTPS that somebody has."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path

from backend.errors import InputError
from backend.shell.access.places import others_may


@dataclass(frozen=True)
class Tls:
    """Files in PEM. cert: certificate, and the chain to its issuer; key: its private key."""

    cert: Path
    key: Path


def given(cert: Path, key: Path) -> Tls:
    """A certificate that somebody has. Raises InputError for files that do not fit."""
    for option, path in (("--cert", cert), ("--key", key)):
        if not path.is_file():
            raise InputError(f"{option}: {path} is no file; allowed is a file in PEM.")
    if others_may(key) & 0o007:
        raise InputError(
            f"--key: {key} can be read by everybody on this computer; allowed is mode 0600 "
            f'(chmod 600 "{key}").'
        )
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(cert, key, _no_password)
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", None) or str(error)
        raise InputError(
            f"--cert: {cert} and {key} are no certificate with its key ({reason}); "
            "allowed are both in PEM, the key without a password."
        ) from None
    return Tls(cert, key)


def _no_password() -> str:
    raise ValueError("the key has a password")
