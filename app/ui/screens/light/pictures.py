"""Pictures of a face with a lamp anywhere around it, fast enough to follow a hand."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.angles import TURNS, direction, wrap
from app.core.base.colour import LUMINANCE_WEIGHTS, luminance
from app.core.second_light.captured import CapturedLamp, placed_at
from app.core.second_light.near import near_picture
from app.core.second_light.placements import ALTITUDES_DEG
from app.core.solver.place_light import turned
from app.core.solver.portraits import framing, portraits, value_at
from app.core.solver.transport import render, to_image
from app.ui.screens.light.work import best_held

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.second_light.search import Placed
    from app.core.solver.solve import StyleResult
    from app.ui.presenters.model import Head
    from app.ui.screens.light.state import Size
    from app.ui.screens.light.work import Answers, Held, InHand, Question

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Float64: TypeAlias = NDArray[np.float64]

_STEP_DEG: Final = 5.625
_HIDES_ROWS: Final = len(ALTITUDES_DEG)
_HARDLY_LESS: Final = 0.97  # of the best match: the rule of the tolerance arc


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A style with the lamp at one spot.

    Attributes
    ----------
    with_lamp : (h, w, 3) uint8
        sRGB.
    without : (h, w, 3) uint8
        Of the place alone, at its own best turn.
    target : (h, w, 3) uint8
        Of the style.
    """

    answers: Answers
    name: str
    held: Held
    size: Size
    with_lamp: Bytes = field(repr=False)
    without: Bytes = field(repr=False)
    target: Bytes = field(repr=False)
    match: float
    strength: float


@dataclass(frozen=True, slots=True, eq=False)
class LampPlan:
    """The lamp that belongs to a turn: one value for every screen on the way there.

    Attributes
    ----------
    hold, where : str
        "Hold the LED panel in front, raised 28°, at full power", and how far from head and skin.
    """

    answers: Answers = field(repr=False)
    held: Held
    lamp: str
    hold: str
    where: str
    result: StyleResult = field(repr=False)


def result_with(answers: Answers, name: str, held: Held, match: float) -> StyleResult:
    """Answer for a style with the lamp held at a spot, whatever the turn."""
    one = answers.of(name)
    if one is None:
        raise KeyError(name)
    question = answers.question
    facing = wrap(one.turn_refined_deg + question.front_deg)
    curve = _match_curve(answers, name, held)
    # The search looks at whole steps and rounds a little otherwise: the number shown counts.
    curve = np.clip(curve + (match - value_at(curve, facing)), -100.0, 100.0)
    if held == best_held(one):
        curve = np.minimum(curve, match)
    before = one.before.seen_from(-question.front_deg)
    return replace(
        before,
        turn_deg=wrap(one.turn_deg + question.front_deg),
        turn_refined_deg=facing,
        direction=direction(facing),
        match_curve=curve,
        match=match,
        attainable=match >= question.limits.match,
        arc_deg=_arc(curve, facing, _HARDLY_LESS * match),
        peaks=(),
    )


def _match_curve(answers: Answers, name: str, held: Held) -> Float64:
    """(64,) match with the lamp held at a spot, the sitter facing azimuth 5.625 k deg."""
    hand, question = answers.hand, answers.question
    transport, pack = hand.head.transport, hand.head.pack
    lamp, hidden = _of_lamp(hand, held)
    left = ((1.0 - hidden) * question.gain)[..., None]
    light = question.light.searched
    turns = np.stack([np.roll(light, -k, axis=1) * left for k in range(TURNS)], axis=-1)
    rows = transport.texel_basis @ turns.reshape(len(left) * left.shape[1], -1)
    coordinates = rows.reshape(len(rows), 3, TURNS)
    face = transport.face
    seen = luminance(lamp[face]).astype(np.float64)[:, None] + sum(
        weight * (transport.pixel_basis[c][face] @ coordinates[:, c])
        for c, weight in enumerate(LUMINANCE_WEIGHTS)
    )
    flat = pack.target(name).reshape(-1, 3)[transport.pixels[face]]
    wanted = luminance(flat).astype(np.float64)
    wanted -= wanted.mean()
    seen -= seen.mean(axis=0)
    size = np.linalg.norm(wanted) * np.linalg.norm(seen, axis=0)
    curve: Float64 = 100.0 * (wanted @ seen) / np.maximum(size, 1e-30)
    return curve


def _arc(curve: Float64, turn_deg: float, least: float) -> tuple[float, float]:
    """Follow a curve from a turn both ways, by degrees, as long as it gives enough."""
    steps = np.arange(360)
    nodes = np.arange(TURNS + 1) * _STEP_DEG
    around = np.interp((turn_deg + steps) % 360.0, nodes, np.append(curve, curve[0])) >= least
    if around.all():
        return -180.0, 180.0
    after, before = np.argmin(around[1:]), np.argmin(around[:0:-1])
    return wrap(turn_deg - float(before)), wrap(turn_deg + float(after))


def portrait_with(plan: LampPlan, facing_deg: float, size: Size) -> Bytes:
    """Portrait with the lamp held where a plan says, the face at an azimuth of the panorama."""
    hand, question = plan.answers.hand, plan.answers.question
    return _portrait(hand.head, _lit(hand, question, plan.held, facing_deg), size)


def _lit(hand: InHand, question: Question, held: Held, facing_deg: float) -> Float32:
    """Picture (P, 3) of the place and the lamp together, cd/m2."""
    lamp, hidden = _of_lamp(hand, held)
    place = turned(question.light, facing_deg, hand.head.transport.environment_shape)
    place = place * ((1.0 - hidden) * question.gain)[..., None]
    return render(hand.head.transport, place) + lamp


def targets(head: Head, size: Size, names: Sequence[str] | None = None) -> dict[str, Bytes]:
    """Make the target portraits of styles, of all by default: sRGB, by name."""
    pack = head.pack
    wanted = [style.name for style in pack.styles] if names is None else names
    linear = np.stack([pack.target(name) for name in wanted])
    shown = portraits(linear, pack.coverage.astype(np.float32), framing(pack.header.picture, size))
    return dict(zip(wanted, shown, strict=True))


def look(answers: Answers, name: str, held: Held, size: Size, known: View | None) -> View:
    """Make the pictures of a style with the lamp at a spot, and without it.

    Raises
    ------
    KeyError
        If there is no answer for the style.
    """
    one = answers.of(name)
    if one is None:
        raise KeyError(name)
    hand, question = answers.hand, answers.question
    facing = wrap(one.turn_refined_deg + question.front_deg)
    picture = _lit(hand, question, held, facing)
    match, strength = _judge(hand.head, name, picture)
    shown = _portrait(hand.head, picture, size)
    if known is not None and (known.answers, known.name, known.size) == (answers, name, size):
        without, target = known.without, known.target
    else:
        without, target = _without(answers, one, size), targets(hand.head, size, (name,))[name]
    return View(answers, name, held, size, shown, without, target, match, strength)


def _of_lamp(hand: InHand, held: Held) -> tuple[Float32, Float32]:
    """Picture (P, 3) under the lamp alone, cd/m2, and the share (H, W) of texels it hides."""
    lamp, spot = hand.lamp, (held.azimuth_deg, held.altitude_deg)
    if isinstance(lamp, CapturedLamp):
        light, hidden = placed_at(lamp, *spot)
        return render(hand.head.transport, light) * np.float32(held.power), hidden
    picture = near_picture(hand.near, lamp, *spot) * np.float32(held.power)
    return picture, _hidden(hand.added.alpha, spot)


def _hidden(alpha: Float32, spot: tuple[float, float]) -> Float32:
    """Share of each texel that is hidden, between the four placements around a spot."""
    columns = len(alpha) // _HIDES_ROWS
    across = spot[0] / _STEP_DEG
    up = (spot[1] - float(ALTITUDES_DEG[0])) / float(ALTITUDES_DEG[1] - ALTITUDES_DEG[0])
    up = min(max(up, 0.0), _HIDES_ROWS - 1.0)
    left, lower = math.floor(across), min(math.floor(up), _HIDES_ROWS - 2)
    beside, above = np.float32(across - left), np.float32(up - lower)

    def at(row: int) -> Float32:
        start = row * columns
        first, second = alpha[start + left % columns], alpha[start + (left + 1) % columns]
        mixed: Float32 = first + (second - first) * beside
        return mixed

    low: Float32 = at(lower)
    return low + (at(lower + 1) - low) * above


def _without(answers: Answers, one: Placed, size: Size) -> Bytes:
    """Portrait in the place's own light, at the best turn that it has without a lamp."""
    head, light = answers.hand.head, answers.question.light
    facing = wrap(one.before.turn_refined_deg + answers.question.front_deg)
    picture = render(head.transport, turned(light, facing, head.transport.environment_shape))
    return _portrait(head, picture, size)


def _portrait(head: Head, picture: Float32, size: Size) -> Bytes:
    linear = to_image(head.transport, picture)[np.newaxis]
    coverage = head.pack.coverage.astype(np.float32)
    shown: Bytes = portraits(linear, coverage, framing(head.transport.size, size))[0]
    return shown


def _judge(head: Head, name: str, picture: Float32) -> tuple[float, float]:
    """Match and strength of a picture (P, 3), see the definitions in `app.core.solver.solve`."""
    transport, pack = head.transport, head.pack
    face = transport.face
    flat = pack.target(name).reshape(-1, 3)[transport.pixels[face]]
    wanted, seen = (luminance(one).astype(np.float64) for one in (flat, picture[face]))
    span = float(np.ptp(wanted))
    weights = (wanted - wanted.mean()) / max(span, 1e-30)
    mean = float(seen.mean())
    quality = float(weights @ seen)
    contrast = math.sqrt(float(weights @ weights)) * float(np.linalg.norm(seen - mean))
    match = 100.0 * quality / contrast if contrast > 0 else 0.0
    studio = float(pack.studio_ratio[pack.index(name)])
    strength = 100.0 * quality / max(mean, 1e-30) / studio if studio > 0 else 0.0
    return match, strength
