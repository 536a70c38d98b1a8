"""The cab's camera of a simulated machine on the wire: a picture for whoever asks.

Nothing is drawn, and nothing of the partners is heard, while nobody asks. A thread of its own
draws; the picture travels as long as everything else that the machine sends.
"""

from __future__ import annotations

import io
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from backend.machine.model import Machine
from backend.shell.link.encode import encode_picture
from backend.shell.link.topics import key, topic
from backend.shell.sim.cab import Seen, Surroundings, cab_view
from backend.shell.sim.dynamics import SimState
from backend.shell.sim.partners import Partners
from backend.shell.sim.walkers import boxes_around, people_at, vehicles_at
from backend.site.site import Site

AT_ONCE = 8  # questions that wait; more are not answered
PERIOD = 0.1  # between two pictures, at least [s]
UNWATCHED = 3.0  # without a question the partners are not listened to any more [s]
QUALITY = 70


class CabCamera:
    """Answers for all cameras of `name` that the site asks the machine for.

    state: the machine's true state, None before the first, and its stamp [s]; cut: whether the
    radio is down, then nothing is answered; beside: opens a session on which other machines are
    heard, None for no other machines in the picture; schedule: the schedule's time of a stamp, None
    for nobody who walks in the picture.
    """

    def __init__(
        self,
        session: Any,
        site: Site,
        name: str,
        machine: Machine,
        state: Callable[[], tuple[SimState, float] | None],
        cut: Callable[[], bool],
        beside: Callable[[], Any] | None = None,
        schedule: Callable[[float], float] | None = None,
    ) -> None:
        self._session, self._site, self._name, self._machine = session, site, name, machine
        self._state, self._cut, self._schedule = state, cut, schedule
        self._asked: deque[Any] = deque()
        self._wake = threading.Event()
        self._closing = False
        self._partners = Partners(site, name, machine, beside)
        self._surroundings = Surroundings(site.obstacle_boxes())
        entry = site.machine(name)
        self._declared = [
            session.declare_queryable(
                key("camera", entry.prefix, camera=camera.name), self._on_query
            )
            for camera in entry.camera
            if camera.kind == "link" and camera.name
        ]
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)
        if self._declared:
            self._thread.start()

    def close(self) -> None:
        for declared in self._declared:
            declared.undeclare()
        self._closing = True
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)
        self._partners.listen(False)

    def _on_query(self, query: Any) -> None:
        if self._cut() or self._closing or len(self._asked) >= AT_ONCE:
            query.drop()
            return
        self._asked.append(query)
        self._wake.set()

    def _run(self) -> None:
        while not self._closing:
            asked = self._wake.wait(UNWATCHED)
            self._wake.clear()
            self._partners.listen(asked)
            if asked and self._asked:
                began = time.monotonic()
                self._answer()
                time.sleep(max(0.0, PERIOD - (time.monotonic() - began)))
        self._drop_all()

    def _answer(self) -> None:
        began, state = time.monotonic(), self._state()
        if state is None:
            self._drop_all()
            return
        payload = encode_picture(state[1], self._name, self._picture(*state))
        time.sleep(max(0.0, self._site.sim.latency - (time.monotonic() - began)))
        while self._asked:
            query = self._asked.popleft()
            with query:
                if not self._cut():
                    query.reply(str(query.key_expr), payload, express=topic("camera").express)

    def _drop_all(self) -> None:
        while self._asked:
            self._asked.popleft().drop()

    def _picture(self, state: SimState, stamp: float) -> bytes:
        order = [machine.name for machine in self._site.machines]
        own = Seen(self._machine, state.q, state.T_site_root, order.index(self._name))
        around = self._surroundings
        if self._schedule is not None:
            now = self._schedule(stamp)
            people = boxes_around(people_at(self._site, now))
            around = replace(around, people=people, vehicles=vehicles_at(self._site, now))
        return jpeg_of(cab_view(own, self._partners.seen(), around))


def jpeg_of(image: Any) -> bytes:
    """A JPEG of (height, width, 3) uint8."""
    from PIL import Image  # only where somebody watches

    out = io.BytesIO()
    Image.fromarray(image).save(out, "JPEG", quality=QUALITY)
    return out.getvalue()
