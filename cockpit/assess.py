"""`cockpit assess`: state documents in, results out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from backend.documents.assess import assess
from backend.documents.state import StateDocument, parse_state
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.pipeline.images import SunParameters
from backend.shell.app.wire import dumps
from backend.site.site import Site, load_site

DEFAULT_SUN = SunParameters(50, 50, 0.1)


def run_assess(path: Path, site_name: str | None, every_pair: bool) -> None:
    """Prints one result per document; a bad line of a .jsonl file gives its error in its place."""
    site = None if site_name is None else load_site(site_name)
    judge = _Judge(site, path.parent, every_pair)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text; allowed is a JSON document.") from error
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


class _Judge:
    """Keeps the machines that were loaded, so that a thousand lines load each only once."""

    def __init__(self, site: Site | None, folder: Path, every_pair: bool) -> None:
        self._site = site
        self._folder = folder
        self._every_pair = every_pair
        self._loaded: dict[str, Machine] = {}
        sun = None if site is None else site.sun
        self._sun = DEFAULT_SUN if sun is None else SunParameters(sun.m, sun.n, sun.eta)

    def __call__(self, text: str, where: str) -> dict[str, Any]:
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{where}: is not JSON: {error}.") from error
        state = parse_state(data, where)
        machines = {name: self._machine(name, state, where) for name in state.machines}
        frame: SiteFrame | None = None if self._site is None else self._site.frame
        return assess(state, machines, frame, self._sun, self._every_pair, where)

    def _machine(self, name: str, state: StateDocument, where: str) -> Machine:
        model = state.machines[name].model
        if model not in self._loaded:
            try:
                self._loaded[model] = self._load(model)
            except InputError as error:
                raise InputError(f"{where}: machines.{name}.model: {error}") from error
        return self._loaded[model]

    def _load(self, model: str) -> Machine:
        """A model of the site keeps the sidecar that the site gives it."""
        folder = self._folder if (self._folder / model).is_file() else Path.cwd()
        sidecar = None
        for machine in self._site.machines if self._site else ():
            if machine.model == model and self._site is not None:
                folder = self._site.folder
                sidecar = None if machine.sidecar is None else folder / machine.sidecar
        return load_machine(model, sidecar, folder)
