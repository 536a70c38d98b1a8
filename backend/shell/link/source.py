"""The live link as the pipeline's source of inputs."""

from __future__ import annotations

from collections.abc import Callable

from backend.fusion.samples import ClockSample
from backend.pipeline.records import Inputs
from backend.shell.link.receiver import Heard, Receiver


class LinkSource:
    """Drains a receiver into one cycle's inputs. tap: gets what is to be recorded of each cycle."""

    def __init__(
        self,
        receiver: Receiver,
        tap: Callable[[tuple[Heard | ClockSample, ...]], None] = lambda _: None,
    ) -> None:
        self._receiver = receiver
        self._tap = tap

    def take(self) -> Inputs:
        drained = self._receiver.drain()
        self._tap(drained.heard)
        return Inputs(
            samples=drained.samples,
            malformed=drained.malformed,
            foreign=drained.foreign,
            lost=drained.lost,
        )
