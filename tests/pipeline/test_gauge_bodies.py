"""The working gauge among what a machine can touch: names, margins, joint images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from test_step import config, inputs, run

from backend.cspace.cells import SITE
from backend.gauge.features import Area, Ceiling, Overhead
from backend.gauge.rules import Rules, volumes_of
from backend.pipeline.config import Config
from backend.pipeline.exact import Cells, own_image
from backend.pipeline.surroundings import surroundings_of
from backend.site.named_bodies import SiteBodies
from backend.spatial.boxes import concatenated

__all__ = ["config", "inputs"]

FENCE = np.array([[0.0, 2.9], [6.0, 2.9], [6.0, 3.1], [0.0, 3.1]])
VOLUMES = volumes_of(
    [
        Area("fence", "keep_out", FENCE, 0.0, 2.0),
        Overhead("wire", np.array([[-20.0, 0.0, 4.0], [20.0, 0.0, 4.0]])),
        Ceiling("low", 60.0),
    ],
    Rules(),
)
BODIES = SiteBodies(
    concatenated(volume.boxes for volume in VOLUMES),
    tuple(name for volume in VOLUMES for name in volume.box_names),
    VOLUMES,
)


def test_margins_and_images_end_at_limit_volumes(config: Config) -> None:
    gauged = replace(config, site=BODIES)
    q = {"a": (0.35, 0.5, -1.0, 0.5), "b": (0.0, 0.5, -1.0, 0.5)}
    snapshot = run(gauged, 0.4, b_position=(6.5, 0.3), q=q)[-1]
    assert surroundings_of("a", snapshot.machines, gauged).names[:2] == (
        "gauge:fence/0",
        "gauge:wire/0",
    )
    hits = {freedom.hits for both in snapshot.margins["a"].joints for freedom in both}
    assert {"gauge:fence/0", "gauge:wire/0"} <= hits
    cells = Cells(slice=12, bar=48, volume=8, reach=(12, 8))
    bars = {bar.joint: bar.cells for bar in own_image(snapshot, gauged, "a", cells).bars}
    assert (bars["swing"] & SITE).any()
    assert (bars["boom"] & SITE).any()
    without = replace(config, site=SiteBodies())
    free = run(without, 0.4, b_position=(6.5, 0.3), q=q)[-1]
    bars = {bar.joint: bar.cells for bar in own_image(free, without, "a", cells).bars}
    assert not any((row & SITE).any() for row in bars.values())
