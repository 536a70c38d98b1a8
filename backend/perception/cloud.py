"""Points of a file, whatever its format: PCD, PLY or LAS, told apart by how it begins.

The content is given as bytes, so that nothing is read twice, and no more memory is taken than the
content can fill: what a header claims is checked against it first.
"""

from __future__ import annotations

from collections.abc import Callable

from backend.errors import InputError
from backend.perception.cloud_columns import Cloud
from backend.perception.las import read_las
from backend.perception.pcd import read_pcd
from backend.perception.ply import read_ply

_READERS: tuple[tuple[tuple[bytes, ...], Callable[[bytes, str], Cloud]], ...] = (
    ((b"# .PCD", b"#.PCD", b"VERSION", b"FIELDS"), read_pcd),
    ((b"ply\n", b"ply\r"), read_ply),
    ((b"LASF",), read_las),
)


def read_cloud(content: bytes, name: str) -> Cloud:
    """The points of a file. name: of the file, for messages.

    Raises InputError: what is wrong, where, and what is allowed.
    """
    for beginnings, reader in _READERS:
        if content.startswith(beginnings):
            return reader(content, name)
    shown = content[:12].decode("ascii", "replace")
    begins = f"begins with {shown!r}" if content else "is empty"
    raise InputError(f"{name}: {begins}; allowed are PCD, PLY and LAS files.")
