"""Where what operators draw and switch of a working gauge is kept from run to run."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from backend.documents.gauge_choice import GaugeChoiceFile, choice_file, choice_of
from backend.errors import InputError
from backend.fusion.crs import SiteFrame
from backend.shell.access.places import write_private
from backend.site.gauge_choice import NO_CHOICE, GaugeChoice, checked
from backend.site.messages import sentence
from backend.site.named_bodies import SiteBodies


@dataclass(frozen=True)
class Kept:
    """trouble: what was wrong with the file, in words, else empty; writable: whether writing it
    loses nothing.
    """

    choice: GaugeChoice = NO_CHOICE
    trouble: str = ""
    writable: bool = True


def read(path: Path, frame: SiteFrame, site: SiteBodies) -> Kept:
    """What is kept, in the site's frame. A file that is none is put aside under another name, so
    that it can be mended.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return Kept()
    except OSError as error:
        said = f"{path}: cannot be read: {error.strerror}; nothing drawn or switched holds"
        return Kept(trouble=said, writable=False)
    try:
        json.loads(content)
    except ValueError:
        return _put_aside(path, "is not JSON")
    try:
        choice = choice_of(GaugeChoiceFile.model_validate_json(content), frame)
        return Kept(checked(choice, {volume.name for volume in site.volumes}))
    except ValidationError as error:
        return _put_aside(path, sentence(error, GaugeChoiceFile))
    except InputError as error:
        return _put_aside(path, str(error))


def write(path: Path, choice: GaugeChoice, frame: SiteFrame) -> None:
    """Replaces the file at once. Raises OSError; then it is as it was."""
    write_private(path, choice_file(choice, frame).model_dump_json(indent=2).encode() + b"\n")


def _put_aside(path: Path, why: str) -> Kept:
    why = f"{path}: {why.rstrip('.')}; nothing drawn or switched holds"
    aside = path.with_name(f"{path.stem}-unread-{time.strftime('%Y%m%dT%H%M%S')}{path.suffix}")
    k = 1
    while aside.exists():
        k += 1
        aside = path.with_name(f"{path.stem}-unread-{k}{path.suffix}")
    try:
        path.rename(aside)
    except OSError as error:
        return Kept(trouble=f"{why}; it cannot be put aside: {error.strerror}", writable=False)
    return Kept(trouble=f"{why}; the file is now {aside.name}")
