"""Files that only their owner may read."""

from __future__ import annotations

import os
from pathlib import Path

from backend.errors import InputError


def check_private(path: Path) -> None:
    """Raises InputError for a file that cannot be read, or that others may read, too."""
    try:
        mode = path.stat().st_mode
        path.open("rb").close()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    if os.name == "posix" and mode & 0o077:
        raise InputError(f"{path}: can be read by others; allowed is mode 0600.")
