"""What does not move: light, ground plane, UTM grid, north arrow, obstacles, working gauge."""

from __future__ import annotations

import numpy as np
import viser

from backend.site.gauge_choice import GaugeChoice
from cockpit.views import palette
from cockpit.views.inputs import SceneSite, drawn_gauge
from cockpit.views.lettering import width, written
from cockpit.views.shapes import Float32, box_mesh, feature_edges, polyline

MAJOR = 10.0  # [m] between labelled lines; 5 on a small site
MINOR = 0.2  # as a share of the labelled distance
LETTER = 0.03  # height, as a share of half the ground's side


def light(scene: viser.SceneApi) -> None:
    """Soft light from the sky and one sun without shadows: cheap on weak graphics."""
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=(214, 226, 236), ground_color=(58, 62, 66), intensity=2.2
    )
    scene.add_light_directional(
        "/light/sun", color=(255, 246, 232), intensity=2.0, position=(-6.0, -10.0, 14.0)
    )
    scene.add_light_directional(
        "/light/fill", color=(200, 216, 235), intensity=0.55, position=(9.0, 5.0, 4.0)
    )


class Ground:
    """Made once for a centre; `height` follows the machines' ground."""

    def __init__(
        self,
        scene: viser.SceneApi,
        site: SceneSite,
        center: tuple[float, float],
        reach: tuple[float, float],
    ) -> None:
        """center: (x, y) of the machines; reach: how far they go from it in x and y [m]."""
        major = MAJOR if max(reach) > 16.0 else MAJOR / 2.0
        half = major * float(np.ceil((max(reach) + 0.5 * major + 1.0) / major))
        corner = grid_origin(site.origin, center, major)
        self._node = scene.add_frame("/ground", show_axes=False)
        scene.add_grid(
            "/ground/grid",
            width=2.0 * half,
            height=2.0 * half,
            position=(corner[0], corner[1], -0.01),
            cell_size=MINOR * major,
            section_size=major,
            cell_color=palette.GRID_MINOR,
            section_color=palette.GRID_MAJOR,
            section_thickness=1.2,
            fade_distance=12.0 * half,
            plane_color=palette.PANEL,
            plane_opacity=1.0,
            shadow_opacity=0.0,
        )
        west_south = (center[0] - reach[0], center[1] - reach[1])
        lines = grid_labels(site.origin, corner, west_south, half, major)
        _lines(scene, "/ground/utm", lines, palette.LETTERING, 1.6)
        arrow = LETTER * half * 1.6 * north_arrow()
        arrow += np.float32([center[0] + reach[0], center[1] + 0.75 * reach[1], 0.0])
        _lines(scene, "/ground/north", arrow, palette.SECONDARY, 2.2)
        self._obstacles(scene, site)

    def _obstacles(self, scene: viser.SceneApi, site: SceneSite) -> None:
        if not len(site.obstacles):
            return
        vertices, faces = box_mesh(site.obstacles)
        scene.add_mesh_simple(
            "/obstacles",
            vertices,
            faces,
            color=palette.SITE,
            opacity=0.55,
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
        _lines(scene, "/obstacles/edges", feature_edges(vertices, faces), palette.SITE, 1.4)

    @property
    def height(self) -> float:
        return float(self._node.position[2])

    @height.setter
    def height(self, value: float) -> None:
        self._node.position = (0.0, 0.0, value)


class GaugeNodes:
    """The working gauge. Nothing that can be seen is there: fainter than obstacles."""

    def __init__(self, scene: viser.SceneApi, site: SceneSite) -> None:
        self._scene, self._site = scene, site
        self._shown: GaugeChoice | None = None
        self._node: viser.MeshHandle | None = None

    def update(self, choice: GaugeChoice) -> None:
        """Made anew when operators drew or switched something."""
        if choice == self._shown:
            return
        self._shown = choice
        boxes = drawn_gauge(self._site, choice)
        if self._node is not None:
            self._node.remove()  # its edges go with it
            self._node = None
        if not len(boxes):
            return
        vertices, faces = box_mesh(boxes)
        self._node = self._scene.add_mesh_simple(
            "/gauge",
            vertices,
            faces,
            color=palette.SITE,
            opacity=0.16,
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
        _lines(self._scene, "/gauge/edges", feature_edges(vertices, faces), palette.SITE, 1.0)


def ground_height(heights: list[float], before: float) -> float:
    """The ground [m] under the lowest of the placed machines; kept while it changes by < 0.5 m."""
    lowest = min(heights, default=before)
    return lowest if abs(lowest - before) > 0.5 else before


def grid_origin(
    origin: tuple[float, float, float], center: tuple[float, float], major: float
) -> tuple[float, float]:
    """The point of the site frame nearest to `center` where round UTM lines cross [m]."""
    east = major * round((origin[0] + center[0]) / major) - origin[0]
    north = major * round((origin[1] + center[1]) / major) - origin[1]
    return float(east), float(north)


def grid_labels(
    origin: tuple[float, float, float],
    corner: tuple[float, float],
    west_south: tuple[float, float],
    half: float,
    major: float,
) -> Float32:
    """Eastings and northings on the ground, as strokes (k, 2, 3).

    corner: where round lines cross; west_south: x that the northings stay left of and y that the
    eastings stay below; half: half the ground's side; major: from line to line [m].
    """
    strokes = []
    letter = LETTER * half
    steps = np.arange(-np.floor(half / major), np.floor(half / major) + 1) * major
    for x, y in zip(corner[0] + steps, corner[1] + steps, strict=True):
        if x >= west_south[0] - 0.5 * major:
            easting = f"{round(origin[0] + x)}E"
            strokes.append(
                written(easting, (x + 0.4 * letter, west_south[1] - 1.6 * letter), letter)
            )
        if y >= west_south[1]:
            northing = f"{round(origin[1] + y)}N"
            left = west_south[0] - 0.6 * letter - width(northing, letter)
            strokes.append(written(northing, (left, y + 0.4 * letter), letter))
    return np.concatenate(strokes)


def north_arrow() -> Float32:
    """An arrow to grid north with its letter, 2 m long, as strokes (k, 2, 3)."""
    head = np.array([[-0.35, 0.7], [0.0, 1.5], [0.35, 0.7], [0.0, 0.9]])
    shaft = np.array([[0.0, -0.5], [0.0, 0.9]])
    letter = written("N", (-0.16, 1.75), 0.64)
    return np.concatenate([polyline(head, True), polyline(shaft, False), letter])


def _lines(
    scene: viser.SceneApi, name: str, lines: Float32, color: palette.Rgb, pixels: float
) -> viser.LineSegmentsHandle:
    return scene.add_line_segments(
        name,
        lines,
        palette.line(color),
        thickness=pixels,
        thickness_units="screen",
        position=(0.0, 0.0, 0.004),
    )
