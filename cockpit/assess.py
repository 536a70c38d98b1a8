"""`cockpit assess`: state documents in, results out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from backend.documents.assess import assess
from backend.errors import InputError
from backend.pipeline.images import SunParameters
from backend.shell.app.wire import dumps
from backend.site.site import load_site
from cockpit.states import States, read_text

DEFAULT_SUN = SunParameters(50, 50, 0.1)


def run_assess(path: Path, site_name: str | None, every_pair: bool, ground: bool = False) -> None:
    """Prints one result per document; a bad line of a .jsonl file gives its error in its place."""
    site = None if site_name is None else load_site(site_name)
    states = States(site, path.parent)
    sun = None if site is None else site.sun
    parameters = DEFAULT_SUN if sun is None else SunParameters(sun.m, sun.n, sun.eta)

    def judge(text: str, where: str) -> dict[str, Any]:
        state, machines = states.parse(text, where)
        return assess(
            state, machines, states.frame, parameters, every_pair, where, ground, states.bodies
        )

    text = read_text(path)
    if path.suffix != ".jsonl":
        print(dumps(judge(text, str(path))))
        return
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            result = judge(line, f"{path}:{number}")
        except InputError as error:
            result = {"error": str(error)}
        print(dumps(result))
