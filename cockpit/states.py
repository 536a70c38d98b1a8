"""State documents from files, with the descriptions of their machines."""

from __future__ import annotations

import json
from pathlib import Path

from backend.documents.state import StateDocument, parse_state
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.site.bodies import site_bodies
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies
from backend.site.site import Site


def read_text(path: Path) -> str:
    """Raises InputError when the file cannot be read or is not text."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text; allowed is a JSON document.") from error


class States:
    """Keeps the machines that were loaded, so that a thousand lines load each only once."""

    def __init__(self, site: Site | None, folder: Path) -> None:
        """folder: where paths of the documents' models begin."""
        self._site = site
        self._folder = folder
        self._loaded: dict[str, Machine] = {}
        self.frame: SiteFrame | None = None if site is None else site.frame
        self.bodies: SiteBodies = NO_SITE_BODIES if site is None else site_bodies(site)

    def parse(self, text: str, where: str) -> tuple[StateDocument, dict[str, Machine]]:
        """A document and the description of every machine in it. Raises InputError."""
        try:
            data = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{where}: is not JSON: {error}.") from error
        state = parse_state(data, where)
        return state, {name: self._machine(name, state, where) for name in state.machines}

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
