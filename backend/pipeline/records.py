"""What goes into a cycle and what comes out of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from backend.fusion.pose import FusedPose
from backend.fusion.samples import Sample
from backend.pipeline.people_records import People, Seen
from backend.safety.alarms import Alarm
from backend.safety.area_records import WorkingArea
from backend.safety.record import Concern
from backend.safety.surmounting import Surmounting
from backend.site.gauge_choice import NO_CHOICE, GaugeChoice
from backend.spatial.boxes import Boxes
from backend.spatial.types import Array
from backend.stability.records import Stability


@dataclass(frozen=True)
class ImageStamp:
    """A worker's result, known to the pipeline by its stamp: which image, of which state, when."""

    key: str  # "left<-right"
    kind: str  # "sun"
    state_time: float
    ready_time: float
    seconds: float  # of computing


@dataclass(frozen=True)
class Notice:
    """What an operator should know about the cockpit itself. Never a safety level, and no alarm.

    key: what it is about ("recording"); line: in words; since: first cycle with this key without
    a break, set by the pipeline [s].
    """

    key: str
    line: str
    since: float = math.nan


@dataclass(frozen=True)
class Inputs:
    """Everything that arrived since the last cycle, in order of arrival."""

    samples: tuple[Sample, ...] = ()
    images: tuple[ImageStamp, ...] = ()
    malformed: tuple[tuple[str, int], ...] = ()  # key, messages that the codec refused
    foreign: tuple[tuple[str, int], ...] = ()  # key prefix, messages of machines not of this site
    lost: int = 0  # messages dropped because the queue was full
    notices: tuple[Notice, ...] = ()  # those that hold now
    driven: tuple[str, ...] = ()  # machines that somebody here controls: their brakes are judged
    gauge: GaugeChoice | None = None  # what operators chose of it; None: as before
    people: Seen | None = None  # of the newest scan; None: none since
    surmounting: Mapping[str, Surmounting] = field(default_factory=dict)  # by machine, what is on


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
    """pose: fused; body: placed (None before the first complete pose); eta: inflation [m]; area:
    where it works, None where nobody worked that out (recordings of before).
    """

    pose: FusedPose
    body: Body3D | None
    eta: float
    area: WorkingArea | None = None


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
class Freedom:
    """One joint, one way. Bodies count as grown by what is not known exactly.

    free: to first contact or the joint's limit [rad]; own, hits: the body that touches and what it
    touches ("right:stick/0", "site:wall", "left:tracks/0"), None at a limit; time_now: until then
    at the present rate, infinite when the joint does not move that way [s]; time_full: at its full
    rate [s]; stop_now, stop_full: how far it moves before it stands, latency included [rad].
    """

    free: float
    own: str | None
    hits: str | None
    time_now: float
    time_full: float
    stop_now: float
    stop_full: float

    @property
    def can_stop(self) -> bool:
        """Whether a stop from full rate ends before the contact; at a limit the machine stops."""
        return self.hits is None or self.free > self.stop_full


@dataclass(frozen=True)
class Motion:
    """All joints as they move now. free: until first contact or a limit [s]; own, hits as above."""

    free: float
    own: str | None
    hits: str | None


@dataclass(frozen=True)
class MachineMargins:
    """What a machine can do from here. eta: growth of the bodies [m]; reason: why it is not known,
    else empty; joints: (negative, positive) by joint; motion: None at rest.
    """

    machine: str
    eta: float
    reason: str
    joints: tuple[tuple[Freedom, Freedom], ...]
    motion: Motion | None


@dataclass(frozen=True)
class GaugeInForce:
    """What holds of the working gauge. choice: of operators; own_tracks: by own machine the tracks
    that it stands on, which do not hold for it; machines on none are missing.
    """

    choice: GaugeChoice = NO_CHOICE
    own_tracks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


AS_THE_SITE_SAYS = GaugeInForce()


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
    margins: dict[str, MachineMargins] = field(default_factory=dict)  # by own machine
    notices: tuple[Notice, ...] = ()
    gauge: GaugeInForce = AS_THE_SITE_SAYS
    people: People | None = None  # None on a site without LiDARs
    stability: dict[str, Stability] = field(default_factory=dict)  # empty where it is not judged
    surmounting: Mapping[str, Surmounting] = field(default_factory=dict)  # by machine, in force
