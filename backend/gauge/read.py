"""`read`: a file of any known format to one `Model`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backend.errors import InputError
from backend.gauge import ifc, landxml, points_csv
from backend.gauge.records import Crs, Model, Surface
from backend.machine.meshes import mesh_triangles

MAX_BYTES = 512 * 1024 * 1024
XML = (".xml", ".landxml", ".im")
MESHES = (".stl", ".obj", ".ply", ".glb", ".gltf", ".dae", ".off", ".3mf")
ALLOWED = (*XML, ".csv", ".ifc", *MESHES)


def read(path: Path, epsg: int | None = None) -> Model:
    """The model of a file, its format told by its name's ending.

    epsg: the site's CRS, which decides over what the file says. Raises InputError with one sentence
    when the file as a whole cannot be read; what in it cannot is in the model's `skipped`.
    """
    ending = path.suffix.lower()
    if ending not in ALLOWED:
        raise InputError(f"{path}: is not of a known format; allowed are {', '.join(ALLOWED)}.")
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise InputError(
                f"{path}: has {size / 2**20:.0f} MiB; allowed are at most {MAX_BYTES // 2**20} MiB."
            )
        if ending == ".ifc":
            return ifc.parse(path, epsg)
        if ending in MESHES:
            return _mesh(path, epsg)
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}).") from None
    if ending == ".csv":
        return points_csv.parse(data, str(path), epsg)
    return landxml.parse(data, str(path), epsg)


def _mesh(path: Path, epsg: int | None) -> Model:
    triangles = mesh_triangles(path)
    points, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    surface = Surface(path.stem, points, faces.reshape(-1, 3).astype(np.int64), kind="mesh")
    crs = Crs(epsg, "", "" if epsg is None else "site")
    notes = () if epsg is not None else ("a mesh names no CRS",)
    return Model(path.stem, f"mesh {path.suffix.lower()}", crs, surfaces=(surface,), notes=notes)
