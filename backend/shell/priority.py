"""Who goes first when processors are short: what moves machines, then what is seen, then the rest.

A system may not allow a program to go before others; then all begin alike.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

FIRST = -10
"""Niceness of processes that a machine's motion depends on, a browser on the same computer after
them."""

AFTER = 0
"""Of everything that nobody said anything about."""


def set_niceness(value: int) -> None:
    """Of this process, before it starts threads, which inherit it."""
    with contextlib.suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, value)


def thread_first() -> None:
    """The calling thread, from now on, before all others of its process, too: many short tasks of
    theirs would otherwise cut up each of its cycles. In real time where the system allows that
    (needs CAP_SYS_NICE or a limit `rtprio`), which what it starts does not inherit; else by
    niceness, where that is allowed; else not at all.
    """
    try:
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))
    except (OSError, AttributeError):
        set_niceness(2 * FIRST)  # Linux takes it for the calling thread alone


@contextlib.contextmanager
def going_first() -> Iterator[None]:
    """This process goes before others until the end of the block."""
    before = os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else 0
    set_niceness(FIRST)
    try:
        yield
    finally:
        set_niceness(before)
