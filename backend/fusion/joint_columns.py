"""Which of a JointState's names give which joint: its angle, or the stroke of its cylinder."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from backend.machine.stroke_pins import SUFFIX

SHOWN = 40  # characters of a stranger's name


class Columns(NamedTuple):
    """For every joint its column in the message (-1 where it is missing), and the index into
    Machine.strokes of the cylinder whose stroke it holds (-1: it is an angle).

    missing: (joint, why in words) where a name was meant for a cylinder that is not described.
    """

    columns: tuple[int, ...]
    strokes: tuple[int, ...]
    missing: tuple[tuple[int, str], ...]


@lru_cache(maxsize=256)
def columns_of(
    names: tuple[str, ...],
    angles: tuple[tuple[str, int], ...],
    cylinders: tuple[tuple[str, int, int], ...],
    n: int,
) -> Columns | None:
    """Where each of n joints is in a message with these names; further names are ignored.

    angles, cylinders: `Rig.columns` and `Rig.cylinders`. Where there are both, the angle counts.
    None when the first joint's angle is missing, or a joint comes twice as the same.
    """
    joint_of = dict(angles)
    moved_by = {name: (stroke, joint) for name, stroke, joint in cylinders}
    columns, read = [-1] * n, [(-1, -1)] * n
    strange = []
    for column, name in enumerate(names):
        if name in joint_of:
            if columns[joint_of[name]] >= 0:
                return None
            columns[joint_of[name]] = column
        elif name in moved_by:
            stroke, joint = moved_by[name]
            if read[joint][0] >= 0:
                return None
            read[joint] = column, stroke
        elif name.endswith(SUFFIX):
            strange.append(name)
    if columns[0] < 0:
        return None
    strokes = [-1 if column >= 0 else read[k][1] for k, column in enumerate(columns)]
    columns = [column if column >= 0 else read[k][0] for k, column in enumerate(columns)]
    missing: tuple[tuple[int, str], ...] = ()
    if strange:
        why = _strange(strange[0], [name for name, _, _ in cylinders])
        missing = tuple((joint, why) for joint, column in enumerate(columns) if column < 0)
    return Columns(tuple(columns), tuple(strokes), missing)


def _strange(name: str, known: list[str]) -> str:
    shown = "".join(c if c.isprintable() else "?" for c in name[:SHOWN])
    allowed = ", ".join(known) or "angles only, the sidecar describes no cylinder"
    return f'angle is not published; "{shown}" is no cylinder of it, allowed: {allowed}'
