"""Log lines as JSON, each in one line."""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

from cockpit.logs import JsonLines


def line_of(message: str, *arguments: Any, **more: Any) -> dict[str, Any]:
    record = logging.getLogger("backend.shell.x").makeRecord(
        "backend.shell.x", logging.WARNING, "x.py", 1, message, arguments, more.get("exc_info")
    )
    vars(record).update(more.get("extra", {}))
    text = JsonLines().format(record)
    assert "\n" not in text
    found: dict[str, Any] = json.loads(text)
    return found


def test_a_line_says_when_who_how_bad_and_what() -> None:
    line = line_of("%s is gone\nfor good", "left", extra={"machine": "left", "odd": {1, 2}.copy})
    assert line["message"] == "left is gone\nfor good"
    assert line["level"] == "warning"
    assert line["logger"] == "backend.shell.x"
    assert line["machine"] == "left"
    assert line["time"].endswith("Z")
    assert "error" not in line


def test_a_traceback_stands_in_the_same_line() -> None:
    try:
        raise ValueError("no such thing")
    except ValueError:
        line = line_of("failed", exc_info=sys.exc_info())
    assert line["error"].splitlines()[-1] == "ValueError: no such thing"
