"""``turnlight ball``: a bracket of a mirror ball in, an environment out."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from app.commands.merge import add_wishes, options_of, write
from app.commands.shared.arguments import add_json, argument, degrees, finite
from app.commands.shared.printing import ProgressPrinter
from app.core.base.errors import ProbeError
from app.core.measure.ball.mirror_ball import REFLECTANCE, BallOptions
from app.core.measure.ways import measure
from app.core.text import tr


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``ball``."""
    parser.description = tr(
        "Measure the light of a place with a mirror ball: put it where the sitter's head will be, "
        "photograph it in a bracket from where you will stand, and it becomes an HDR environment "
        "whose azimuth 0 is your place; say how much of it the ball does not show."
    )
    add = partial(argument, parser)
    add("images IMAGE", tr("the exposures, or one folder of them"), nargs="+", type=Path)
    add(
        "--second IMAGE",
        tr("the exposures from another side, which show what you hid; or one folder of them"),
        nargs="+",
        type=Path,
        default=[],
    )
    add(
        "--from DEG",
        tr("how far you walked around the ball for those, clockwise seen from above (found)"),
        type=degrees,
        dest="from_deg",
    )
    add(
        "--pitch DEG",
        tr("how far the camera looked up (down: negative), if it was not level (default: 0)"),
        type=finite,
        default=0.0,
    )
    add(
        "--reflectance SHARE",
        tr("share of the light that the ball reflects (default: %(default)s, chrome)"),
        type=finite,
        default=REFLECTANCE,
    )
    add_wishes(parser)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Unwrap a ball and write the environment atomically.

    Raises `CoreError` when an argument or a file is of no use; nothing is written then.
    """
    start_s = time.perf_counter()
    ball_options = _ball_options(args)
    options = replace(options_of(args, *args.second), own=ball_options)
    measured = measure("ball", args.images, options, report=ProgressPrinter())
    return write(args, measured, start_s, blind=measured.blind)


def _ball_options(args: argparse.Namespace) -> BallOptions:
    if args.from_deg is not None and not args.second:
        raise ProbeError(
            tr("--from says where the pictures of --second were taken."),
            tr("Name the pictures from the other side, too."),
        )
    if not 0.2 <= args.reflectance <= 0.98:
        raise ProbeError(tr("--reflectance is from 0.2 to 0.98."))
    if abs(args.pitch) > 60.0:
        raise ProbeError(tr("--pitch is from -60 to 60 degrees."))
    return BallOptions(tuple(args.second), args.from_deg, args.reflectance, args.pitch)
