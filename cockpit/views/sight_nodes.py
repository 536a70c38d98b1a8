"""The operators' field of view and what their machines hide from them, on the ground."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from backend.pipeline.records import Body3D, MachineState
from backend.spatial.types import Array
from cockpit.views import palette, sight
from cockpit.views.inputs import SceneMachine
from cockpit.views.lines import Lines, ink
from cockpit.views.shapes import NO_LINE

PERIOD = 0.4  # between two drawings of one machine [s]
STILL = 0.03  # change of its bodies' places that is worth drawing anew [m]
BLIND, EYES = ink(palette.BLIND), ink(palette.EYES)


class SightNodes:
    """For the machines whose description says where the eyes are; nodes are made once."""

    def __init__(self, scene: viser.SceneApi, machines: Mapping[str, SceneMachine]) -> None:
        self._scene = scene
        self._eyes = {name: m.model.eye for name, m in machines.items() if m.model.eye is not None}
        self._nodes: dict[str, tuple[Lines, Lines]] = {}
        self._drawn: dict[str, tuple[float, float, Array]] = {}

    def update(
        self, machines: Mapping[str, MachineState], shown: bool, ground: float, now: float
    ) -> None:
        """shown: whether the site has LiDARs; ground: its height [m]; now: monotonic [s]."""
        for name, eye in self._eyes.items():
            state = machines.get(name)
            body = state.body if state is not None and shown else None
            if body is None:
                for lines in self._nodes.get(name, ()):
                    lines.draw(NO_LINE[:0], BLIND)
                self._drawn.pop(name, None)
                continue
            before = self._drawn.get(name)
            if before is not None and not _worth(before, body, ground, now):
                continue
            self._drawn[name] = (now, ground, body.boxes.centers)
            place = body.link_poses[eye.link] @ np.append(eye.position, 1.0)
            self._draw(name, place[:3], body, ground)

    def _draw(self, name: str, eye: Array, body: Body3D, ground: float) -> None:
        if name not in self._nodes:
            root = f"/sight/{name}"
            self._nodes[name] = (
                Lines(self._scene, f"{root}/blind", 1.2),
                Lines(self._scene, f"{root}/field", 1.2),
            )
        unseen = sight.hidden(eye, body.azimuth, body.boxes, ground)
        blind, field = self._nodes[name]
        up = np.array([0.0, 0.0, ground + 0.012], dtype=np.float32)
        field.draw(sight.frame(eye, body.azimuth, unseen) + up, EYES)
        unseen[1::2] = False  # every second line says as much, and more quietly
        blind.draw(sight.fan(eye, body.azimuth, unseen) + up, BLIND)


def _worth(before: tuple[float, float, Array], body: Body3D, ground: float, now: float) -> bool:
    drawn, height, centers = before
    if now - drawn < PERIOD:
        return False
    return ground != height or bool(np.abs(body.boxes.centers - centers).max() > STILL)
