"""The machine that avoids, in the terms of Sun 2020, as JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from backend.cspace.sun_images import SunState


def sun_state_document(now: SunState) -> dict[str, Any]:
    """Angles [rad], lengths [m] and verdicts of `SunState`, by its own names."""
    return asdict(now)
