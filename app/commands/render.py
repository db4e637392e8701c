"""``turnlight render``: a picture of the head under an environment, at any turn."""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path
from typing import Final

from app.commands.arguments import (
    MOST_DEG,
    add_json,
    argument,
    check_ending,
    check_outputs,
    head_files,
)
from app.commands.printing import answer, say
from app.core.base import colour
from app.core.base.angles import wrap
from app.core.base.colour import FloatImage
from app.core.base.errors import CoreError
from app.core.base.images import write_exr, write_png
from app.core.solver.environment import read_environment, reduce
from app.core.solver.portraits import skin_gains
from app.core.solver.transport import Transport, load_named, render, to_image
from app.core.text import tr

_WRITERS: Final = (".png", ".exr")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``render`` does and takes."""
    parser.description = tr("Render the head under an HDR panorama at any turn.")
    add = partial(argument, parser)
    add("env ENV", tr("HDR panorama (.exr or .hdr)"), type=Path)
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
    check_outputs([output], [args.env, *head_files(args.head)])
    transport = load_named(args.head)
    environment = read_environment(args.env)
    say(*environment.warnings)
    light = reduce(environment, transport.environment_shape, wrap(args.turn))
    linear = to_image(transport, render(transport, light))
    if output.suffix.lower() == ".exr":
        write_exr(output, linear)
    else:
        gain = colour.face_exposure(_face_luminance(transport, linear))
        gain *= skin_gains(transport, [light])[0]
        write_png(output, colour.to_bytes(colour.tone_map(linear, gain)))
    size, seconds = transport.size, time.perf_counter() - started
    facts = {
        "file": str(output),
        "turn_deg": args.turn,
        "head": args.head,
        "size": [size, size],
        "seconds": round(seconds, 3),
    }
    words = tr(
        "Wrote {output} ({size} x {size}, turn {turn:g}°, {seconds:.2f} s).",
        output=output,
        size=size,
        turn=args.turn,
        seconds=seconds,
    )
    return answer(args, facts, words)


def _face_luminance(transport: Transport, picture: FloatImage) -> FloatImage:
    values: FloatImage = colour.luminance(picture.reshape(-1, 3)[transport.pixels])[transport.face]
    return values
