"""The site frame: local east-north-up metres about an origin given in a projected CRS.

Site coordinates are projected coordinates minus the origin, so the axes are grid east, grid north
and up. Grid metres differ from ground metres by the projection's scale at the origin
(`SiteFrame.scale`; 5e-5 at Sun's site), which nothing here corrects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from pyproj import CRS, Geod, Transformer
from pyproj.aoi import AreaOfInterest
from pyproj.exceptions import ProjError

from backend.errors import InputError
from backend.spatial.types import Array

HEADING_REFERENCES = ("grid", "true")
AREA_MARGIN = 3.0  # how far outside the CRS's area of use the origin may lie [deg]
SCALE_TOLERANCE = 0.01  # rules out Web Mercator and mistyped zones, whose metres are not metres
_STEP = 1e-5  # of finite differences [deg], about 1.1 m


@dataclass(frozen=True)
class SiteFrame:
    """Geodetic and projected positions to the site frame and back.

    epsg: a projected CRS with axes east and north in metres; origin: (easting, northing, height)
    of the site frame's origin [m]; geoid_offset: ellipsoidal height minus the CRS's height [m];
    heading_reference: "grid" or "true" (sensors count from true north; `grid_yaw` corrects them).
    Raises InputError when any of these is not usable. Latitudes and longitudes are WGS 84.
    """

    epsg: int
    origin: tuple[float, float, float]
    geoid_offset: float = 0.0
    heading_reference: str = "grid"
    scale: float = field(init=False)  # grid metres per ground metre, northwards at the origin
    _to_projected: Transformer = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.heading_reference not in HEADING_REFERENCES:
            raise InputError(
                f'heading_reference is "{self.heading_reference}"; allowed are "grid" and "true".'
            )
        if len(self.origin) != 3 or not all(math.isfinite(v) for v in self.origin):
            raise InputError(
                f"origin is {list(self.origin)}; allowed are three finite numbers: "
                "easting, northing, height [m]."
            )
        if not math.isfinite(self.geoid_offset) or abs(self.geoid_offset) > 200.0:
            raise InputError(
                f"geoid_offset is {self.geoid_offset}; allowed is -200 to 200 m "
                "(geoid heights on Earth lie between -107 and 86 m)."
            )
        crs = _projected_crs(self.epsg)
        longitude, latitude = _origin_geodetic(crs, self.epsg, self.origin)
        # One operation for the whole site: limited to the origin's surroundings PROJ has a single
        # candidate and cannot switch between datum shifts, so positions never jump.
        near = AreaOfInterest(longitude - 0.1, latitude - 0.1, longitude + 0.1, latitude + 0.1)
        transformer = Transformer.from_crs("EPSG:4326", crs, always_xy=True, area_of_interest=near)
        object.__setattr__(self, "_to_projected", transformer)
        ahead = transformer.transform(longitude, latitude + _STEP)
        here = transformer.transform(longitude, latitude)
        ground = Geod(ellps="WGS84").inv(longitude, latitude, longitude, latitude + _STEP)[2]
        scale = math.dist(here, ahead) / ground
        if not abs(scale - 1.0) < SCALE_TOLERANCE:
            raise InputError(
                f"epsg is {self.epsg}: its metres are {scale:.3f} ground metres at the origin; "
                "allowed is a projected CRS whose scale at the site is within 1 % of 1."
            )
        object.__setattr__(self, "scale", scale)

    def from_geodetic(self, latitude: float, longitude: float, height: float) -> Array:
        """(3,) site frame [m] of latitude, longitude [deg] and ellipsoidal height [m].

        Infinite where the projection has no value.
        """
        easting, northing = self._to_projected.transform(longitude, latitude)
        east, north, up = self.origin
        return np.array([easting - east, northing - north, height - self.geoid_offset - up])

    def to_geodetic(self, position: Array) -> tuple[float, float, float]:
        """(latitude, longitude [deg], ellipsoidal height [m]) of a point (3,) of the site [m]."""
        easting, northing, height = self.to_projected(position).tolist()
        longitude, latitude = self._to_projected.transform(easting, northing, direction="INVERSE")
        return float(latitude), float(longitude), height + self.geoid_offset

    def from_geodetic_many(self, geodetic: Array) -> Array:
        """(..., 3) site frame [m] of (..., 3) latitude, longitude [deg], ellipsoidal height [m]."""
        points = np.asarray(geodetic, dtype=float)
        easting, northing = self._to_projected.transform(points[..., 1], points[..., 0])
        height = points[..., 2] - self.geoid_offset
        return np.asarray(np.stack([easting, northing, height], axis=-1) - self.origin)

    def to_geodetic_many(self, positions: Array) -> Array:
        """(..., 3) latitude, longitude [deg], ellipsoidal height [m] of site points (..., 3)."""
        projected = self.to_projected(positions)
        longitude, latitude = self._to_projected.transform(
            projected[..., 0], projected[..., 1], direction="INVERSE"
        )
        height = projected[..., 2] + self.geoid_offset
        return np.stack([latitude, longitude, height], axis=-1)

    def from_projected(self, position: Array) -> Array:
        """(..., 3) site frame [m] of (..., 3) easting, northing, height in the CRS [m]."""
        return np.asarray(np.asarray(position, dtype=float) - self.origin)

    def to_projected(self, position: Array) -> Array:
        """(..., 3) easting, northing, height in the CRS [m] of site points (..., 3) [m]."""
        return np.asarray(np.asarray(position, dtype=float) + self.origin)

    def convergence(self, position: Array) -> float:
        """Grid convergence [rad] at a point (3,) of the site [m].

        The bearing of grid north from true north, clockwise positive (the sign of PROJ and of
        national mapping agencies): negative west of the central meridian in the northern
        hemisphere, -1.31 deg at Sun's site. Grid bearing = true bearing - convergence; with yaw
        counter-clockwise from east, grid yaw = true yaw + convergence.
        """
        latitude, longitude, _ = self.to_geodetic(position)
        e0, n0 = self._to_projected.transform(longitude, latitude)
        e1, n1 = self._to_projected.transform(longitude, latitude + _STEP)
        # True north points to grid bearing -convergence.
        return -math.atan2(e1 - e0, n1 - n0)

    def grid_yaw(self, heading: float, position: Array) -> float:
        """Yaw from grid east [rad] of a measured heading (from east, CCW) at a site point (3,)."""
        if self.heading_reference == "grid":
            return heading
        return heading + self.convergence(position)


def _projected_crs(epsg: int) -> CRS:
    try:
        crs = CRS.from_epsg(epsg)
    except ProjError as error:
        raise InputError(
            f"epsg is {epsg}, which is not a known coordinate reference system; allowed is the "
            "EPSG code of a projected CRS in metres, for example 32652."
        ) from error
    axes = {(axis.direction, axis.unit_name) for axis in crs.axis_info}
    if crs.type_name != "Projected CRS" or axes != {("east", "metre"), ("north", "metre")}:
        shown = ", ".join(f"{axis.direction} in {axis.unit_name}" for axis in crs.axis_info)
        raise InputError(
            f"epsg is {epsg} ({crs.type_name.lower()} {crs.name}; axes {shown}); allowed is a "
            "projected CRS with axes east and north in metres, for example 32652."
        )
    return crs


def _origin_geodetic(
    crs: CRS, epsg: int, origin: tuple[float, float, float]
) -> tuple[float, float]:
    """(longitude, latitude) [deg] of the origin; raises InputError when far outside the CRS."""
    plain = Transformer.from_crs(crs.geodetic_crs, crs, always_xy=True)
    longitude, latitude = plain.transform(origin[0], origin[1], direction="INVERSE")
    area = crs.area_of_use
    inside = math.isfinite(longitude) and math.isfinite(latitude)
    if inside and area is not None:
        west, south, east, north = area.bounds
        width = (east - west) % 360.0 or 360.0
        eastwards = (longitude - west + AREA_MARGIN) % 360.0
        inside = eastwards <= width + 2 * AREA_MARGIN
        inside &= south - AREA_MARGIN <= latitude <= north + AREA_MARGIN
    if not inside:
        raise InputError(
            f"origin is {list(origin)}, which lies outside the area of EPSG:{epsg} ({crs.name}); "
            "allowed is easting, northing, height in that CRS [m]."
        )
    return float(longitude), float(latitude)
