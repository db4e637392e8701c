"""Estimate the light of a place from a face at many turns.

Each turn shows the same head, with the same light rotated around it. Together, all turns determine
the light by deconvolution, and with it the exposure of each frame. The face's own albedo is
ambiguous, since a pattern that is the same at every turn may also be light from above. For each
azimuth frequency, the pictures are products of the light and the transport (eq. 1 for all turns at
once, as in `app.core.solver.search`). The light is constrained to be non-negative (FISTA: A. Beck
and M. Teboulle, SIAM J. Imaging Sciences 2009).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS
from app.core.base.arrays import Bools, Float32, Float64
from app.core.environment.environment import energy, solid_angles
from app.core.faces.face_on_head import head_map

_DAMPING: Final = 1e-4  # relative to the largest eigenvalue; suppresses light that no skin shows
_HELD_NEAR: Final = 1e-3  # the same, towards the expected light
_FLOOR: Final = 0.5  # lower limit, relative to the expected light
MOST: Final = 4.0
"""Upper limit of the light, relative to the light that is visible and not clipped."""

_ROUNDS: Final = 8  # fits of light and exposures in turn
_STEPS: Final = 60
_NEAR_DEG: Final = 6.0  # frames farther from a turn do not show it
_FEWEST: Final = 0.02  # weight below which a pixel counts as hidden


@dataclass(frozen=True, slots=True, eq=False)
class FaceTurns:
    """A face, seen at `TURNS` turns.

    Attributes:
        pictures: (Q, 64) float64. Luminance at the pixels of `head_map().skin`, with each turn at
            its own exposure.
        visible: (Q, 64) bool. Whether each pixel is visible at each turn.
        levels: (n,) float64. Mean luminance of the skin in each frame, as exposed by the camera.
    """

    pictures: Float64 = field(repr=False)
    visible: Bools = field(repr=False)
    levels: Float64 = field(repr=False)

    @property
    def turns(self) -> Bools:
        """A mask of the grid turns that the video shows, (64,) bool."""
        return np.asarray(self.visible.any(axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class FilmedLight:
    """The light estimated from a video.

    Attributes:
        luminance: (H, W) float64. Light in panorama coordinates, with the video's first turn in the
            middle and a mean of 1 over the sphere.
        exposures: (64,) float64. Factors that convert the picture at each turn to the unit of
            `luminance`.
        misfit: Deviation of the model from the pictures, relative to the pictures' own contrast.
    """

    luminance: Float64 = field(repr=False)
    exposures: Float64 = field(repr=False)
    misfit: float


def gather(turns_deg: Float64, greys: Float32, visible: Bools, trust: Float64) -> FaceTurns:
    """Combine the frames into one picture for each turn of the grid.

    Args:
        turns_deg: (n,) float64. Direction of the nose in each frame, in degrees.
        greys, visible: (n, N * N) float32 and bool, from `app.core.faces.face_on_head.on_head`.
        trust: (n,) float64. Weight of each frame.
    """
    skin = head_map().skin
    values, there = greys[:, skin].astype(np.float64), visible[:, skin]
    level = (values * there).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    values /= np.maximum(level, 1e-9)[:, None]
    away = np.abs((turns_deg[:, None] - np.arange(TURNS) * 360 / TURNS + 180) % 360 - 180)
    weights = np.maximum(1 - away / _NEAR_DEG, 0) * trust[:, None]
    total = there.T.astype(np.float64) @ weights
    pictures = (there * values).T @ weights / np.maximum(total, 1e-9)
    return FaceTurns(pictures, total > _FEWEST, level)


@dataclass(frozen=True, slots=True, eq=False)
class _TurnedTransport:
    """The light transport of the skin by azimuth frequency.

    Attributes:
        spectra: (Q, H, M). The transport.
        products: (M, H, H). Products of the transport with itself.
        largest: Largest eigenvalue of the products.
    """

    spectra: NDArray[np.complex128]
    products: NDArray[np.complex128]
    largest: float
    shape: tuple[int, int]

    def pictures(self, light: Float64) -> Float64:
        """Return the pictures of the skin at all turns, (Q, 64), under a light, (H, W)."""
        spectrum = np.fft.rfft(light, axis=1)
        images = np.einsum("qhm,hm->mq", self.spectra, spectrum, optimize=True)
        return np.asarray(np.fft.irfft(images.T, n=self.shape[1], axis=1))

    def against(self, pictures: Float64) -> NDArray[np.complex128]:
        """Apply the adjoint of the transport to pictures, (Q, 64). The result is (H, M)."""
        spectrum = np.fft.rfft(pictures, axis=1)
        return np.asarray(np.einsum("qhm,qm->hm", self.spectra.conj(), spectrum, optimize=True))


@lru_cache(maxsize=1)
def _transport() -> _TurnedTransport:
    head = head_map()
    shape = head.transport.environment_shape
    rows = head.transport.luminance_basis[head.skin[head.transport.pixels]].astype(np.float64)
    texels = head.transport.texel_basis.reshape(-1, *shape)
    basis = np.conj(np.fft.rfft(texels, axis=2))
    spectra = np.einsum("qr,rhm->qhm", rows, basis, optimize=True)
    by_frequency = spectra.transpose(2, 0, 1)
    products = by_frequency.conj().transpose(0, 2, 1) @ by_frequency
    largest = max(float(np.linalg.eigvalsh(one)[-1]) for one in products)
    return _TurnedTransport(spectra, products, largest, shape)


def find_light(
    turns: FaceTurns, likely: FilmedLight | None = None, most: Float64 | float = np.inf
) -> FilmedLight:
    """Estimate the light that explains a face at the given turns.

    Args:
        likely: The light to expect where the face carries no information, and the initial
            exposures.
        most: The upper limit of the light, as (H, W) or as one number, in the unit of `likely`.
    """
    transport = _transport()
    prior = np.zeros(transport.shape) if likely is None else likely.luminance
    light = prior
    pictures = np.where(turns.visible, turns.pictures, 1.0)
    exposures = np.ones(TURNS) if likely is None else likely.exposures
    for _ in range(_ROUNDS):
        light = _fit_light(transport, pictures * exposures, light, prior, most)
        images = transport.pictures(light)
        both = (turns.visible * images * turns.pictures).sum(axis=0)
        alone = (turns.visible * turns.pictures**2).sum(axis=0)
        exposures = np.where(alone > 0, both / np.maximum(alone, 1e-12), 1.0)
        if likely is None:
            exposures /= exposures[turns.turns].mean()
        unseen = images / exposures
        pictures = np.where(turns.visible, turns.pictures, unseen)
    values = turns.pictures * exposures
    residual = (images - values)[turns.visible]
    contrast = (values - values.mean(axis=0))[turns.visible]
    mean = max(float(energy(light.astype(np.float32))) / (4 * np.pi), 1e-12)
    misfit = float(residual.std() / max(contrast.std(), 1e-9))
    return FilmedLight(light / mean, exposures / mean, misfit)


def _fit_light(
    transport: _TurnedTransport,
    pictures: Float64,
    start: Float64,
    prior: Float64,
    most: Float64 | float,
) -> Float64:
    """Return the non-negative light, (H, W), that best explains pictures, (Q, 64), near `prior`."""
    target, width = transport.against(pictures), transport.shape[1]
    solid = solid_angles(transport.shape)[:, None]
    share = _HELD_NEAR if prior.any() else _DAMPING
    damping = share * transport.largest * solid / solid.max()
    light, ahead, pace = start, start, 1.0
    for _ in range(_STEPS):
        spectrum = np.fft.rfft(ahead, axis=1).T[:, :, None]
        slope = np.fft.irfft((transport.products @ spectrum)[:, :, 0].T - target, n=width, axis=1)
        step = ahead - (slope + damping * (ahead - prior)) / (transport.largest * (1 + share))
        new, faster = np.clip(step, _FLOOR * prior, most), (1 + np.sqrt(1 + 4 * pace**2)) / 2
        ahead = new + (pace - 1) / faster * (new - light)
        light, pace = new, faster
    return np.asarray(light)
