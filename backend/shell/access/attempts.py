"""How often somebody may try."""

from __future__ import annotations

import ipaddress
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable

MOST = 10_000  # keys that are remembered; the oldest are forgotten first


class Attempts:
    """At most `limit` attempts in `period` seconds for each key. clock: any seconds."""

    def __init__(
        self, limit: int, period: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._limit, self._period, self._clock = limit, period, clock
        self._times: OrderedDict[str, deque[float]] = OrderedDict()
        self._lock = threading.Lock()

    def take(self, key: str) -> float:
        """0.0 when there may be one more attempt, which then counts; else how long to wait [s]."""
        with self._lock:
            now = self._clock()
            times = self._times.setdefault(key, deque(maxlen=self._limit))
            self._times.move_to_end(key)
            while len(self._times) > MOST:
                self._times.popitem(last=False)
            if len(times) == self._limit and (wait := times[0] + self._period - now) > 0.0:
                return wait
            times.append(now)
            return 0.0

    def undo(self, key: str) -> None:
        """The last attempt was right and does not count."""
        with self._lock:
            if times := self._times.get(key):
                times.pop()

    def forget(self, key: str) -> None:
        """The last attempt was right: what was wrong before no longer counts."""
        with self._lock:
            self._times.pop(key, None)


def network(address: str) -> str:
    """What counts as one address: for IPv6 its /64, as one host has all of it."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv6Address):
        if found.ipv4_mapped is not None:
            return str(found.ipv4_mapped)
        return str(ipaddress.ip_network((found, 64), strict=False))
    return str(found)
