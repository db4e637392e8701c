"""``turnlight ball``: convert a bracket of a mirror ball into an environment."""

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
        "Measure the light of a place with a mirror ball. Put the ball where the "
        "sitter’s head will be and shoot a bracket of it from where you will stand. The "
        "result is an HDR environment with your position at azimuth 0."
    )
    add = partial(argument, parser)
    add("images IMAGE", tr("the exposures, or a folder that contains them"), nargs="+", type=Path)
    add(
        "--second IMAGE",
        tr("the exposures from another side, or their folder; they show what your body hid"),
        nargs="+",
        type=Path,
        default=[],
    )
    add(
        "--from DEG",
        tr(
            "how far you walked around the ball for the exposures of --second, clockwise as "
            "seen from above (default: estimated)"
        ),
        type=degrees,
        dest="from_deg",
    )
    add(
        "--pitch DEG",
        tr("tilt of the camera, positive upwards (default: 0)"),
        type=finite,
        default=0.0,
    )
    add(
        "--reflectance SHARE",
        tr("fraction of the light that the ball reflects (default: %(default)s, chrome)"),
        type=finite,
        default=REFLECTANCE,
    )
    add_wishes(parser)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Unwrap the photos of a mirror ball and write the environment atomically.

    Raises:
        CoreError: If an argument or a file is unusable. In that case nothing is written.
    """
    start_s = time.perf_counter()
    ball_options = _ball_options(args)
    options = replace(options_of(args, *args.second), own=ball_options)
    measured = measure("ball", args.images, options, report=ProgressPrinter())
    return write(args, measured, start_s, blind=measured.blind)


def _ball_options(args: argparse.Namespace) -> BallOptions:
    if args.from_deg is not None and not args.second:
        raise ProbeError(
            tr("--from requires exposures from another side."),
            tr("Add them with --second."),
        )
    if not 0.2 <= args.reflectance <= 0.98:
        raise ProbeError(tr("--reflectance must be from 0.2 to 0.98."))
    if abs(args.pitch) > 60.0:
        raise ProbeError(tr("--pitch must be from -60 to 60 degrees."))
    return BallOptions(tuple(args.second), args.from_deg, args.reflectance, args.pitch)
