"""The working gauge that a site's files describe: LandXML, Inframodel, CSV, meshes, IFC."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.gauge.centreline import InFrame
from backend.gauge.features import Buried, Feature, Overhead, Pole, Track
from backend.gauge.read import read
from backend.gauge.records import Feature as PlanFeature
from backend.gauge.records import Model, Pipe
from backend.site.gauge_tables import GaugeSource
from backend.site.site import Site
from backend.spatial.types import Array

EXISTING = "existing"


def source_features(site: Site) -> tuple[Feature, ...]:
    """What the files of a site hold of the working gauge, in the site frame.

    A name that is there twice gets a number. Raises InputError with one sentence for a file that
    cannot be read or is in another CRS.
    """
    found: list[Feature] = []
    taken = set(site.gauge.names)
    for source in site.gauge.source:
        path = site.folder / source.file
        model = _model(site, source, path)
        found += _tracks(site, source, model, taken)
        found += _lines(site, source, model, taken)
    return tuple(found)


def _model(site: Site, source: GaugeSource, path: Path) -> Model:
    where = f"{site.path}: gauge.source"
    if not path.is_file():
        raise InputError(
            f"{where}: file {path} does not exist; allowed is a LandXML, CSV, mesh or IFC file."
        )
    if source.epsg is not None and source.epsg != site.frame.epsg:
        raise InputError(
            f"{where}: epsg is {source.epsg}; allowed is the site's ({site.frame.epsg}): files are "
            "not transformed."
        )
    model = _read(path, path.stat().st_mtime_ns, source.epsg)
    named = model.crs.epsg
    if named is not None and named != site.frame.epsg:
        raise InputError(
            f"{where}: {path.name} is in EPSG {named}; allowed is the site's ({site.frame.epsg}). "
            "Where the file names its CRS wrongly, give epsg."
        )
    return model


@lru_cache(maxsize=8)
def _read(path: Path, changed: int, epsg: int | None) -> Model:
    return read(path, epsg)


def _tracks(site: Site, source: GaugeSource, model: Model, taken: set[str]) -> Iterator[Feature]:
    origin = np.array(site.frame.origin)
    height = 0.0 if source.height is None else source.height - origin[2]
    for alignment in model.alignments:
        name = alignment.name.strip()
        if not _matches(source.tracks, name):
            continue
        line = InFrame(alignment, origin, height, assumed=source.height is None)
        line.name, line.state = _free(name, taken), alignment.state or EXISTING
        yield Track(line)


def _lines(site: Site, source: GaugeSource, model: Model, taken: set[str]) -> Iterator[Feature]:
    for network in model.networks:
        for pipe in network.pipes:
            if _matches(source.buried, pipe.name, pipe.kind, "pipe", network.name):
                state = pipe.state or EXISTING
                for line in _known(site, [pipe.points]):
                    yield Buried(_free(pipe.name, taken), line, _diameter(pipe, source), state)
    for feature in model.features:
        yield from _feature(site, source, feature, taken)


def _feature(
    site: Site, source: GaugeSource, feature: PlanFeature, taken: set[str]
) -> Iterator[Feature]:
    words = feature.name, feature.kind
    state = feature.state or EXISTING
    if _matches(source.buried, *words):
        for line in _known(site, feature.lines):
            yield Buried(_free(feature.name, taken), line, source.diameter, state)
    elif _matches(source.overhead, *words):
        for line in _known(site, feature.lines):
            yield Overhead(_free(feature.name, taken), line, state)
    elif _matches(source.poles, *words):
        for base in _placed(site, feature.points):
            name = _free(feature.name, taken)
            foot = np.where(np.isfinite(base), base, 0.0)
            yield Pole(name, foot, source.pole_radius, source.pole_height, state)


def _known(site: Site, lines: Iterable[Array]) -> Iterator[Array]:
    """Lines of two points or more whose heights are known."""
    for line in lines:
        if len(line) > 1 and np.isfinite(line).all():
            yield _placed(site, line)


def _placed(site: Site, points: Array) -> Array:
    return np.asarray(points - np.array(site.frame.origin))


def _diameter(pipe: Pipe, source: GaugeSource) -> float:
    outer = np.nanmax([*pipe.size, -1.0]) + 2.0 * pipe.thickness
    return float(outer) if outer > 0.0 else source.diameter


def _matches(patterns: Iterable[str], *words: str) -> bool:
    return any(fnmatchcase(word.strip(), p) for p in patterns for word in words if word)


def _free(name: str, taken: set[str]) -> str:
    """The name, or with the first number that nobody has."""
    base = name.strip().replace("/", "-") or "unnamed"
    found, number = base, 1
    while found in taken:
        number += 1
        found = f"{base} ({number})"
    taken.add(found)
    return found
