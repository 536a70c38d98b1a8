"""`cockpit along`: the strip of a track where a machine's work cycle would violate the limits."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np

from backend.documents.along import AlongDocument, BandModel, along_document
from backend.errors import InputError
from backend.machine.load import load_machine
from backend.machine.model import Machine
from backend.pipeline.along_cycle import TOLERANCE, thinned
from backend.pipeline.along_track import Placement, Question, along_track, placement
from backend.shell.app.wire import dumps
from backend.shell.sim.postures import joints_from
from backend.shell.sim.program import reference
from backend.shell.sim.program_file import load_program, start_posture
from backend.site.bodies import site_bodies
from backend.site.site import Site, load_site
from backend.site.travel import Way, site_ways, way_called
from backend.spatial import rotation, transform
from backend.spatial.types import Array
from cockpit.along_plot import along_svg

NEAR = 1.5
"""[m] beside a track within which a machine counts as standing on it."""

_SAMPLED = 0.1  # [s] between two postures of a simulated program


def run_along(
    track: str,
    site_name: str,
    machine_name: str,
    cycle_file: Path | None,
    span: tuple[float | None, float | None],
    step: float,
    as_json: bool,
    svg: Path | None,
) -> None:
    """Prints the verdicts, and draws them."""
    site = load_site(site_name)
    entry = site.machine(machine_name)
    sidecar = None if entry.sidecar is None else site.folder / entry.sidecar
    machine = load_machine(entry.model, sidecar, site.folder)
    way = way_called(site_ways(site), track)
    place, assumed = placed(site, machine_name, way)
    if cycle_file is None:
        postures = simulated_cycle(machine, site, machine_name)
    else:
        start = start_posture(machine, site, machine_name)
        postures = read_cycle(cycle_file, machine, start)
    cycle = thinned(machine, postures)
    question = Question(eta=site.safety.eta, step=step, finest=min(step, Question().finest))
    low, high = span[0] or 0.0, way.length if span[1] is None else span[1]
    if not 0.0 <= low < high <= way.length + 1e-9:
        raise InputError(
            f"--from {low:g} --to {high:g}: allowed are rising stations of {track}, 0 to "
            f"{way.length:.3f} m."
        )
    found = along_track(
        *(machine, cycle, way.frames, place, site_bodies(site).without((track,))),
        *((low, min(high, way.length)), question, way.known(machine.bounding_radius)),
    )
    document = along_document(
        *((site.name, machine_name, track), machine, way.length, place, assumed, question),
        *((len(cycle.postures), TOLERANCE), found),
    )
    if svg is not None:
        try:
            svg.write_text(along_svg(document), encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"--svg {svg} cannot be written ({error.strerror or error})."
            ) from None
    print(dumps(document.model_dump()) if as_json else _words(document))


def placed(site: Site, name: str, way: Way) -> tuple[Placement, bool]:
    """Where the site file puts a machine on a track, and whether that is assumed: it stands
    elsewhere, and its root is taken to be on the middle between the rails.

    Raises InputError for a machine without a start.
    """
    start = site.machine(name).start
    if start is None:
        raise InputError(f"{site.path}: machine {name} has no start; allowed is one that has.")
    position = site.frame.from_projected(np.array([start.position]))[0]
    T = transform.make(rotation.from_attitude(*start.attitude), position)
    station, beside = way.nearest(position)
    if not math.isfinite(station):
        raise InputError(f"{way.name}: the track's place is not known anywhere.")
    if beside <= NEAR:
        return placement(way.frames, station, T), False
    return Placement(station, 0.0, 0.0, 0.0), True


def simulated_cycle(machine: Machine, site: Site, name: str) -> Array:
    """(m, n) [rad] one lap of what the machine does in the simulation."""
    program = load_program(machine, site, name)
    if not program.cycle:
        return program.start[None]
    times = program.script_length + np.arange(0.0, program.period + 1e-9, _SAMPLED)
    return np.array([reference(program, float(t))[0] for t in times])


def read_cycle(path: Path, machine: Machine, start: Array) -> Array:
    """(m, n) [rad] of a file of postures in degrees: JSON, a list of objects by joint, or CSV with
    the joints' names above. Joints that are not named are as at the start. Raises InputError.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        if path.suffix.lower() == ".json":
            rows = json.loads(text)
        else:
            rows = list(csv.DictReader(text.splitlines()))
    except (OSError, ValueError) as error:
        raise InputError(f"--cycle {path} cannot be read ({error}).") from None
    if not isinstance(rows, list) or not rows:
        raise InputError(f"--cycle {path}: allowed is a list of one or more postures [deg].")
    return np.array(
        [_posture(row, machine, start, f"{path}: posture {k + 1}") for k, row in enumerate(rows)]
    )


def _posture(row: object, machine: Machine, start: Array, where: str) -> Array:
    try:
        if not isinstance(row, dict):
            raise TypeError
        values = {str(role): math.radians(float(value)) for role, value in row.items()}
    except (TypeError, ValueError):
        raise InputError(f"{where} is {row!r}; allowed are joints and degrees.") from None
    if not all(math.isfinite(value) for value in values.values()):
        raise InputError(f"{where} is {row!r}; allowed are finite degrees.")
    return joints_from(machine, values, start, where)


def _words(document: AlongDocument) -> str:
    place = document.place
    stands = f"stands at {place.station:.2f} m, {place.lateral:+.2f} m to the left"
    if place.assumed:
        stands = f"is taken to stand on its middle, at {place.station:.2f} m"
    lines = [
        f"{document.machine} along {document.track} ({document.length:.2f} m): {stands}",
        f"{document.postures} postures; a clearance of {document.eta:g} m or less violates",
    ]
    return "\n".join(lines + [_band(band, document.cap) for band in document.bands])


def _band(band: BandModel, cap: float) -> str:
    text = f"  {band.start:9.2f} to {band.end:9.2f} m  {band.state:9}"
    if band.state == "unknown":
        return text.rstrip()
    if band.clearance is None or band.at is None:
        return f"{text}  more than {cap:g} m"
    return f"{text}  {band.clearance:6.2f} m  {band.part} to {band.limit} at {band.at:.2f} m"
