"""People and objects around the machines: what the LiDARs' process tells, and what holds now."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backend.safety.area_records import Within
from backend.safety.people import Risks
from backend.safety.swing_risk import Boundaries
from backend.spatial.types import Array, IntArray

PERSON, OBJECT = "person", "object"


@dataclass(frozen=True)
class Sensor:
    """A LiDAR's newest cloud. time: when it was taken, by the local clock [s]; position: (3,) then
    [m]; points: how many it had.
    """

    machine: str
    name: str
    time: float
    position: tuple[float, float, float]
    points: int


@dataclass(frozen=True)
class Missing:
    """Somebody who was followed and is no more: who, (3,) where [m], when last seen and when given
    up [s].
    """

    id: int
    position: tuple[float, float, float]
    seen: float
    lost: float


@dataclass(frozen=True)
class Seen:
    """What one merged scan left. An input of the pipeline: of what another process computed.

    time: of the scan, by the local clock; ready: when it was worked out [s]; k tracks: id (k,);
    status (k,), see tracking's `Status`; state (k, 11), in the order of the tracker [m, rad, s];
    cov (k, 4, 4) of x, y, vx, vy; ahead (k, 2) and ahead_cov (k, 2, 2): where each will be in a
    second; last_seen (k,) [s]; lost: those given up with this scan.
    """

    time: float
    ready: float
    sensors: tuple[Sensor, ...]
    id: IntArray
    status: IntArray
    state: Array
    cov: Array
    ahead: Array
    ahead_cov: Array
    last_seen: Array
    lost: tuple[Missing, ...] = ()


@dataclass(frozen=True)
class Tracked:
    """k people and objects at one time. id: (k,); kind: PERSON or OBJECT each; status: (k,);
    position: (k, 3) middles of their boxes [m]; velocity: (k, 2) [m/s]; yaw: (k,) [rad]; size:
    (k, 3) length, width, height [m]; sigma: (k,) one standard deviation of the place [m]; unseen:
    (k,) since the last detection [s]; ahead: (k, 2), ahead_cov: (k, 2, 2) in a second.
    """

    id: IntArray
    kind: tuple[str, ...]
    status: IntArray
    position: Array
    velocity: Array
    yaw: Array
    size: Array
    sigma: Array
    unseen: Array
    ahead: Array
    ahead_cov: Array

    def __len__(self) -> int:
        return len(self.id)


NOBODY = Tracked(
    np.zeros(0, np.int64),
    (),
    np.zeros(0, np.int64),
    np.zeros((0, 3)),
    np.zeros((0, 2)),
    np.zeros(0),
    np.zeros((0, 3)),
    np.zeros(0),
    np.zeros(0),
    np.zeros((0, 2)),
    np.zeros((0, 2, 2)),
)


@dataclass(frozen=True)
class PartnerRisk:
    """What the swing of `machine` is to the machine `other`. body: own body that is soonest, and
    other_body whom it meets, empty when nothing swings that far; ttc, index: the least now,
    ttc_ahead, index_ahead: in a second [s, -]; level: `Risk`, the worst; left: (negative, positive)
    what is left of the swing's speed.
    """

    machine: str
    other: str
    body: str
    other_body: str
    ttc: float
    index: float
    ttc_ahead: float
    index_ahead: float
    level: int
    left: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class Judged:
    """One machine's view of everybody. distance: (k,) to the nearest body [m]; nearest: (k,) that
    body; risks: of its swing; partners: the same of the other machines.
    """

    distance: Array
    nearest: tuple[str, ...]
    risks: Risks
    partners: tuple[PartnerRisk, ...] = ()


@dataclass(frozen=True)
class Inside:
    """A track in a working area: the narrowest that it is in now, and that its place in a second is
    in, of the same areas.
    """

    id: int
    machine: str
    now: Within
    ahead: Within


@dataclass(frozen=True)
class People:
    """Everybody around the machines in this cycle. reason: why that is not known, else empty; age:
    of the newest scan, NaN before the first [s]; sensors: newest of each LiDAR; lost: whose places
    are still told; judged: by own machine; boundaries: of the levels; inside: whose working areas
    who is in.
    """

    reason: str
    age: float
    sensors: tuple[Sensor, ...] = ()
    tracked: Tracked = NOBODY
    lost: tuple[Missing, ...] = ()
    judged: Mapping[str, Judged] = field(default_factory=dict)
    boundaries: Boundaries = field(default_factory=Boundaries)
    inside: tuple[Inside, ...] = ()
