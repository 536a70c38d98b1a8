"""The working gauge in the hands of operators: what they draw and switch while machines work."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from backend.documents.gauge_state import gauge_state
from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import AS_THE_SITE_SAYS, GaugeInForce, Notice
from backend.pipeline.site_concern import standing
from backend.pipeline.working_gauge import site_of
from backend.shell.gauge_file import read, write
from backend.shell.hub import Hub
from backend.site.gauge_choice import Drawn, GaugeChoice, checked

log = logging.getLogger(__name__)
NOTICE = "gauge"


class GaugeDesk:
    """Holds what is chosen, and keeps it in a file. All methods may be called from any thread.

    path: of the file; told: of every change, what was done, by whom, with what details.
    """

    editable = True

    def __init__(
        self,
        config: Config,
        hub: Hub,
        path: Path,
        told: Callable[[str, str, dict[str, Any]], None],
    ) -> None:
        self._config, self._hub, self._path, self._told = config, hub, path, told
        self._lock = threading.Lock()
        kept = read(path, config.frame, config.site)
        self._trouble, self._writable = kept.trouble, kept.writable
        if kept.trouble:
            log.error("%s", kept.trouble)
        self._taken = {volume.name for volume in config.site.volumes}
        self._prepare(kept.choice)
        self._choice = kept.choice

    def choice(self) -> GaugeChoice:
        """What holds now; the same object until it changes."""
        return self._choice

    def notices(self) -> tuple[Notice, ...]:
        """What operators must know of the file; empty while all is well."""
        return (Notice(NOTICE, f"WORKING GAUGE · {self._trouble}"),) if self._trouble else ()

    def document(self) -> dict[str, Any]:
        """What backend.documents.gauge_choice.GaugeStateDocument describes."""
        gauge = GaugeInForce(self._choice, self._in_force().own_tracks)
        return gauge_state(self._config.site, gauge, editable=True)

    def draw(self, area: Drawn, replacing: bool, who: str) -> None:
        """A new area, or another shape of one. Raises InputError, and then nothing changes."""

        def drawn(choice: GaugeChoice) -> GaugeChoice:
            if not replacing and area.name in choice.names:
                raise InputError(f'gauge: the name "{area.name}" is taken; allowed is another one.')
            return choice.with_area(area)

        details = {"name": area.name, "kind": area.kind, "polygon": area.polygon}
        self._change(drawn, "draw", who, {**details, "bottom": area.bottom, "top": area.top})

    def erase(self, name: str, who: str) -> None:
        """An area that was drawn goes. Raises InputError for one that was not."""

        def erased(choice: GaugeChoice) -> GaugeChoice:
            if name not in choice.names:
                known = ", ".join(choice.names) or "none yet"
                raise InputError(f'gauge: no area "{name}" is drawn; there are {known}.')
            return choice.without_area(name)

        self._change(erased, "erase", who, {"name": name})

    def switch(self, name: str, on: bool | None, who: str) -> None:
        """A limit volume on, off or, with None, as its state says. Raises InputError."""

        def switched(choice: GaugeChoice) -> GaugeChoice:
            if on is not None and name not in self._taken and name not in choice.names:
                known = ", ".join([*sorted(self._taken), *choice.names]) or "none"
                raise InputError(f'gauge: there is no limit volume "{name}"; there are {known}.')
            return choice.with_switch(name, on)

        self._change(switched, "switch", who, {"name": name, "on": on})

    def _change(
        self,
        make: Callable[[GaugeChoice], GaugeChoice],
        what: str,
        who: str,
        details: dict[str, Any],
    ) -> None:
        with self._lock:
            choice = checked(make(self._choice), self._taken)
            self._prepare(choice)
            self._choice = choice
            self._keep(choice)
        self._told(f"gauge {what}", who, details)

    def _prepare(self, choice: GaugeChoice) -> None:
        """Makes all bodies here, so that no cycle of the fast loop waits for them."""
        gauge = GaugeInForce(choice, self._in_force().own_tracks)
        for name in self._config.own:
            around = site_of(name, gauge, self._config)
            if len(around.boxes):
                standing(around)

    def _keep(self, choice: GaugeChoice) -> None:
        if not self._writable:
            return  # what could not be read is not lost by being written over
        try:
            write(self._path, choice, self._config.frame)
            self._trouble = ""
        except OSError as error:
            self._trouble = (
                f"{self._path}: cannot be written: {error.strerror}; what is drawn and switched "
                "holds until this program ends"
            )
            log.error("%s", self._trouble)

    def _in_force(self) -> GaugeInForce:
        newest = self._hub.latest()
        return AS_THE_SITE_SAYS if newest is None else newest.gauge
