"""A second light at all placements, prepared for one head: what the search needs of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.errors import CoreError
from app.core.base.progress import Report, Token, silent, span
from app.core.second_light.contrast import (
    Contrast,
    FaceBasis,
    Hidden,
    find_contrast,
    find_hidden,
    prepare_face,
    two_parts,
)
from app.core.second_light.near import NearField, coverage, near_luminances, prepare_near
from app.core.second_light.placements import COUNT
from app.core.solver.environment import SHAPE

if TYPE_CHECKING:
    from app.core.base.arrays import Float32, Float64, Floats
    from app.core.second_light.captured import PlacedLamp
    from app.core.second_light.lamp_presets import NumbersLamp
    from app.core.solver.head_shape import HeadShape
    from app.core.solver.transport import Transport


_BATCH: Final = 64


@dataclass(frozen=True, slots=True, eq=False)
class AddedLight:
    """One lamp at all placements, for one head. Its arrays must not be written to."""

    name: str
    title: str
    distance_m: float | None  # from the middle of the head; None where nobody said
    # (576, 32, 64), share of each texel that the lamp hides, head frame
    alpha: Float32 = field(repr=False)
    # (576, 32, 64, 3), premultiplied radiance of a captured lamp, linear Rec. 709, cd/m2; None of
    # a near lamp from numbers, which is no environment
    light: Float32 | None = field(repr=False)
    # (576, P), luminance of the head under the lamp alone, in the same unit
    pictures: Float32 = field(repr=False)
    # (3,), radiance of the face of a lamp from numbers, linear Rec. 709, cd/m2; 0 of a captured
    # one
    glow: Float64 = field(repr=False)
    absolute: bool  # whether all that is in cd/m2; otherwise in a unit of the capture's own
    hidden: Hidden = field(repr=False)
    contrast: Contrast = field(repr=False)

    def over(self, light: Floats, number: int, power: float = 1.0) -> Float64:
        """Composite the lamp over a place's light (eq. 7).

        `light`: (32, 64, 3) float, linear Rec. 709 radiance as the face sees it, cd/m2.
        Returns (32, 64, 3) float64: what a lamp from numbers gives is the picture beside it, not
        this: here it shines as if it were far away.
        """
        share = self.alpha[number][..., None].astype(np.float64)
        own = share * self.glow if self.light is None else self.light[number]
        whole: Float64 = light * (1.0 - share) + power * own
        return whole


def from_numbers(
    transport: Transport,
    shape: HeadShape,
    lamp: NumbersLamp,
    token: Token | None = None,
    report: Report = silent,
    *,
    near: NearField | None = None,
    face: FaceBasis | None = None,
) -> AddedLight:
    """Prepare a lamp from numbers, with the near field of its distance.

    Raises CoreError if the head takes environments of another size.
    """
    face = prepare_face(transport) if face is None else face
    near = prepare_near(transport, shape) if near is None else near
    if token is not None:
        token.check()
    pictures = near_luminances(near, lamp, token, span(report, 0.0, 0.7))
    alpha = coverage(lamp, SHAPE)
    hidden = find_hidden(alpha)
    report(0.7, "Sorting what the lamp hides")
    lit, beside = _in_basis(face, pictures[:, transport.face])
    contrast = find_contrast(face, hidden, lit, beside)
    report(1.0, "done")
    return AddedLight(
        name=lamp.kind,
        title=lamp.title,
        distance_m=lamp.distance_m,
        alpha=alpha,
        light=None,
        pictures=pictures,
        glow=lamp.luminance * np.asarray(lamp.colour, np.float64),
        absolute=True,
        hidden=hidden,
        contrast=contrast,
    )


def from_captured(
    transport: Transport,
    placed: PlacedLamp,
    token: Token | None = None,
    report: Report = silent,
    *,
    face: FaceBasis | None = None,
) -> AddedLight:
    """Prepare a captured lamp.

    Raises CoreError if the head or the lamp is of another size, or the lamp is none.
    """
    _check(placed)
    face = prepare_face(transport) if face is None else face
    report(0.3, f"Sorting what {placed.title} hides")
    hidden = find_hidden(placed.alpha)
    parts = two_parts(placed.light, face.mixing).reshape(COUNT, -1)
    contrast = find_contrast(face, hidden, face.rows @ parts.T, np.zeros(COUNT))
    report(0.8, f"Holding {placed.title} all around")
    pictures = _luminances(transport, placed.light, token)
    report(1.0, "done")
    return AddedLight(
        name=placed.name,
        title=placed.title,
        distance_m=placed.distance_m,
        alpha=placed.alpha,
        light=placed.light,
        pictures=pictures,
        glow=np.zeros(3),
        absolute=placed.absolute,
        hidden=hidden,
        contrast=contrast,
    )


def _check(placed: PlacedLamp) -> None:
    right = placed.light.shape == (COUNT, *SHAPE, 3) and placed.alpha.shape == (COUNT, *SHAPE)
    if not right or not np.isfinite(placed.light).all() or placed.light.min() < 0:
        raise CoreError(f"{placed.title} is no lamp as the search takes it.", "Capture it again.")
    # False of what is not a number, too.
    if not ((placed.alpha >= 0) & (placed.alpha <= 1)).all():
        raise CoreError(f"The mask of {placed.title} is damaged.", "Make it again.")


def _in_basis(face: FaceBasis, pictures: Float32) -> tuple[Float64, Float64]:
    """(K, 576) coordinates of pictures on the face, and (576,) squared norms beside the basis."""
    centred = pictures.astype(np.float64)
    centred -= centred.mean(axis=1, keepdims=True)
    basis = face.pixels.astype(np.float64)
    found: Float64 = (centred @ basis).T
    beside = np.square(centred).sum(axis=1) - np.square(found).sum(axis=0)
    return found, np.maximum(beside, 0.0)


def _luminances(transport: Transport, light: Float32, token: Token | None) -> Float32:
    """(576, P) luminance of the head under environments."""
    weights = transport.header.luminance_weights
    pictures = np.zeros((len(light), len(transport.pixels)), np.float32)
    texels = np.ascontiguousarray(transport.texel_basis.T)
    for start in range(0, len(light), _BATCH):
        if token is not None:
            token.check()
        part = slice(start, start + _BATCH)
        flat = light[part].reshape(-1, texels.shape[0], 3)
        for channel, weight in enumerate(weights):
            seen = (flat[:, :, channel] @ texels) * np.float32(weight)
            pictures[part] += seen @ transport.pixel_basis[channel].T
    return pictures
