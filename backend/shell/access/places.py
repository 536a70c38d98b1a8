"""Where the files of the access control are, and writing them for their owner only."""

from __future__ import annotations

import os
import secrets
from pathlib import Path

NAME = "excavator-cockpit"


def config_folder() -> Path:
    """The user's XDG configuration folder of this program."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / NAME


def state_folder() -> Path:
    """The user's XDG state folder of this program."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / NAME


def write_private(path: Path, content: bytes) -> None:
    """Replaces a file at once, with mode 0600 from the start. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    descriptor = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def others_may(path: Path) -> int:
    """The bits of a file's mode that let others than its owner do anything. Raises OSError."""
    return path.stat().st_mode & 0o077
