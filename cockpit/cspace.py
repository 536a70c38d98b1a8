"""`cockpit cspace`: one C-space image of a state document, into an .npz file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console

from backend.documents.cspace import CspaceDocument, Request, cspace_arrays
from backend.documents.scene import make_scene
from backend.errors import InputError
from backend.shell.app.wire import dumps
from backend.site.site import load_site
from backend.spatial.types import AnyArray
from cockpit.states import States, read_text


def run_cspace(
    path: Path, site_name: str | None, machine: str, request: Request, out: Path, as_json: bool
) -> None:
    """Writes the file and says what is in it."""
    if out.suffix != ".npz":
        raise InputError(f"--out {out} is not an .npz file; allowed is a name that ends in .npz.")
    states = States(None if site_name is None else load_site(site_name), path.parent)
    state, machines = states.parse(read_text(path), str(path))
    if machine not in machines:
        known = ", ".join(machines)
        raise InputError(f'--machine "{machine}" is not in {path}; allowed are {known}.')
    scene = make_scene(state, machines, states.frame, str(path), states.bodies)
    with Console(stderr=True).status(f"{request.kind} of {machine}"):
        arrays, facts = cspace_arrays(scene, machine, request)
        units = [axis["unit"] for axis in facts["axes"]]
        names = [axis["name"] for axis in facts["axes"]]
        _save(out, {**arrays, "axis_names": np.array(names), "axis_units": np.array(units)})
    shapes = {name: list(array.shape) for name, array in arrays.items()}
    document = CspaceDocument(file=str(out), arrays=shapes, **facts)
    print(dumps(document.model_dump()) if as_json else _words(document))


def _save(out: Path, arrays: dict[str, AnyArray]) -> None:
    try:
        np.savez_compressed(out, allow_pickle=False, **arrays)
    except OSError as error:
        raise InputError(f"--out {out} cannot be written ({error.strerror or error}).") from error


def _words(document: CspaceDocument) -> str:
    lines = [f"{document.file}: {document.kind} of {document.machine}"]
    for k, axis in enumerate(document.axes):
        lines.append(
            f"  axis {k}  {axis.name:7} {axis.low:9.4f} to {axis.high:9.4f} {axis.unit}, "
            f"{axis.cells} cells"
        )
    lines.append(f"  layers  {', '.join(document.layers)}; eta {document.eta:.3f} m")
    shares = {
        "colliding": document.colliding,
        "certified free": document.certified_free,
        "certified colliding": document.certified_colliding,
        "undecided": document.undecided,
    }
    lines += [f"  {name:20} {100 * v:6.2f} %" for name, v in shares.items() if v is not None]
    return "\n".join(lines)
