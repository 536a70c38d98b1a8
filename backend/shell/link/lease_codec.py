"""Requests for a lease, and the answers, as JSON."""

from __future__ import annotations

import msgspec

from backend.control.lease import Answer, Kind, Request
from backend.shell.link.codec import DecodeError
from backend.shell.link.topics import topic


class _Asked(msgspec.Struct, forbid_unknown_fields=True):
    kind: Kind
    who: str
    role: str = "operator"
    token: int = 0
    to: str = ""
    reason: str = ""


def encode_request(request: Request) -> bytes:
    """JSON, as the lease's queryable takes it."""
    return msgspec.json.encode(request)


def decode_request(payload: bytes) -> Request:
    """Raises DecodeError for anything that is no request."""
    if len(payload) > topic("lease").max_bytes:
        raise DecodeError(f"lease: {len(payload)} bytes")
    try:
        asked = msgspec.json.decode(payload, type=_Asked)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise DecodeError(f"lease: {error}") from error
    return Request(asked.kind, asked.who, asked.role, asked.token, asked.to, asked.reason)


def encode_answer(answer: Answer) -> bytes:
    return msgspec.json.encode(answer)


def decode_answer(payload: bytes) -> Answer:
    """Raises DecodeError for anything that is no answer."""
    try:
        return msgspec.json.decode(payload, type=Answer)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise DecodeError(f"lease: {error}") from error
