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
from typing import Any

import numpy as np

from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.shell.link.codec import DecodeError, decode
from backend.shell.link.encode import encode_picture
from backend.shell.link.messages import TrueState
from backend.shell.link.topics import key, topic
from backend.shell.sim.cab import Seen, Surroundings, cab_view
from backend.shell.sim.dynamics import SimState
from backend.site.site import Site
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

AT_ONCE = 8  # questions that wait; more are not answered
PERIOD = 0.1  # between two pictures, at least [s]
UNWATCHED = 3.0  # without a question the partners are not listened to any more [s]
FORGOTTEN = 1.0  # without news a partner is not drawn [s]
QUALITY = 70


class CabCamera:
    """Answers for all cameras of `name` that the site asks the machine for.

    state: the machine's true state, None before the first, and its stamp [s]; cut: whether the
    radio is down, then nothing is answered; beside: opens a session on which other machines are
    heard, None for nothing but this machine in the picture.
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
    ) -> None:
        self._session, self._site, self._name, self._machine = session, site, name, machine
        self._state, self._cut, self._beside = state, cut, beside
        self._asked: deque[Any] = deque()
        self._wake = threading.Event()
        self._closing = False
        self._partners: dict[str, tuple[TrueState, float]] = {}
        self._models: dict[str, Machine] = {}
        self._heard_on: Any = None  # a session, while somebody watches
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
        self._hear_partners(False)

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
            self._hear_partners(asked)
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
        payload = encode_picture(state[1], self._name, self._picture(state[0]))
        time.sleep(max(0.0, self._site.sim.latency - (time.monotonic() - began)))
        while self._asked:
            query = self._asked.popleft()
            with query:
                if not self._cut():
                    query.reply(str(query.key_expr), payload, express=topic("camera").express)

    def _drop_all(self) -> None:
        while self._asked:
            self._asked.popleft().drop()

    def _picture(self, state: SimState) -> bytes:
        order = [machine.name for machine in self._site.machines]
        own = Seen(self._machine, state.q, state.T_site_root, order.index(self._name))
        now = time.monotonic()
        others = [
            self._seen(truth, order.index(name))
            for name, (truth, arrival) in list(self._partners.items())
            if now - arrival < FORGOTTEN
        ]
        return jpeg_of(cab_view(own, others, self._surroundings))

    def _seen(self, truth: TrueState, paint: int) -> Seen:
        machine = self._model(truth.machine)
        values = dict(zip(truth.names, truth.position.tolist(), strict=True))
        q = np.array([values.get(joint.name, 0.0) for joint in machine.joints])
        R = from_attitude(truth.yaw, truth.pitch, truth.roll)
        return Seen(machine, q, make(R, self._site.frame.from_projected(truth.base)), paint)

    def _model(self, name: str) -> Machine:
        entry, own = self._site.machine(name), self._site.machine(self._name)
        if (entry.model, entry.sidecar) == (own.model, own.sidecar):
            return self._machine
        if name not in self._models:
            sidecar = None if entry.sidecar is None else self._site.folder / entry.sidecar
            self._models[name] = load_machine(entry.model, sidecar, self._site.folder)
        return self._models[name]

    def _hear_partners(self, on: bool) -> None:
        """Other simulated machines' true states, as far as the link lets them through."""
        if on == (self._heard_on is not None) or self._beside is None:
            return
        if not on:
            self._heard_on.close()
            self._heard_on = None
            return
        self._heard_on = self._beside()
        for other in self._site.machines:
            if other.name != self._name:
                truth = key("truth", other.prefix)
                self._heard_on.declare_subscriber(truth, self._listener(other.name))

    def _listener(self, name: str) -> Callable[[Any], None]:
        most = topic("truth").max_bytes

        def on_sample(sample: Any) -> None:
            arrival = time.monotonic()
            known = self._partners.get(name)
            if len(sample.payload) > most or (known and arrival - known[1] < 0.5 * PERIOD):
                return
            try:
                truth = decode(name, "truth", sample.payload.to_bytes(), arrival)
            except DecodeError:
                return
            if isinstance(truth, TrueState):
                self._partners[name] = truth, arrival

        return on_sample


def jpeg_of(image: Any) -> bytes:
    """A JPEG of (height, width, 3) uint8."""
    from PIL import Image  # only where somebody watches

    out = io.BytesIO()
    Image.fromarray(image).save(out, "JPEG", quality=QUALITY)
    return out.getvalue()
