"""What goes into a cycle and what comes out of it."""

from __future__ import annotations

from dataclasses import dataclass

from backend.fusion.pose import FusedPose
from backend.fusion.samples import Sample
from backend.safety.alarms import Alarm
from backend.safety.record import Concern
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array


@dataclass(frozen=True)
class ImageStamp:
    """A worker's result, known to the pipeline by its stamp: which image, of which state, when."""

    key: str  # "left<-right"
    kind: str  # "sun"
    state_time: float
    ready_time: float
    seconds: float  # of computing


@dataclass(frozen=True)
class Inputs:
    """Everything that arrived since the last cycle, in order of arrival."""

    samples: tuple[Sample, ...] = ()
    images: tuple[ImageStamp, ...] = ()
    malformed: tuple[tuple[str, int], ...] = ()  # key, messages that the codec refused
    foreign: tuple[tuple[str, int], ...] = ()  # key prefix, messages of machines not of this site
    lost: int = 0  # messages dropped because the queue was full


@dataclass(frozen=True)
class Body3D:
    """A machine placed in the site frame.

    link_poses: (L, 4, 4); boxes: its bodies; end_point, swing_center: (3,) [m];
    azimuth: of the arm, from grid east [rad]; reach: horizontal, swing axis to bucket tip [m].
    """

    link_poses: Array
    boxes: Boxes
    end_point: Array
    swing_center: Array
    azimuth: float
    reach: float


@dataclass(frozen=True)
class MachineState:
    """pose: fused; body: placed (None before the first complete pose); eta: inflation [m]."""

    pose: FusedPose
    body: Body3D | None
    eta: float


@dataclass(frozen=True)
class PairDistance:
    """Closest bodies of two machines. distance [m] is NaN and points None when unknown.

    points: (2, 3), on a and on b, site frame. approach [m/s]: closing speed, positive when closing.
    """

    a: str
    b: str
    body_a: str
    body_b: str
    distance: float
    points: Array | None
    reason: str  # why unknown, else ""
    checked: int  # body pairs confirmed by the second solver
    near: bool  # False: so far apart that `distance` is only a lower bound
    approach: float = 0.0


@dataclass(frozen=True)
class Health:
    """Counters since start."""

    malformed: dict[str, int]
    foreign: dict[str, int]
    lost: int
    images: dict[str, ImageStamp]  # newest per "kind key"


@dataclass(frozen=True)
class Snapshot:
    """One cycle's conclusions. Immutable; everything outside the pipeline reads only this."""

    time: float  # local clock of the cycle [s]
    state_time: float  # the common time of the fused poses [s]
    cycle: int
    mode: str  # "LIVE", "DEMO", "PLAYBACK"
    machines: dict[str, MachineState]
    pairs: tuple[PairDistance, ...]
    concerns: tuple[Concern, ...]
    alarms: tuple[Alarm, ...]
    health: Health
