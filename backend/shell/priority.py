"""Who goes first when processors are short: what moves machines, then what is seen, then the rest.

A system may not allow a program to go before others; then all begin alike.
"""

from __future__ import annotations

import contextlib
import os

FIRST = -10
"""Niceness of processes that a machine's motion depends on, a browser on the same computer after
them."""


def set_niceness(value: int) -> None:
    """Of this process, before it starts threads, which inherit it."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, value)
