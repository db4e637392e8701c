"""``turnlight render``: a picture of the head under an environment, at any turn."""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from app.commands.arguments import (
    MOST_DEG,
    add_json,
    add_layer,
    argument,
    check_ending,
    check_outputs,
    environment_facts,
    head_files,
    yaw_degrees,
)
from app.commands.printing import answer, say
from app.core.base import colour
from app.core.base.angles import wrap
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.base.images import write_exr, write_png
from app.core.environment.environment import Environment, read_environment, reduce
from app.core.measure.finish.findings import find
from app.core.portrait.background import background
from app.core.portrait.catchlights import Catchlight, catchlight_words, catchlights
from app.core.portrait.head_views import load_views_of
from app.core.portrait.light import portrait_light
from app.core.portrait.picture import portrait_picture
from app.core.portrait.portrait_file import HAIRS, PLAIN, load_portrait
from app.core.portrait.portrait_head import ROOM
from app.core.portrait.portraits import framing, skin_gains
from app.core.solver.transport import Transport, load_named, render, to_image
from app.core.styles.style_pack import load_named_pack
from app.core.text import tr

_ASPECT: Final = 0.8
_MOST_SIZE: Final = 2048
_WRITERS: Final = (".png", ".exr")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``render`` does and takes."""
    parser.description = tr("Render the head under an HDR panorama at any turn.")
    add = partial(argument, parser)
    add("env ENV", tr("HDR panorama (.exr or .hdr)"), type=Path)
    add_layer(parser)
    add(
        "--turn DEG",
        tr("turn in degrees, positive = clockwise seen from above"),
        type=float,
        required=True,
    )
    add(
        "-o --output FILE",
        tr("picture to write: .png for looking at, .exr with linear light"),
        type=Path,
        required=True,
    )
    add(
        "--yaw DEG",
        tr("how far the face turns toward the sitter's own left; the nearest view that is baked"),
        type=yaw_degrees,
        default=0.0,
    )
    add("--size N", tr("portrait of N pixels in height instead of the small picture"), type=int)
    add("--plain", tr("with --size: bald, of one colour, on black"), action="store_true")
    add("--head NAME", tr("head or baked T.npz (default: generic)"), default="generic")
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Render one picture and write it whole or not at all.

    Raises `CoreError` when an argument, the panorama or the head is of no use; nothing is written
    then.
    """
    started = time.perf_counter()
    output: Path = args.output
    # Everything that can be wrong with the words is said before anything is computed.
    check_ending(output, _WRITERS, tr("pictures"))
    if not abs(args.turn) <= MOST_DEG:
        raise CoreError(tr("The turn must be a number of degrees, not {turn:g}.", turn=args.turn))
    if args.size is not None and not 64 <= args.size <= _MOST_SIZE:
        raise CoreError(
            tr(
                "A portrait is 64 to {most} pixels high, not {size}.",
                most=_MOST_SIZE,
                size=args.size,
            )
        )
    check_outputs([output], [args.env, *head_files(args.head)])
    transport = load_named(args.head)
    environment = read_environment(args.env, args.layer)
    say(*environment.warnings)
    yaw = 0.0
    if args.yaw:
        pack = load_named_pack(args.head)
        views = load_views_of(pack, args.head)
        yaw = views.nearest(args.yaw)
        transport = views.at(yaw, pack.styles).transport if yaw else transport
    light = reduce(environment, transport.environment_shape, wrap(args.turn - yaw))
    linear = to_image(transport, render(transport, light))
    gain = colour.face_exposure(_face_luminance(transport, linear))
    gain *= skin_gains(transport, [light])[0]
    found: tuple[Catchlight, ...] = ()
    if args.size is not None:
        linear, found = _portrait(transport, environment, args, yaw)
    if output.suffix.lower() == ".exr":
        write_exr(output, linear)
    else:
        write_png(output, colour.to_bytes(colour.tone_map(linear, gain)))
    (height, width), seconds = linear.shape[:2], time.perf_counter() - started
    facts = {
        "file": str(output),
        "turn_deg": args.turn,
        "yaw_deg": yaw,
        "head": args.head,
        "size": [height, width],
        "width": width,
        "height": height,
        "catchlights": [asdict(one) for one in found],
        **environment_facts(environment),
        "seconds": round(seconds, 3),
    }
    words = tr(
        "Wrote {output} ({width} x {height}, turn {turn:g}°, {seconds:.2f} s).",
        output=output,
        width=width,
        height=height,
        turn=args.turn,
        seconds=seconds,
    )
    return answer(args, facts, f"{words}\n{catchlight_words(found)}." if args.size else words)


def _portrait(
    transport: Transport, environment: Environment, args: argparse.Namespace, yaw: float
) -> tuple[FloatImage, tuple[Catchlight, ...]]:
    """Draw the portrait at full size, and find its catchlights."""
    hair = PLAIN if args.plain else HAIRS[0]
    known = load_portrait(transport.header.head, transport.header.skin, hair, yaw)
    if known is None or args.head.endswith(".npz"):
        raise CoreError(
            tr("The head {name} has no portrait at full size.", name=args.head),
            tr("Leave out --size, or choose a head that ships."),
        )
    light = portrait_light(environment.radiance)
    nose = wrap(args.turn - yaw)
    picture = portrait_picture(*known, light, nose)
    frame = framing(len(picture), (args.size, round(args.size * _ASPECT)), room=ROOM)
    shown = frame.cut(picture)
    if not args.plain:
        behind = background(environment.radiance, wrap(args.turn), frame, transport.header)
        shown += (1 - frame.cut(known[0].coverage))[..., None] * behind
    return shown, catchlights(known[0], light, picture, nose, find(environment.radiance))


def _face_luminance(transport: Transport, picture: FloatImage) -> FloatImage:
    values: FloatImage = colour.luminance(picture.reshape(-1, 3)[transport.pixels])[transport.face]
    return values
