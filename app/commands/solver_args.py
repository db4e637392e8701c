"""What commands that look for the best turn are asked with, in the same words."""

from __future__ import annotations

import argparse
import math
from typing import Final

from app.core.solver.reach import OBJECTIVES

MOST_DEG: Final = 36000.0
"""Largest angle that is taken: far beyond, a number has no degrees left in it."""


def add_questions(parser: argparse.ArgumentParser) -> None:
    """Add the panorama and what is asked of it: styles, head, objective and front."""
    parser.add_argument("environment", metavar="ENV", help="panorama, OpenEXR or Radiance .hdr")
    parser.add_argument(
        "--style", metavar="NAME", nargs="+", action="extend", help="styles wanted (default: all)"
    )
    parser.add_argument(
        "--head",
        metavar="NAME",
        default="generic",
        help="head to light: a name, or a transport file from 'turnlight bake' "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--objective",
        choices=OBJECTIVES,
        default=OBJECTIVES[0],
        help="what chooses the turn: the best matching picture, or the paper's quality C "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--front",
        metavar="DEG",
        type=degrees,
        default=0.0,
        help="azimuth in the panorama at which the photographer stands (default: 0)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def finite(text: str) -> float:
    """Read a number that is one, as argparse calls it.

    Raises
    ------
    argparse.ArgumentTypeError
        If it is none, or not finite.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text} is not a finite number")
    return value


def degrees(text: str) -> float:
    """Read an angle, as `finite`."""
    value = finite(text)
    if abs(value) > MOST_DEG:
        raise argparse.ArgumentTypeError(f"{text} is not an angle in degrees")
    return value
