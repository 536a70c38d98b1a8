"""What the program logs, on stderr: in words, or as JSON lines for a log collector."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime
from typing import Annotated

import typer

from backend.errors import InputError

LEVELS = ("debug", "info", "warning", "error")
WORDS = "%(asctime)s %(levelname)s %(name)s: %(message)s"


class JsonLines(logging.Formatter):
    """One JSON object a line: time (UTC, RFC 3339), level, logger, thread, message; error with its
    traceback, where there is one; and whatever was given as `extra`.
    """

    def format(self, record: logging.LogRecord) -> str:
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        line = {
            "time": time.replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "thread": record.threadName,
            "message": record.getMessage(),
        }
        if record.exc_info:
            line["error"] = self.formatException(record.exc_info)
        known = vars(logging.makeLogRecord({})).keys() | {"message", "asctime"}
        line |= {key: value for key, value in vars(record).items() if key not in known}
        return json.dumps(line, ensure_ascii=False, default=str)


def set_up(level: str | None, as_json: bool) -> None:
    """For the whole process, once at its start; without either, Python's own way stays.

    Raises InputError for an unknown level.
    """
    if level is not None and level not in LEVELS:
        raise InputError(f'--log-level "{level}" is unknown; allowed are {", ".join(LEVELS)}.')
    root = logging.getLogger()
    if level is not None:
        root.setLevel(level.upper())
    if level is None and not as_json:
        return
    ours = [handler for handler in root.handlers if handler.get_name() == "cockpit"]
    handler = ours[0] if ours else logging.StreamHandler(sys.stderr)
    handler.set_name("cockpit")
    if as_json or not ours:  # --log-level beside --log-json does not undo it
        handler.setFormatter(JsonLines() if as_json else logging.Formatter(WORDS))
    if not ours:
        root.addHandler(handler)


def _json(value: bool) -> bool:
    set_up(None, value)
    return value


def _level(value: str | None) -> str | None:
    set_up(value, False)
    return value


# The options set up logging themselves, so that a command needs only to have them.
LogJson = Annotated[
    bool, typer.Option("--log-json", help="Log as JSON lines on stderr.", callback=_json)
]
LogLevel = Annotated[
    str | None, typer.Option(help=f"Log from here on: {', '.join(LEVELS)}.", callback=_level)
]
