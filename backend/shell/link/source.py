"""The live link as the pipeline's source of inputs."""

from __future__ import annotations

from backend.pipeline.records import Inputs
from backend.shell.link.receiver import Receiver


class LinkSource:
    """Drains a receiver into one cycle's inputs."""

    def __init__(self, receiver: Receiver) -> None:
        self._receiver = receiver

    def take(self) -> Inputs:
        drained = self._receiver.drain()
        return Inputs(
            samples=drained.samples,
            malformed=drained.malformed,
            foreign=drained.foreign,
            lost=drained.lost,
        )
