"""The C-space images of one snapshot: one per ordered pair, "own must avoid partner"."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from backend.cspace.sun_images import SunImage, sun_image
from backend.cspace.sun_pose import sun_pose
from backend.fusion.pose import Validity
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from backend.spatial.types import Array


@dataclass(frozen=True)
class SunParameters:
    """m, n, eta of Sun 2020, Eqs. (4), (5), (7)."""

    m: int
    n: int
    eta: float


@dataclass(frozen=True)
class PairImage:
    """Sun's sets for own beside partner, stamped with the time of the state they show."""

    own: str
    partner: str
    state_time: float
    sun: SunImage

    @property
    def key(self) -> str:
        return pair_key(self.own, self.partner)

    @property
    def zone(self) -> Array:
        """(k, 2) warning zone of own's base, site frame [m]."""
        return self.sun.zone


def pair_key(own: str, partner: str) -> str:
    """ "own<-partner": own must avoid partner."""
    return f"{own}<-{partner}"


def ordered_pairs(snapshot: Snapshot, config: Config) -> list[tuple[str, str]]:
    """(own, partner) for which an image means something now: both valid and within `config.far`."""
    valid = {
        name
        for name, state in snapshot.machines.items()
        if state.pose.validity is Validity.VALID and state.body is not None
    }
    far = {frozenset((p.a, p.b)) for p in snapshot.pairs if not p.near}
    return [
        (own, partner)
        for own, partner in permutations(config.machines, 2)
        if own in config.own and {own, partner} <= valid and frozenset((own, partner)) not in far
    ]


def pair_image(
    snapshot: Snapshot, config: Config, own: str, partner: str, parameters: SunParameters
) -> PairImage:
    """Sun 2020, Eqs. (1)-(28) with partner as the obstacle A and own as B."""
    b, a = (
        sun_pose(config.machines[name], snapshot.machines[name].pose) for name in (own, partner)
    )
    image = sun_image(
        a, b, config.machines[own].max_reach, parameters.eta, parameters.m, parameters.n
    )
    return PairImage(own, partner, snapshot.state_time, image)


def frame_arrays(image: PairImage) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    """What a page draws, as float32: zone, theta, d, and the joint sets."""
    sun = image.sun
    arrays = {
        "zone": sun.zone,
        "theta": sun.theta,
        "d": sun.d,
        "boom": sun.joints.boom,
        "stick": sun.joints.stick,
        "bucket": sun.joints.bucket,
    }
    return {name: array.astype(np.float32) for name, array in arrays.items()}
