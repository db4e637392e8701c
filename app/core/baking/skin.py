"""Skin as a scattering medium, in three tones based on published measurements.

The boundary is a rough dielectric. The inside is an isotropic medium with reduced coefficients
(similarity theory), traced by a true random walk. The physics is that of the paper's
``kdsubsurface``, but without the diffusion approximation.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sqrt
from typing import Any

from app.core.base.errors import BakeError
from app.core.text import tr

Rgb = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Skin:
    """Optical properties of one skin tone.

    Attributes:
        scattering, absorption: Reduced coefficients for red, green and blue, per millimetre.
        index: Refractive index of the boundary.
        roughness: Microfacet roughness of the boundary.
        source: Publication from which the coefficients are taken.
    """

    name: str
    scattering: Rgb
    absorption: Rgb
    index: float = 1.4
    roughness: float = 0.3
    source: str = ""

    @property
    def extinction(self) -> Rgb:
        """Reduced extinction coefficients, per millimetre: reciprocals of the mean free paths."""
        r, g, b = (s + a for s, a in zip(self.scattering, self.absorption, strict=True))
        return r, g, b

    @property
    def albedo(self) -> Rgb:
        """Reduced single-scattering albedo."""
        r, g, b = (s / t for s, t in zip(self.scattering, self.extinction, strict=True))
        return r, g, b


@dataclass(frozen=True, slots=True)
class Coat:
    """A clear coat over a diffuse surface, used for the wet eye."""

    index: float
    roughness: float


EYE_COAT = Coat(index=1.376, roughness=0.2)


def skin_bsdf(skin: Skin) -> dict[str, Any]:
    """Return the Mitsuba description of the skin's surface."""
    return {
        "type": "roughdielectric",
        "distribution": "beckmann",
        "alpha": skin.roughness,
        "int_ior": skin.index,
        "ext_ior": 1.0,
    }


def eye_bsdf(coat: Coat) -> dict[str, Any]:
    """Return the Mitsuba description of the eye's surface: vertex colours under a wet coat."""
    return {
        "type": "principled",
        "base_color": {"type": "mesh_attribute", "name": "vertex_color"},
        "roughness": coat.roughness,
        "eta": coat.index,
    }


def dipole_reflectance(albedo: float, index: float) -> float:
    """Return the diffuse reflectance of a half-space with the given reduced albedo.

    The formula is equation 15 of Jensen, Marschner, Levoy and Hanrahan, "A Practical Model for
    Subsurface Light Transport", SIGGRAPH 2001, with their fit of the internal reflection.

    >>> round(dipole_reflectance(0.74 / (0.74 + 0.032), 1.3), 2)
    0.44
    """
    internal = -1.440 / index**2 + 0.710 / index + 0.668 + 0.0636 * index
    mismatch = (1 + internal) / (1 - internal)
    root = sqrt(3 * (1 - albedo))
    return albedo / 2 * (1 + exp(-4 / 3 * mismatch * root)) * exp(-root)


def _absorption_for(reflectance: float, scattering: float, index: float) -> float:
    """Find the absorption that produces a reflectance, by bisection."""
    low, high = 0.0, 100.0 * scattering
    for _ in range(80):
        middle = (low + high) / 2
        albedo = scattering / (scattering + middle)
        if dipole_reflectance(albedo, index) > reflectance:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def _from_reflectance(name: str, reflectance: Rgb, scattering: Rgb, source: str) -> Skin:
    # Jensen's refractive index of the boundary, so that reflectance and scattering match his data.
    r, g, b = (_absorption_for(x, s, 1.3) for x, s in zip(reflectance, scattering, strict=True))
    return Skin(name, scattering, (r, g, b), source=source)


_JENSEN = "Jensen et al., A Practical Model for Subsurface Light Transport, SIGGRAPH 2001, figure 5"
_CHART = (
    "McCamy, Marcus, Davidson, A Color-Rendition Chart, Journal of Applied Photographic "
    "Engineering 2(3), 1976"
)

SKINS: tuple[Skin, ...] = (
    _from_reflectance(
        "light",
        (0.539, 0.305, 0.223),
        (1.09, 1.59, 1.79),
        f"reflectance: patch “light skin” of {_CHART}; scattering: skin2 of {_JENSEN}",
    ),
    Skin(
        "medium",
        (0.74, 0.88, 1.01),
        (0.032, 0.17, 0.48),
        source=f"skin1 of {_JENSEN}",
    ),
    _from_reflectance(
        "dark",
        (0.171, 0.084, 0.058),
        (0.74, 0.88, 1.01),
        f"reflectance: patch “dark skin” of {_CHART}; scattering: skin1 of {_JENSEN}",
    ),
)


def find_skin(name: str) -> Skin:
    """Return a skin tone by name.

    Raises:
        BakeError: If there is no tone with that name.
    """
    for skin in SKINS:
        if skin.name == name:
            return skin
    names = ", ".join(skin.name for skin in SKINS)
    raise BakeError(
        tr("There is no skin tone “{name}”.", name=name),
        hint=tr("Choose from {names}.", names=names),
    )
