"""What does not change during a run."""

from __future__ import annotations

from dataclasses import dataclass

from backend.fusion.crs import SiteFrame
from backend.machine.model import Machine
from backend.safety.partner import Limits
from backend.safety.people import Watch
from backend.safety.tip_over import TipOver
from backend.site.named_bodies import NO_SITE_BODIES, SiteBodies


@dataclass(frozen=True)
class Config:
    """machines: every machine of the site by name; own: those that this backend answers for.

    eta: configured inflation [m]; far: beyond this gap of two machines' workspaces no exact
    distance is computed [m]; site: what stands on the site; stop_latency: from asking a machine to
    stop to its first braking [s]; margins: whether joints' margins are computed; people: how they
    are judged, None on a site without LiDARs; stability: how tipping over is judged, None: not.
    """

    frame: SiteFrame
    machines: dict[str, Machine]
    labels: dict[str, str]
    own: tuple[str, ...]
    limits: Limits
    eta: float
    mode: str
    far: float = 15.0
    site: SiteBodies = NO_SITE_BODIES
    stop_latency: float = 0.3
    margins: bool = True
    people: Watch | None = None
    stability: TipOver | None = None
