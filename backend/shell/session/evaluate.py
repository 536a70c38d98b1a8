"""A session judged by today's pipeline: portions in, snapshots out, as live."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import fields, replace
from itertools import count
from typing import Any

from backend.pipeline.config import Config
from backend.pipeline.records import Inputs, Snapshot
from backend.pipeline.step import State, initial, step
from backend.shell.session.cycles import Portion, Topics, portions
from backend.shell.session.reader import Session

Progress = Callable[[float], None]


class Evaluator:
    """The pipeline over portions. What is put aside goes into the next step, so none is lost."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._unseen = replace(config, margins=False)
        self._state: State | None = None
        self._aside: list[Inputs] = []

    def put_aside(self, portion: Portion) -> None:
        """A portion that no snapshot is wanted of."""
        self._begin(portion)
        self._aside.append(portion.inputs)

    def step(self, portion: Portion, seen: bool = True) -> Snapshot:
        """One cycle with this portion and all that was put aside.

        seen: somebody looks at the snapshot; margins are for looking only, and no later cycle
        depends on them.
        """
        state = self._begin(portion)
        inputs = portion.inputs
        if self._aside:
            inputs = merged([*self._aside, inputs])
            self._aside.clear()
        if portion.cycle is not None and portion.cycle != state.cycle:
            state = replace(state, cycle=portion.cycle)
        self._state, snapshot = step(
            state, inputs, portion.now, self._config if seen else self._unseen
        )
        return snapshot

    def _begin(self, portion: Portion) -> State:
        if self._state is None:
            self._state = replace(initial(self._config), cycle=portion.cycle or 0)
        return self._state


def merged(inputs: Iterable[Inputs]) -> Inputs:
    """Inputs of consecutive cycles as those of one, in order."""
    several = list(inputs)
    joined: dict[str, Any] = {
        field.name: sum((getattr(one, field.name) for one in several), start=())
        for field in fields(Inputs)
        if field.name not in ("lost", "notices", "driven", "gauge", "people", "surmounting")
    }
    # Notices, and who is driven or climbs, are no events: those of the last cycle hold; of the
    # gauge what was chosen last, and the newest of what LiDARs saw.
    people = next((one.people for one in reversed(several) if one.people is not None), None)
    chosen = next((one.gauge for one in reversed(several) if one.gauge is not None), None)
    lost = sum(one.lost for one in several)
    return replace(several[-1], **joined, lost=lost, gauge=chosen, people=people)


def evaluate(
    session: Session,
    topics: Topics,
    config: Config,
    start: int | None = None,
    end: int | None = None,
    every: int = 1,
    progress: Progress | None = None,
) -> Iterator[tuple[Portion, Snapshot]]:
    """Snapshots of a session's portions from start to end [ns].

    every: 1 steps the pipeline for each portion, bit by bit as live; n for each n-th and the last,
    for which the others' samples are kept.
    """
    evaluator = Evaluator(config)
    span = max(session.end - session.begin, 1)
    several = portions(session, topics, start, end)
    following = next(several, None)
    for k in count(1):
        portion, following = following, next(several, None)
        if portion is None:
            return
        if k % every and following is not None:
            evaluator.put_aside(portion)
        else:
            yield portion, evaluator.step(portion)
        if progress is not None and k % 50 == 0:
            progress((portion.time - session.begin) / span)
