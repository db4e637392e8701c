"""``turnlight render``: render the head in an environment at any turn."""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from app.commands.shared.arguments import (
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
from app.commands.shared.printing import answer, say
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_exr, write_png
from app.core.environment.environment import read_environment
from app.core.portrait.render import check_height, render_head
from app.core.text import tr
from app.words.portrait.face_light import catchlight_words
from app.words.remarks import sentences

_WRITERS: Final = (".png", ".exr")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``render``."""
    parser.description = tr("Render the head as lit by an HDR panorama at any turn.")
    add = partial(argument, parser)
    add("env ENV", tr("HDR panorama (.exr or .hdr)"), type=Path)
    add_layer(parser)
    add(
        "--turn DEG",
        tr("turn in degrees, positive clockwise as seen from above"),
        type=float,
        required=True,
    )
    add(
        "-o --output FILE",
        tr("picture to write: .png for viewing, .exr for linear light"),
        type=Path,
        required=True,
    )
    add(
        "--yaw DEG",
        tr("how far the face turns towards the sitter’s own left; the nearest baked view is used"),
        type=yaw_degrees,
        default=0.0,
    )
    add("--size N", tr("render a portrait N pixels high instead of the small picture"), type=int)
    add("--plain", tr("with --size: a bald head in one colour on black"), action="store_true")
    add("--head NAME", tr("head, or a baked T.npz (default: generic)"), default="generic")
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Render one picture and write it atomically.

    Raises:
        CoreError: If an argument, the panorama or the head is unusable. In that case nothing is
            written.
    """
    start_s = time.perf_counter()
    output: Path = args.output
    # Check the arguments before any computation.
    check_ending(output, _WRITERS, tr("pictures"))
    if not abs(args.turn) <= MOST_DEG:
        raise CoreError(tr("The turn must be a number of degrees, not {turn:g}.", turn=args.turn))
    check_height(args.size)
    check_outputs([output], [args.env, *head_files(args.head)])
    environment = read_environment(args.env, args.layer)
    say(*sentences(environment.warnings))
    picture = render_head(
        environment, args.turn, args.head, yaw_deg=args.yaw, height=args.size, plain=args.plain
    )
    if output.suffix.lower() == ".exr":
        write_exr(output, picture.linear)
    else:
        write_png(output, picture.srgb)
    (height, width), seconds = picture.linear.shape[:2], time.perf_counter() - start_s
    facts = {
        "file": str(output),
        "turn_deg": args.turn,
        "yaw_deg": picture.yaw_deg,
        "head": args.head,
        "size": [height, width],
        "width": width,
        "height": height,
        "catchlights": [asdict(one) for one in picture.catchlights],
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
    if args.size:
        words = f"{words}\n{catchlight_words(picture.catchlights)}."
    return answer(args, facts, words)
