"""Use cases of the working gauge, worked out beside the running machines: nothing can reach them.

A run is made in a process of its own, one at a time, and kept: the same question has the same
answer every time.
"""

from __future__ import annotations

import logging
import multiprocessing
import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from backend.documents.use_case import WORDS, use_case_document
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.planning.use_cases import (
    METHODS,
    MODEL,
    UseCaseRun,
    run_use_case,
    settings_of,
    use_case,
)
from backend.shell.aside import Aside, WorkerGone
from backend.shell.use_case_offers import Offer

log = logging.getLogger(__name__)

Question = tuple[str, str]
NICENESS = 5
"""Images go before it when processors are short."""
NOT_HERE = (
    "no use case is offered here: neither of the scenes that they are of is this site's; allowed "
    "are the sites pole and ballast."
)


class Answer(NamedTuple):
    """run, and the text of a backend.documents.use_case.UseCaseDocument of it alone."""

    run: UseCaseRun
    text: str


class Stopped(Exception):  # noqa: N818 - what was asked for
    """Somebody stopped the run."""


class UseCaseDesk:
    """All methods may be called from any thread.

    offered: what the site is the scene of; labels: of machines; told: of every start and stop,
    what was done, by whom, with what details.
    """

    def __init__(
        self,
        offered: tuple[Offer, ...],
        labels: Mapping[str, str],
        told: Callable[[str, str, dict[str, Any]], None],
    ) -> None:
        self._offered = {offer.name: offer for offer in offered}
        self._labels, self._told = labels, told
        context = multiprocessing.get_context("spawn")
        # Shared with the process: how far it is (0 to 1), and whether it shall give up.
        self._progress: Any = context.RawValue("d", 0.0)
        self._stop: Any = context.RawValue("b", 0)
        begin = partial(_begin, self._progress, self._stop)
        self._aside: Aside[Question, Answer] = Aside(begin, "runs use cases", NICENESS)
        self._lock = threading.Lock()
        self._running: Question | None = None
        self._thread: threading.Thread | None = None
        self._done: dict[Question, Answer] = {}
        self._trouble = ""

    def offer(self, name: str) -> Offer:
        """Raises InputError for a use case that this site is not the scene of."""
        if name not in self._offered:
            if not self._offered:
                raise InputError(NOT_HERE)
            known = ", ".join(self._offered)
            raise InputError(f'use case "{name}" is not of this site; allowed are {known}.')
        return self._offered[name]

    def start(self, name: str, method: str, who: str) -> None:
        """Begin to work out a run; one that is known already is there at once.

        Raises InputError for what is not offered, and while another one is worked out.
        """
        self.offer(name)
        settings_of(method)
        asked = (name, method)
        with self._lock:
            if asked in self._done or asked == self._running:
                return
            if self._running is not None:
                other = " by ".join(self._running)
                raise InputError(f"use case {other} is being worked out; allowed is one at a time.")
            self._running, self._trouble = asked, ""
            self._progress.value, self._stop.value = 0.0, 0
            self._thread = threading.Thread(
                target=self._work, args=(asked,), name="use case", daemon=True
            )
            self._thread.start()
        self._told("use case start", who, {"name": name, "method": method})

    def stop(self, who: str) -> None:
        """Give up the run that is being worked out, if any."""
        with self._lock:
            running = self._running
            if running is None:
                return
            self._stop.value = 1
        self._told("use case stop", who, {"name": running[0], "method": running[1]})

    def run(self, name: str, method: str) -> UseCaseRun | None:
        """A run that has been worked out."""
        answer = self._done.get((name, method))
        return None if answer is None else answer.run

    def text(self, name: str, method: str) -> str:
        """JSON of backend.documents.use_case.UseCaseDocument. Raises InputError before there is."""
        answer = self._done.get((name, method))
        if answer is None:
            raise InputError(f'use case "{name}" by "{method}" has not been worked out; start it.')
        return answer.text

    def document(self) -> dict[str, Any]:
        """What backend.documents.use_case_state.UseCaseStateDocument describes."""
        with self._lock:
            running, done, trouble = self._running, list(self._done), self._trouble
        now = None
        if running is not None:
            progress = min(1.0, max(0.0, float(self._progress.value)))
            now = {"name": running[0], "method": running[1], "progress": progress}
        return {
            "offered": [self._described(offer) for offer in self._offered.values()],
            "why": "" if self._offered else NOT_HERE,
            "methods": [{"name": name, "words": WORDS[name]} for name in METHODS],
            "running": now,
            "done": [{"name": name, "method": method} for name, method in done],
            "trouble": trouble,
        }

    def close(self) -> None:
        """Give up whatever is worked out, and end the process."""
        with self._lock:
            self._stop.value, thread = 1, self._thread
        if thread is not None:
            thread.join(timeout=5.0)
        self._aside.close()

    def _described(self, offer: Offer) -> dict[str, Any]:
        case = use_case(offer.name)
        return {
            "name": case.name,
            "title": case.title,
            "figures": case.figures,
            "machine": offer.machine,
            "label": self._labels.get(offer.machine, offer.machine),
            "seconds": case.seconds,
        }

    def _work(self, asked: Question) -> None:
        answer, trouble = None, ""
        try:
            answer = self._aside.ask(asked)
        except (RuntimeError, WorkerGone) as error:
            trouble = f"the run came to nothing: {error}"
            if self._stop.value:
                trouble = "stopped"
            else:
                log.error("use case %s by %s: %s", *asked, error)
        with self._lock:
            self._running, self._trouble = None, trouble
            if answer is not None:
                self._done[asked] = answer


def _begin(progress: Any, stop: Any) -> Callable[[Question], Answer]:
    """In the process: what answers."""
    machine = load_machine(MODEL)

    def work(question: Question) -> Answer:
        name, method = question
        seconds = use_case(name).seconds

        def tell(t: float) -> None:
            progress.value = t / seconds
            if stop.value:
                raise Stopped

        run = run_use_case(name, method, machine, tell)
        return Answer(run, use_case_document(machine, MODEL, [run]).model_dump_json())

    return work
