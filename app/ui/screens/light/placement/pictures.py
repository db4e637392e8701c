"""Pictures of the face with a lamp at a given position."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, TypeAlias

import numpy as np

from app.core.base.angles import TURNS, direction, wrap
from app.core.base.arrays import Bytes, Float32, Float64
from app.core.base.colour import LUMINANCE_WEIGHTS, FloatImage, luminance
from app.core.portrait.head import Head
from app.core.second_light.added_light import near_picture
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, placed_at
from app.core.second_light.contrast import less_mean
from app.core.second_light.in_hand import InHand
from app.core.second_light.lamp_answers import (
    Answers,
    LampPosition,
    LampQuestion,
    best_held,
)
from app.core.second_light.placements import ALTITUDES_DEG
from app.core.second_light.search import LampPlacement
from app.core.second_light.visible_change import VisibleChange, visible_change
from app.core.solver.peaks import value_at
from app.core.solver.place_light import Facing, picture_at, pictures_at, turned
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import Grade
from app.core.solver.style_verdict import judge, measure_picture
from app.core.solver.transport import render, to_image
from app.core.solver.turn_choice import LIMITS
from app.core.styles.lamps import far_lamp
from app.core.styles.style import StyleLamp

Size: TypeAlias = tuple[int, int]
"""Size of a picture, in rows and columns of device pixels."""

_ROWS: Final = len(ALTITUDES_DEG)
_STEP_DEG: Final = 5.625

_HARDLY_LESS: Final = 0.97  # fraction of the best match, as for the tolerance arc


@dataclass(frozen=True, slots=True, eq=False)
class LampView:
    """A style with the lamp at one position.

    Attributes:
        with_lamp: The face lit by the place and the lamp, (h, w, 3) uint8 sRGB.
        without: The face lit by the place alone, at the style's best turn without a lamp,
            (h, w, 3) uint8 sRGB.
        target: The style's target, (h, w, 3) uint8 sRGB.
    """

    answers: Answers
    name: str
    position: LampPosition
    size: Size
    with_lamp: Bytes = field(repr=False)
    without: Bytes = field(repr=False)
    target: Bytes = field(repr=False)
    match: float
    strength: float
    attainable: bool
    grade: Grade | None
    change: VisibleChange


def result_with(answers: Answers, name: str, position: LampPosition, match: float) -> StyleResult:
    """Return the result for a style at every turn while the lamp stays at a fixed position."""
    one = answers.of(name)
    if one is None:
        raise KeyError(name)
    question = answers.question
    facing = wrap(one.turn_refined_deg + question.front_deg)
    curve = _match_curve(answers, name, position)
    # The search uses whole steps and rounds differently, so shift the curve to the displayed match.
    curve = np.clip(curve + (match - value_at(curve, facing)), -100.0, 100.0)
    if position == best_held(one):
        curve = np.minimum(curve, match)
    before = one.before.seen_from(-question.front_deg)
    return replace(
        before,
        turn_deg=wrap(one.turn_deg + question.front_deg),
        turn_refined_deg=facing,
        direction=direction(facing),
        match_curve=curve,
        match=match,
        attainable=match >= LIMITS.match,
        arc_deg=_arc(curve, facing, _HARDLY_LESS * match),
        peaks=(),
    )


def _match_curve(answers: Answers, name: str, position: LampPosition) -> Float64:
    """Return 64 matches with the lamp fixed. At index k, the sitter faces azimuth 5.625° * k."""
    hand, question = answers.hand, answers.question
    transport = hand.head.transport
    lamp, hidden = _of_lamp(hand, position)
    visible_share = ((1.0 - hidden) * question.gain)[..., None]
    light = question.light.searched
    turns = np.stack([np.roll(light, -k, axis=1) * visible_share for k in range(TURNS)], axis=-1)
    rows = transport.texel_basis @ turns.reshape(len(visible_share) * visible_share.shape[1], -1)
    coordinates = rows.reshape(len(rows), 3, TURNS)
    grey = luminance(lamp).astype(np.float64)[:, None] + sum(
        weight * (transport.pixel_basis[c] @ coordinates[:, c])
        for c, weight in enumerate(LUMINANCE_WEIGHTS)
    )
    return _matches(hand.head, name, grey)


def _matches(head: Head, name: str, grey: Float64) -> Float64:
    """Return the matches of n pictures in the face region, given their luminance, (P, n)."""
    root = np.sqrt(head.pack.region_on(head.transport))
    flat = head.pack.target(name).reshape(-1, 3)[head.transport.pixels]
    target = less_mean(luminance(flat), root)
    pictures = less_mean(grey.T, root)
    size = np.linalg.norm(target) * np.linalg.norm(pictures, axis=1)
    return np.asarray(100.0 * (pictures @ target) / np.maximum(size, 1e-30))


def _arc(curve: Float64, turn_deg: float, least: float) -> tuple[float, float]:
    """Return both ends, in degrees, of the arc around a turn where a curve is at least `least`."""
    steps = np.arange(360)
    nodes = np.arange(TURNS + 1) * _STEP_DEG
    around = np.interp((turn_deg + steps) % 360.0, nodes, np.append(curve, curve[0])) >= least
    if around.all():
        return -180.0, 180.0
    after, before = np.argmin(around[1:]), np.argmin(around[:0:-1])
    return wrap(turn_deg - float(before)), wrap(turn_deg + float(after))


def portrait_with(
    answers: Answers, name: str, position: LampPosition, facing_deg: float, size: Size
) -> Bytes:
    """Render a style's portrait, facing a panorama azimuth, with the lamp at a position."""
    hand, question = answers.hand, answers.question
    parts = _parts(hand, question, position, facing_deg)
    here = Facing(question.light, facing_deg, hand.head.expose_of(name))
    return _picture(hand, position, here, parts, size)


def _parts(
    hand: InHand, question: LampQuestion, position: LampPosition, facing_deg: float
) -> list[Float32]:
    """Return (P, 3) pictures lit by the place alone and by the lamp alone, in the place's units."""
    lamp, hidden = _of_lamp(hand, position)
    place = turned(question.light, facing_deg, hand.head.transport.environment_shape)
    picture = render(hand.head.transport, place * (1.0 - hidden)[..., None])
    return [picture, lamp / np.float32(question.gain)]


def _picture(
    hand: InHand, position: LampPosition, here: Facing, parts: Sequence[Float32], size: Size
) -> Bytes:
    """Combine the pictures from `_parts` into a portrait."""
    pictures = [to_image(hand.head.transport, part) for part in parts]
    return hand.head.portrait_with(here, [*pictures, _far(hand, position)], size)


def _far(hand: InHand, position: LampPosition) -> FloatImage:
    """Return the lamp as a distant light, (H, W, 3), with the same apparent size."""
    lamp, spot = hand.lamp, (position.azimuth_deg, position.altitude_deg)
    if isinstance(lamp, CapturedLamp):
        return placed_at(lamp, *spot)[0]
    radius_m = math.sqrt(math.prod(lamp.size_m) / math.pi)
    wide_deg = 2.0 * math.degrees(math.atan(radius_m / lamp.distance_m))
    one = StyleLamp(*spot, wide_deg, 1.0, lamp.distance_m)
    light = far_lamp(one, hand.head.transport.environment_shape)
    return np.asarray(light[..., None] * np.asarray(lamp.colour), np.float32)


def targets(head: Head, size: Size, names: Sequence[str] | None = None) -> dict[str, Bytes]:
    """Render sRGB target portraits, keyed by style name, for some styles or for all by default."""
    pack = head.pack
    style_names = [style.name for style in pack.styles] if names is None else names
    linear = np.stack([pack.target(name) for name in style_names])
    lamps = [pack.styles[pack.index(name)] for name in style_names]
    return dict(zip(style_names, head.portraits(linear, size, lamps), strict=True))


def look(
    answers: Answers, name: str, position: LampPosition, size: Size, before: LampView | None
) -> LampView:
    """Render a style both with the lamp at a position and without the lamp.

    Raises:
        KeyError: If there is no answer for the style.
    """
    one = answers.of(name)
    if one is None:
        raise KeyError(name)
    hand, question = answers.hand, answers.question
    facing = wrap(one.turn_refined_deg + question.front_deg)
    parts = _parts(hand, question, position, facing)
    head, row = hand.head, hand.head.pack.index(name)
    picture = np.add(*parts)
    grey = luminance(picture * np.float32(question.gain))
    measures = measure_picture(head.pack, head.transport, grey)
    verdict = judge(head.pack, row, measures, LIMITS)
    here = Facing(question.light, facing, head.expose_of(name))
    portrait = _picture(hand, position, here, parts, size)
    if before is not None and (before.answers, before.name, before.size) == (answers, name, size):
        without, target = before.without, before.target
    else:
        without, target = _without(answers, one, size), targets(hand.head, size, (name,))[name]
    return LampView(
        answers,
        name,
        position,
        size,
        portrait,
        without,
        target,
        float(measures.match[row]),
        float(measures.strength[row]),
        verdict.attainable,
        verdict.grade,
        _change(answers, one, here, to_image(head.transport, picture)),
    )


def _change(answers: Answers, one: LampPlacement, here: Facing, lit: FloatImage) -> VisibleChange:
    """Compare a picture with the lamp with those without it, as in `PlacePictures.change`.

    Args:
        lit: (N, N, 3) float32. Linear Rec. 709 on black, in the unit of the place.
    """
    head, question = answers.hand.head, answers.question
    turns = one.before.turn_refined_deg + question.front_deg, here.turn_deg
    alone = pictures_at(head.transport, question.light, turns)
    lights = [replace(here, turn_deg=turn) for turn in (*turns, here.turn_deg)]
    gains = head.exposures([*alone, lit], lights)
    best, same, after = (
        each * np.float32(gain) for each, gain in zip((*alone, lit), gains, strict=True)
    )
    coverage = to_image(head.transport, head.transport.coverage)
    face_pixels = int(np.count_nonzero(head.pack.region))
    changes = [visible_change(each, after, coverage, face_pixels) for each in (best, same)]
    return min(changes, key=lambda change: change.delta_lightness)


def _of_lamp(hand: InHand, position: LampPosition) -> tuple[Float32, Float32]:
    """Return the lamp's picture, (P, 3) in cd/m2, and the hidden fraction of each texel, (H, W)."""
    lamp, spot = hand.lamp, (position.azimuth_deg, position.altitude_deg)
    if isinstance(lamp, CapturedLamp):
        light, hidden = placed_at(lamp, *spot)
        return render(hand.head.transport, light) * np.float32(position.power), hidden
    picture = near_picture(hand.base.near, lamp, *spot) * np.float32(position.power)
    return picture, _hidden(hand.lamp_light.alpha, spot)


def _hidden(alpha: Float32, spot: tuple[float, float]) -> Float32:
    """Interpolate the hidden fraction of each texel from the four placements nearest to `spot`."""
    columns = len(alpha) // _ROWS
    across = spot[0] / _STEP_DEG
    up = (spot[1] - float(ALTITUDES_DEG[0])) / float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
    up = min(max(up, 0.0), _ROWS - 1.0)
    left, lower = math.floor(across), min(math.floor(up), _ROWS - 2)
    beside, above = np.float32(across - left), np.float32(up - lower)

    def at(row: int) -> Float32:
        start = row * columns
        first, second = alpha[start + left % columns], alpha[start + (left + 1) % columns]
        return np.asarray(first + (second - first) * beside)

    low: Float32 = at(lower)
    return low + (at(lower + 1) - low) * above


def _without(answers: Answers, one: LampPlacement, size: Size) -> Bytes:
    """Render a portrait in the place's own light at the style's best turn without a lamp."""
    head, light = answers.hand.head, answers.question.light
    facing = wrap(one.before.turn_refined_deg + answers.question.front_deg)
    here = Facing(light, facing, head.expose_of(one.name))
    return head.portrait(picture_at(head.transport, light, facing), size, here)
