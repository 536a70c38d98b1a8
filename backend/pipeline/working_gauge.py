"""Which bodies of the site hold for a machine now: as drawn, as switched, not its own track."""

from __future__ import annotations

from collections.abc import Mapping

from backend.fusion.pose import Validity
from backend.pipeline.config import Config
from backend.pipeline.records import GaugeInForce, MachineState
from backend.site.gauge_choice import GaugeChoice
from backend.site.gauge_in_force import in_force, left_out, own_tracks
from backend.site.named_bodies import SiteBodies


def site_of(own: str, gauge: GaugeInForce, config: Config) -> SiteBodies:
    """What stands on the site and keeps `own` away; the same object while nothing changes."""
    return left_out(in_force(config.site, gauge.choice), gauge.own_tracks.get(own, ()))


def following(
    before: GaugeInForce,
    choice: GaugeChoice | None,
    machines: Mapping[str, MachineState],
    config: Config,
) -> GaugeInForce:
    """What holds in this cycle; the same object as before when that is the same.

    choice: of operators, None for as before. For a machine whose pose is not VALID nothing is left
    out.
    """
    chosen = before.choice if choice is None or choice == before.choice else choice
    bodies = in_force(config.site, chosen)
    tracks = {}
    for name in config.own:
        pose = machines[name].pose
        if bodies.volumes and pose.validity is Validity.VALID:
            stood_on = before.own_tracks.get(name, ())
            on = own_tracks(bodies, pose.position, pose.yaw, stood_on)
            if on:
                tracks[name] = on
    if chosen is before.choice and tracks == before.own_tracks:
        return before
    return GaugeInForce(chosen, tracks)
