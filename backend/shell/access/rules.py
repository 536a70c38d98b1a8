"""What needs which role, and which page may ask. Pure; whatever is not named here is closed."""

from __future__ import annotations

from urllib.parse import urlsplit

from backend.control.person import OPERATOR, ROLES, VIEWER

LOGIN_PAGE, LOGIN, HEALTH, METRICS = "/login", "/api/login", "/api/health", "/metrics"
OPEN = frozenset(
    {
        *(LOGIN_PAGE, LOGIN, HEALTH, "/favicon.ico", "/static/icon.svg"),
        *("/static/css/login.css", "/static/js/login.js"),
    }
)
"""Answered without a session: what it takes to sign in, and whether the program is well."""

READS = frozenset({"GET", "HEAD", "OPTIONS"})
WITHOUT_EFFECT = frozenset({"/api/logout", "/api/whatif", "/api/session/diff"})
"""Posted to by viewers, too: none of these changes anything that others see."""


def needed_role(method: str, path: str) -> str | None:
    """The least role for a request; None when it is open to everybody."""
    if path in OPEN:
        return None
    return VIEWER if method in READS or path in WITHOUT_EFFECT else OPERATOR


def suffices(role: str, needed: str) -> bool:
    """Whether a role may do what another may."""
    return ROLES.index(role) >= ROLES.index(needed)


def same_origin(origin: str | None, host: str, secure: bool) -> bool:
    """Whether what asks is a page of this server, or no page at all.

    origin: as the browser says, None for programs, which are not a browser's page; host: as it
    was asked for; secure: over HTTPS, where a page that came without it is another's.
    """
    if origin is None:
        return True
    try:
        parts = urlsplit(origin)
    except ValueError:
        return False
    schemes = ("https",) if secure else ("http", "https")
    return bool(host) and parts.scheme in schemes and parts.netloc.lower() == host.lower()
