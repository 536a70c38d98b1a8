"""Sun's experiment as a CAN log: what Appendix A prints, and around it what it takes to replay it.

`python -m backend.shell.session.sun2020 FOLDER` writes the log and the session that
scenes/sessions holds.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import cantools
import numpy as np

from backend.shell.session.can_map import CAN
from backend.shell.session.convert import Conversion, convert
from backend.shell.session.pose_messages import PoseMessages
from backend.site.site import Site, load_site
from backend.spatial.rotation import from_attitude

SITE = "sun2020-experiment"
NAME = "sun2020-experiment"
LOG = CAN / "sun2020-appendix-a.asc"
DBC = CAN / "sun2020.dbc"
NOTE = (
    "The first 13 ms are the CAN log of Sun 2020, Appendix A (angles as printed). Everything else "
    "is synthesised: positions and headings are those of Tables 4 to 6, the logged angles are held "
    "for 3 s, then B's arm goes from the logged posture to Table 6's within 3 s. The swing is not "
    "logged and taken as 0."
)
HOLD, MOVE, END = 3.0, 3.0, 9.0  # [s] after the log's first row
ANGLE_PERIOD, POSITION_PERIOD = 0.02, 0.05  # [s] of what is synthesised
TABLE_6 = {"B_Boom": 44.8, "B_Stick": -80.1, "B_Bucket": -22.0}  # [deg]


@dataclass(frozen=True)
class Frame:
    """time: as the log counts it [s]; logged: printed in the paper."""

    time: float
    identifier: int
    data: bytes
    logged: bool


def frames() -> list[Frame]:
    """The printed rows and the synthesised ones, by time."""
    database: Any = cantools.database.load_file(DBC)
    with can.LogReader(LOG, relative_timestamp=False) as reader:
        logged = [Frame(m.timestamp, m.arbitration_id, bytes(m.data), True) for m in reader]
    start = logged[0].time
    posture: dict[str, float] = {}
    for row in logged:
        message = database.get_message_by_frame_id(row.identifier)
        # The last printed row of 408 reads 26.8: an outlier, so the first of each counts.
        posture.setdefault(message.name, float(message.decode(row.data)["angle"]))
    made = [
        Frame(start + time, message.frame_id, message.encode(values), False)
        for time, name, values in (*_angles(posture), *_places(load_site(SITE)))
        for message in (database.get_message_by_name(name),)
    ]
    return sorted([*logged, *made], key=lambda frame: frame.time)


def _angles(posture: dict[str, float]) -> Iterator[tuple[float, str, dict[str, float]]]:
    for time in np.arange(ANGLE_PERIOD, END, ANGLE_PERIOD).tolist():
        part = float(np.clip((time - HOLD) / MOVE, 0.0, 1.0))
        part = part * part * (3.0 - 2.0 * part)
        for name, logged in posture.items():
            target = TABLE_6.get(name, logged)
            yield time, name, {"angle": logged + part * (target - logged)}


def _places(site: Site) -> Iterator[tuple[float, str, dict[str, float]]]:
    """The antennas of machines whose swing axes stand at the tables' positions, and headings."""
    for machine in site.machines:
        assert machine.start is not None
        encode = PoseMessages(site, machine.name)
        attitude = machine.start.attitude
        swing_joint = from_attitude(*attitude) @ encode.machine.arm.T_root_swing[:3, 3]
        base = site.frame.from_projected(np.array(machine.start.position))
        base[:2] -= swing_joint[:2]
        latitude, longitude, _ = encode.antenna_of(base, attitude, 0.0)
        name = machine.name.upper()
        for time in np.arange(0.0, END, POSITION_PERIOD).tolist():
            yield time, f"{name}_Position", {"latitude": latitude, "longitude": longitude}
            yield time, f"{name}_Heading", {"heading": machine.start.yaw_deg}


def write_log(path: Path) -> None:
    """The frames as a Vector .asc text that says which rows are the paper's."""
    lines = [f"// {line}" for line in _wrapped(NOTE)]
    lines += ["base dec  timestamps absolute", "no internal events logged"]
    before: bool | None = None
    for frame in frames():
        if frame.logged is not before:
            lines.append("// from the paper:" if frame.logged else "// synthesised:")
            before = frame.logged
        data = " ".join(str(byte) for byte in frame.data)
        lines.append(f"{frame.time:.6f} 1  {frame.identifier:<15d} Rx   d {len(frame.data)} {data}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_session(folder: Path) -> Conversion:
    """The log and the session in `folder`."""
    log = folder / f"{NAME}.asc"
    write_log(log)
    return convert(log, load_site(SITE), folder / f"{NAME}.mcap", note=NOTE)


def _wrapped(text: str, width: int = 96) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


if __name__ == "__main__":
    done = write_session(Path(sys.argv[1]))
    print(f"{done.out}: {done.messages} messages")
