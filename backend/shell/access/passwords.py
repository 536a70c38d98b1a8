"""Passwords as Argon2id hashes (RFC 9106, its parameters for little memory)."""

from __future__ import annotations

import functools
import secrets
import threading
import unicodedata

import argon2

from backend.errors import InputError

SHORTEST, LONGEST = 10, 1024  # characters
_HASHER = argon2.PasswordHasher.from_parameters(argon2.profiles.RFC_9106_LOW_MEMORY)
_ONE_AT_A_TIME = threading.Lock()  # each takes 64 MiB and 0.2 s, beside a loop of 50 Hz


def hashed(password: str) -> str:
    """The hash to keep. Raises InputError for a password that is too short or too long."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise InputError(
            f"password: {len(password)} characters; allowed are {SHORTEST} to {LONGEST}."
        )
    return _HASHER.hash(_normal(password))


def matches(kept: str | None, password: str) -> bool:
    """Whether a password is the one whose hash is kept. None (no such user) takes the same time."""
    with _ONE_AT_A_TIME:
        try:
            right = _HASHER.verify(kept or _nobodys(), _normal(password[:LONGEST]))
        except argon2.exceptions.VerificationError:
            return False
        except argon2.exceptions.InvalidHashError:
            return False
    return right and kept is not None


@functools.cache
def _nobodys() -> str:
    return _HASHER.hash(secrets.token_urlsafe())


def _normal(password: str) -> str:
    """The same letter typed on another keyboard is the same letter."""
    return unicodedata.normalize("NFC", password)
