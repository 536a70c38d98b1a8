"""The other simulated machines as one of them sees them: their true states, while it looks."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.shell.link.codec import DecodeError, decode
from backend.shell.link.messages import TrueState
from backend.shell.link.topics import key, topic
from backend.shell.sim.cab import Seen
from backend.site.site import Site
from backend.spatial.rotation import from_attitude
from backend.spatial.transform import make

FORGOTTEN = 1.0  # without news a partner is not seen [s]


class Partners:
    """All machines of the site but `name`, whose own model is `machine`.

    beside: opens a session on which other machines are heard, as far as the link lets them through;
    None for nobody.
    """

    def __init__(
        self, site: Site, name: str, machine: Machine, beside: Callable[[], Any] | None = None
    ) -> None:
        self._site, self._name, self._machine, self._beside = site, name, machine, beside
        self._order = [one.name for one in site.machines]
        self._newest: dict[str, tuple[Any, float]] = {}
        self._models: dict[str, Machine] = {}
        self._heard_on: Any = None  # a session, while somebody looks

    def listen(self, on: bool) -> None:
        """Begins or ends listening; the same again does nothing."""
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

    def seen(self) -> list[Seen]:
        """Who was heard within the last second, as of then."""
        now = time.monotonic()
        found = []
        for name, (payload, arrival) in list(self._newest.items()):
            if now - arrival >= FORGOTTEN:
                continue
            try:
                truth = decode(name, "truth", payload.to_bytes(), arrival)
            except DecodeError:
                continue
            if isinstance(truth, TrueState):
                found.append(self._placed(truth))
        return found

    def _placed(self, truth: TrueState) -> Seen:
        machine = self._model(truth.machine)
        values = dict(zip(truth.names, truth.position.tolist(), strict=True))
        q = np.array([values.get(joint.name, 0.0) for joint in machine.joints])
        R = from_attitude(truth.yaw, truth.pitch, truth.roll)
        T = make(R, self._site.frame.from_projected(truth.base))
        return Seen(machine, q, T, self._order.index(truth.machine))

    def _model(self, name: str) -> Machine:
        entry, own = self._site.machine(name), self._site.machine(self._name)
        if (entry.model, entry.sidecar) == (own.model, own.sidecar):
            return self._machine
        if name not in self._models:
            sidecar = None if entry.sidecar is None else self._site.folder / entry.sidecar
            self._models[name] = load_machine(entry.model, sidecar, self._site.folder)
        return self._models[name]

    def _listener(self, name: str) -> Callable[[Any], None]:
        most = topic("truth").max_bytes

        def on_sample(sample: Any) -> None:
            if len(sample.payload) <= most:
                self._newest[name] = sample.payload, time.monotonic()

        return on_sample
