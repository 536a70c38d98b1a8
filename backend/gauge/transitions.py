"""How transition curves bend: laws that grow from 0 to 1 along the way.

With u from 0 to 1, `bend` is f(u), `slope` its integral F(u) and `offset` the integral of that.
An *integrated* spiral has the curvature k(t) = k0 + (k1 - k0) f(t / L) along its arc length t. A
*direct* one is a function y(x) over the tangent at its straight end, with y'' = k f(x / P); P is
the stated length L (measured along the curve, as Autodesk Civil 3D defines its cubic parabola
y = x³ / (6 R L)) or the length X of the tangent (as Bentley OpenRail defines Japanese sine and
cubic). That the biquadratic parabola takes P = L was checked with a published track alignment,
whose directions at the three spirals' ends it gives to 1e-8 rad where P = X is off by 5e-5.

Laws: clothoid u; Bloss 3 u² - 2 u³ (Bloss 1936); cosine (1 - cos πu) / 2; sinusoid
u - sin(2πu) / 2π (Klein); biquadratic 2 u², then 1 - 2 (1 - u)² (Helmert, Schramm). Each turns by
half of the clothoid's L (k0 + k1), as f(u) + f(1 - u) = 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backend.spatial.types import Array

Function = Callable[[Array], Array]
PI = np.pi


@dataclass(frozen=True)
class Law:
    """bend f(u), slope F(u) and offset G(u): arrays of any shape in, the same shape out."""

    name: str
    bend: Function
    slope: Function
    offset: Function


LINEAR = Law("linear", lambda u: u, lambda u: u * u / 2, lambda u: u**3 / 6)
BLOSS = Law(
    "bloss",
    lambda u: u * u * (3 - 2 * u),
    lambda u: u**3 - u**4 / 2,
    lambda u: u**4 / 4 - u**5 / 10,
)
COSINE = Law(
    "cosine",
    lambda u: (1 - np.cos(PI * u)) / 2,
    lambda u: u / 2 - np.sin(PI * u) / (2 * PI),
    lambda u: u * u / 4 + (np.cos(PI * u) - 1) / (2 * PI**2),
)
SINUSOID = Law(
    "sinusoid",
    lambda u: u - np.sin(2 * PI * u) / (2 * PI),
    lambda u: u * u / 2 + (np.cos(2 * PI * u) - 1) / (4 * PI**2),
    lambda u: u**3 / 6 + np.sin(2 * PI * u) / (8 * PI**3) - u / (4 * PI**2),
)
BIQUADRATIC = Law(
    "biquadratic",
    lambda u: np.where(u <= 0.5, 2 * u * u, 1 - 2 * (1 - u) ** 2),
    lambda u: np.where(u <= 0.5, 2 * u**3 / 3, u - 0.5 + 2 * (1 - u) ** 3 / 3),
    lambda u: np.where(u <= 0.5, u**4 / 6, (u * u - u) / 2 - (1 - u) ** 4 / 6 + 7 / 48),
)

INTEGRATED = {
    "clothoid": LINEAR,
    "bloss": BLOSS,
    "cosine": COSINE,
    "sinusoid": SINUSOID,
    "biquadratic": BIQUADRATIC,
}
# Each with whether x counts to the tangent's length X rather than to the stated length L.
DIRECT = {
    "cubicParabola": (LINEAR, False),
    "cubic": (LINEAR, False),
    "biquadraticParabola": (BIQUADRATIC, False),
    "japaneseCubic": (LINEAR, True),
    "sineHalfWave": (COSINE, True),
}
# Names of the schema that it does not explain, or gives no numbers for.
UNDEFINED = {
    "weinerBogen": "its curvature needs the height of the centre of gravity, which LandXML lacks",
    "wienerBogen": "its curvature needs the height of the centre of gravity, which LandXML lacks",
    "radioid": "the schema does not say which radioid",
    "revBiquadratic": "the schema does not say what is reversed in a symmetric law",
    "revBloss": "the schema does not say what is reversed in a symmetric law",
    "revCosine": "the schema does not say what is reversed in a symmetric law",
    "revSinusoid": "the schema does not say what is reversed in a symmetric law",
}
