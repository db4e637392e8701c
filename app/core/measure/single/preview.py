"""Estimate the light from live preview pictures.

Automatic exposure clips the most important light: in 23 panoramas metered like a Theta S, the
preview loses between a tenth and nine tenths of the light. Clipped areas are taken to be three
stops brighter, the value at which the turns of the three best styles lose the least. An alternative
light shows which of these turns depend on that value. In this light, small clipped patches count as
lamps that are 5 / sqrt(solid angle) times as bright, a formula fitted to the same panoramas. A turn
that loses more than the audit's limit in the alternative light needs the bracket.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.colour import largest_channel, luminance, srgb_light
from app.core.environment.environment import energy, reduce_light, solid_angles
from app.core.measure.finish.clip_audit import DOUBT, choices, given_up
from app.core.measure.finish.lamp_detection import components
from app.core.measure.fisheye.circles import find_circles
from app.core.solver.solve import solve_all
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack

_CLIPPED_CODE: Final = 250
_BRIGHTER: Final = 8.0
_LAMP: Final = 5.0
_SPECK_SR: Final = 1e-5  # smaller patches count as this large
_COLUMNS: Final = 512
_BEST: Final = 3


@dataclass(frozen=True, slots=True)
class PreviewLight:
    """The likely light in a preview, and an alternative with small clipped patches as lamps.

    Attributes:
        light, lamps: (H, W, 3) float32. Linear Rec. 709, on an arbitrary scale.
        clipped_share: Fraction of the likely light that is clipped.
    """

    light: Float32 = field(repr=False)
    lamps: Float32 = field(repr=False)
    clipped_share: float


@dataclass(frozen=True, slots=True)
class RoughAnswer:
    """The rough answer for one style, which is `unsure` if its turn depends on clipped light."""

    result: StyleResult
    unsure: bool


def preview_light(picture: Bytes, shape: tuple[int, int]) -> PreviewLight | None:
    """Estimate the light of a preview picture.

    Args:
        picture: (h, 2 h, 3) uint8. Full panorama in sRGB.
        shape: Rows and columns of the result, which are those of the transport.

    Returns:
        The light, or None if the picture is not a full panorama, is not stitched or is black.
    """
    height, width = picture.shape[:2]
    if width != 2 * height or height < shape[0] or find_circles(picture) is not None:
        return None
    if width > _COLUMNS:
        size = (_COLUMNS, _COLUMNS // 2)
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    linear = srgb_light(picture)
    clipped = largest_channel(picture) >= _CLIPPED_CODE
    labels, count = components(clipped)
    areas = np.repeat(solid_angles(clipped.shape), clipped.shape[1])
    sizes = np.bincount(labels.ravel(), areas, count + 1)
    gains = np.maximum(_LAMP / np.sqrt(np.maximum(sizes, _SPECK_SR)), 1.0).astype(np.float32)
    gains[0] = 1.0
    likely = linear * np.where(clipped, np.float32(_BRIGHTER), np.float32(1.0))[..., None]
    total = float(energy(luminance(likely)))
    if total <= 0.0:
        return None
    # Reduce both at once, since reducing is most of the work.
    both = np.concatenate([likely, linear * gains[labels][..., None]], axis=-1)
    light, lamps = np.split(reduce_light(both, shape), 2, axis=-1)
    return PreviewLight(light, lamps, float(energy(luminance(likely) * clipped)) / total)


def rough_answers(preview: PreviewLight, pack: StylePack) -> tuple[RoughAnswer, ...]:
    """Return at most three of a preview's best styles, ordered by grade and then by match."""
    reach = [one for one in solve_all(pack, preview.light) if one.attainable]
    best = sorted(reach, key=lambda one: (one.grade == "soft", -one.match))[:_BEST]
    choice = choices(pack, [preview.light, preview.lamps])
    loss = given_up(choice[1], choice[0].turns)
    return tuple(RoughAnswer(one, bool(loss[pack.index(one.name)] > DOUBT)) for one in best)


def answers_of(picture: Bytes | None, pack: StylePack) -> tuple[RoughAnswer, ...] | None:
    """Return the best styles for a thumbnail, or None if the thumbnail is unusable."""
    preview = None if picture is None else preview_light(picture, pack.header.environment)
    return None if preview is None else rough_answers(preview, pack)
