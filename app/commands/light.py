"""``turnlight light``: find the best turn and second-light position for each style."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.commands.shared.arguments import (
    add_lens,
    add_questions,
    argument,
    asked_lens,
    asked_pack,
    environment_facts,
    finite,
    studio_facts,
)
from app.commands.shared.printing import (
    answer,
    fields,
    numbers,
    points,
    reach_facts,
    say,
    short,
)
from app.core.base.angles import whole, wrap
from app.core.base.arrays import Floats
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.environment.environment import read_environment, reduce
from app.core.measure.fisheye.circles import check_stitched
from app.core.portrait.head_views import load_views_of
from app.core.second_light.added_light import AddedLight, from_captured, from_numbers
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, grey_lamp, place_lamp
from app.core.second_light.captured_lamps.lamp_capture import read_lamp_file
from app.core.second_light.captured_lamps.lamp_library import lamps_folder, list_lamps, read_lamp
from app.core.second_light.contrast import prepare_face
from app.core.second_light.lamp_on_turned_head import seen_aside
from app.core.second_light.lamp_presets import (
    FULL,
    KINDS,
    NumbersLamp,
    parse,
    powers_of,
)
from app.core.second_light.place_brightness import (
    ASSUMED_LUX,
    Comparison,
    check_lux,
    compare,
    illuminance,
    stated_white,
    with_lux,
)
from app.core.second_light.placements import above_floor, direction, within_arm
from app.core.second_light.search import LampPlacement, place_all
from app.core.solver.head_shape import HeadShape, load_shape_of
from app.core.solver.lens.lens_wish import STRAIGHT
from app.core.solver.search import luminance_of
from app.core.solver.style_result import StyleResult
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_transport_of
from app.core.styles.styles import select
from app.core.text import tr
from app.words.lamps import (
    HARDLY_CHANGES,
    comparison_words,
    lamp_title,
    mask_warnings,
    power_words,
)
from app.words.phrases.directions import aside_words, placement_words
from app.words.phrases.quantities import lower_first, metres
from app.words.remarks import sentences
from app.words.why_out_of_reach import reason_sentence

_Lamp: TypeAlias = NumbersLamp | CapturedLamp

_POWERS = ("best", "full")
_REACHES = ("any", "floor", "arm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``light``."""
    parser.description = tr(
        "Find how far to turn and where to hold a lamp to get a style at a place. "
        "Azimuth is measured from the front of the face, positive towards the sitter’s left. "
        "Altitude is positive upwards. Distances are measured from the middle of the head."
    )
    add_questions(parser, run)
    add_lens(parser)
    add = partial(argument, parser)
    add(
        "--lamp LAMP",
        tr(
            "KIND or KIND@METRES ({kinds}), a panorama of a lamp in a dark room, or a "
            "lamp in your library",
            kinds=", ".join(KINDS),
        ),
        required=True,
    )
    add(
        "--greedy",
        tr(
            "choose the turn first, then the lamp position, a variant also tested in the "
            "paper; by default, all combinations are tried"
        ),
        action="store_true",
    )
    add(
        "--power",
        tr(
            "for lamps from numbers: choose the best power, or always use full power, as the "
            "paper’s objective does (default: %(default)s)"
        ),
        choices=_POWERS,
    )
    add(
        "--lux E",
        tr(
            "illuminance at the face, facing the photographer, for a panorama that does "
            "not record its brightness"
        ),
        type=finite,
    )
    add(
        "--lamp-lux E",
        tr(
            "light meter reading taken where the camera was, facing the lamp, for a captured "
            "lamp whose brightness is not recorded"
        ),
        type=finite,
    )
    add(
        "--reach",
        tr(
            "lamp positions to try: anywhere, above floor level or within the sitter’s own "
            "reach (default: %(default)s)"
        ),
        choices=_REACHES,
    )


@dataclass(frozen=True, slots=True)
class _Scale:
    """The brightness of the place, and whether it is only an assumption."""

    gain: float
    lux: float
    is_assumed: bool


def run(args: argparse.Namespace) -> int:
    """Find the best turn and lamp position for each style."""
    start = time.perf_counter()
    lamp = _find_lamp(args.lamp, args.lamp_lux)
    pack = asked_pack(args)
    names = [style.name for style in select(pack.styles, args.style)]
    environment = read_environment(args.environment, args.layer)
    check_stitched(environment.radiance, environment.name)
    say(*sentences(environment.warnings))
    radiance = reduce(environment, pack.header.environment)
    scale = _scale(radiance, args, lamp)
    comparison = _compare(lamp, scale)
    light: Floats = radiance * np.float32(scale.gain)
    if args.grey:
        light = luminance_of(light)
        lamp = grey_lamp(lamp) if isinstance(lamp, CapturedLamp) else lamp
    transport = load_transport_of(pack, args.head)
    shape = load_shape_of(transport, args.head)
    face = prepare_face(transport, pack.region_on(transport))
    if isinstance(lamp, NumbersLamp):
        lamp_light = from_numbers(transport, shape, lamp, face=face)
    else:
        lamp_light = from_captured(transport, place_lamp(lamp), face=face)
    start_s = time.perf_counter()
    placements = place_all(
        pack,
        transport,
        light,
        lamp_light,
        args.objective,
        styles=names,
        is_open=_allow_mask(args.reach, lamp_light.distance_m),
        greedy=args.greedy,
        powers=_powers(lamp, args),
        front_deg=args.front,
    )
    wish = asked_lens(args)
    if wish != STRAIGHT:
        near = lamp if isinstance(lamp, NumbersLamp) else None
        colours = light if light.ndim == 3 else np.repeat(light[..., None], 3, axis=2)
        views = load_views_of(pack, args.head)
        placements = seen_aside(pack, views, placements, colours, lamp_light, near, wish)
    end_s = time.perf_counter()
    times = {"seconds": round(end_s - start, 4), "search_seconds": round(end_s - start_s, 4)}
    facts = _as_json(placements, args, lamp_light, shape, scale)
    facts |= {"grey": True} if args.grey else {}
    facts |= environment_facts(environment)
    facts |= {
        "comparable": not scale.is_assumed if comparison is None else comparison.possible,
        "comparison": "" if comparison is None else comparison_words(comparison),
        **times,
    }
    return answer(args, facts, _table(placements, lamp_light, shape, pack, environment.name, scale))


def _find_lamp(text: str, lux: float | None = None) -> _Lamp:
    """Find a lamp by name.

    If `lux` is given, set a captured lamp's illuminance at its camera to this value.
    """
    lamp = _lamp_named(text)
    if lux is None:
        return lamp
    if isinstance(lamp, NumbersLamp):
        raise CoreError(
            tr("The brightness of {title} is already known.", title=lamp_title(lamp.kind)),
            tr("Leave out --lamp-lux, or use a capture of the lamp."),
        )
    return with_lux(lamp, lux)


def _lamp_named(text: str) -> _Lamp:
    if text.strip().lower().partition("@")[0] in KINDS:
        return parse(text)
    if Path(text).suffix.lower() in (".exr", ".hdr"):
        capture = read_lamp_file(text)
        say(*sentences(capture.warnings), *mask_warnings(capture.mask))
        return capture.lamp
    if "@" in text:
        # Only lamp presets have a distance in their names; the error message lists the presets.
        return parse(text)
    folder = lamps_folder()
    if list_lamps(folder)[0]:
        return read_lamp(folder, text)
    raise CoreError(
        tr("“{text}” is neither a built-in lamp nor a lamp in your library.", text=text),
        tr(
            "Available: {kinds}. Add your own with “turnlight lamp add”.",
            kinds=", ".join(KINDS),
        ),
    )


def _scale(radiance: FloatImage, args: argparse.Namespace, lamp: _Lamp) -> _Scale:
    """Return the luminance in cd/m2 of radiance 1, as set by the user, stored or assumed."""
    relative = illuminance(radiance, args.front)
    if args.lux is not None:
        return _scale_from(check_lux(args.lux), relative)
    white = stated_white(args.environment)
    if white is not None:
        return _Scale(white, white * relative, False)
    if isinstance(lamp, CapturedLamp) and lamp.white_cd_m2 is None:
        # Neither brightness is known, so assume equal scales (see `_compare`).
        return _Scale(1.0, relative, True)
    say(
        tr(
            "This panorama does not record how bright the place is. {lux:g} lux at the "
            "face is assumed; set another value with --lux.",
            lux=ASSUMED_LUX,
        )
    )
    scale = _scale_from(ASSUMED_LUX, relative)
    return _Scale(scale.gain, scale.lux, True)


def _compare(lamp: _Lamp, scale: _Scale) -> Comparison | None:
    """Compare a captured lamp with the place, and warn if their relative brightness is unknown."""
    if isinstance(lamp, NumbersLamp):
        return None
    comparison = compare(None if scale.is_assumed else scale.gain, lamp)
    if not comparison.possible:
        words = tr(
            "{reason} (Use --lamp-lux for the lamp and --lux for the place.)",
            reason=comparison_words(comparison),
        )
        if lamp.white_cd_m2 is None and scale.is_assumed:
            unit_words = tr(
                "Both are assumed to have the same scale here, as if captured in the same way."
            )
        else:
            unit_words = (
                tr("The lamp’s values are assumed to be cd/m² here.")
                if lamp.white_cd_m2 is None
                else ""
            )
        say(f"{words} {unit_words}".rstrip())
    return comparison


def _scale_from(lux: float, relative: float) -> _Scale:
    if relative <= 0.0:
        raise CoreError(
            tr("No light comes from where the photographer stands."), tr("Choose another --front.")
        )
    return _Scale(lux / relative, lux, False)


def _allow_mask(reach: str, distance_m: float | None) -> NDArray[np.bool_] | None:
    if reach == "any":
        return None
    if distance_m is None:
        raise CoreError(
            tr("The distance of this lamp is unknown."),
            tr("Leave out --reach, or capture the lamp again."),
        )
    open_mask = above_floor(distance_m)
    return open_mask & within_arm(distance_m) if reach == "arm" else open_mask


def _powers(lamp: _Lamp, args: argparse.Namespace) -> tuple[float, ...]:
    dimmed = args.power == "best" and args.objective == "picture"
    return powers_of(lamp.kind) if dimmed and isinstance(lamp, NumbersLamp) else FULL


def _as_json(
    placements: Sequence[LampPlacement],
    args: argparse.Namespace,
    lamp_light: AddedLight,
    shape: HeadShape,
    scale: _Scale,
) -> dict[str, Any]:
    styles = [_style_json(one, lamp_light, shape) for one in placements]
    values: dict[str, Any] = {
        "objective": args.objective,
        "head": args.head,
        **studio_facts(args),
        "lamp": lamp_light.name,
        "lamp_title": lamp_title(lamp_light.name, lamp_light.title),
        "distance_m": lamp_light.distance_m,
        "front_deg": args.front,
        "reach": args.reach,
        "greedy": args.greedy,
        "illuminance_lux": short(scale.lux),
        "cd_m2_per_unit": short(scale.gain),
        "assumed": scale.is_assumed,
        "rescues": [one.name for one in placements if one.rescued],
        "styles": styles,
    }
    return {**values, **styles[0]} if len(styles) == 1 else values


def _style_json(one: LampPlacement, lamp_light: AddedLight, shape: HeadShape) -> dict[str, Any]:
    return {
        **fields(one, "name", "title", "side", "turn_deg"),
        "turn_refined_deg": round(one.turn_refined_deg, 6),
        "nose_deg": round(wrap(one.turn_refined_deg - one.yaw_deg), 6),
        "background_deg": round(wrap(one.turn_refined_deg + 180.0), 6),
        **fields(one, "yaw_deg", "lighting", "lamp_azimuth_deg", "lamp_altitude_deg"),
        "lamp_azimuth_refined_deg": round(one.lamp_azimuth_refined_deg, 6),
        "lamp_altitude_refined_deg": round(one.lamp_altitude_refined_deg, 6),
        "words": _words(one, lamp_light, shape),
        "power": one.power,
        "power_words": power_words(one.power, lamp_light.name),
        "quality": short(one.quality),
        "match": short(one.match),
        "strength": short(one.strength),
        **reach_facts(one),
        **fields(one, "rescued", "evaluated", "hardly_changed"),
        "visible_change": round(one.change.delta_lightness, 2),
        "before": numbers(one.before) | reach_facts(one.before),
    }


def _words(one: LampPlacement, lamp_light: AddedLight, shape: HeadShape) -> str:
    azimuth, altitude = one.lamp_azimuth_refined_deg, one.lamp_altitude_refined_deg
    distance = lamp_light.distance_m
    skin = None
    if distance is not None:
        skin = shape.distance_to_skin(direction(azimuth, altitude) * distance)
    return placement_words(azimuth, altitude, distance, skin)


def _table(
    placements: Sequence[LampPlacement],
    lamp_light: AddedLight,
    shape: HeadShape,
    pack: StylePack,
    place: str,
    scale: _Scale,
) -> str:
    lux = f"{scale.lux:.3g}"
    light = tr("{lux} lux (assumed)", lux=lux) if scale.is_assumed else tr("{lux} lux", lux=lux)
    values = {
        "place": place,
        "light": light,
        "lamp": lamp_title(lamp_light.name, lamp_light.title),
        "head": pack.header.head,
    }
    first = tr("{place} at {light}, {lamp}, head {head}", **values)
    if lamp_light.distance_m is not None:
        first = tr(
            "{place} at {light}, {lamp}, {distance} from the middle of head {head}",
            distance=metres(lamp_light.distance_m),
            **values,
        )
    heads = (tr("style"), tr("without"), tr("with"), tr("turn"), tr("where to hold the lamp"))
    lines = [first, "", "{:<18}{:>8}{:>6}{:>8}  {}".format(*heads)]
    for one in placements:
        azimuth, altitude = one.lamp_azimuth_refined_deg, one.lamp_altitude_refined_deg
        hold = placement_words(azimuth, altitude)
        if one.yaw_deg:
            hold += f", {aside_words(one.yaw_deg)}"
        if one.power != 1.0:
            hold += f", {power_words(one.power, lamp_light.name)}"
        if not one.attainable:
            hold += f"; {reason_sentence(one.shortfall)}"
        elif one.hardly_changed:
            hold += f"; {lower_first(HARDLY_CHANGES)}"
        lines.append(
            f"{one.name:<18}{_points(one.before):>8}"
            f"{_points(one):>6}{whole(one.turn_refined_deg):>7}°  {hold}"
        )
    rescued = ", ".join(one.name for one in placements if one.rescued) or tr("none")
    lines += ["", tr("Match is out of 100, in brackets where the style is out of reach.")]
    if len(placements) == 1:
        lines.append(tr("Hold the lamp {where}.", where=_words(placements[0], lamp_light, shape)))
    lines.append(tr("Now possible with the lamp: {rescued}.", rescued=rescued))
    return "\n".join(lines)


def _points(one: LampPlacement | StyleResult) -> str:
    value = points(one.match)
    return value if one.attainable else f"({value})"
