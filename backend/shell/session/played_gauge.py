"""The working gauge of a recorded session."""

from __future__ import annotations

from typing import Any

from backend.errors import InputError
from backend.pipeline.config import Config
from backend.pipeline.records import AS_THE_SITE_SAYS
from backend.shell.hub import Hub
from backend.site.gauge_choice import Drawn


class PlayedGauge:
    """The working gauge of a recorded session at its cursor. Nobody changes it."""

    editable = False

    def __init__(self, config: Config, hub: Hub) -> None:
        self._config, self._hub = config, hub

    def document(self) -> dict[str, Any]:
        """What backend.documents.gauge_choice.GaugeStateDocument describes."""
        from backend.documents.gauge_state import gauge_state  # what makes a gauge, for who asks

        newest = self._hub.latest()
        gauge = AS_THE_SITE_SAYS if newest is None else newest.gauge
        return gauge_state(self._config.site, gauge, editable=False)

    def draw(self, area: Drawn, replacing: bool, who: str) -> None:
        raise _recorded()

    def erase(self, name: str, who: str) -> None:
        raise _recorded()

    def switch(self, name: str, on: bool | None, who: str) -> None:
        raise _recorded()


def _recorded() -> InputError:
    return InputError("gauge: a recorded session is played; it can be looked at, not changed.")
