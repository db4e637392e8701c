"""``turnlight stitch``: photographs taken all around in, an environment out."""

from __future__ import annotations

import argparse
import time
from functools import partial
from pathlib import Path
from typing import Any

from app.commands.arguments import add_json, argument, degrees
from app.commands.merge import add_corrections, corrections, write
from app.commands.printing import ProgressPrinter
from app.core.base.progress import Token
from app.core.measure.bracket.pipeline import measure
from app.core.measure.photos.photographs import Photograph, stitch
from app.core.styles.style_pack import load_named_pack
from app.core.text import tr


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``stitch`` does and takes."""
    parser.description = tr(
        "Lay photographs that were taken from one spot on what is all around, merge their "
        "exposures, and fill what none of them shows."
    )
    add = partial(argument, parser)
    add("images IMAGE", tr("the photographs, or one folder of them"), nargs="+", type=Path)
    add("-o --output ENV", tr(".exr or .hdr to write"), type=Path, required=True)
    kinds = tr("what the pictures are: photographs, or unstitched fisheye circles (default: auto)")
    add("--kind", kinds, choices=("auto", "photos", "fisheye"))
    add("--fov DEG", tr("how far around a single wide panorama reaches"), type=degrees)
    add_corrections(parser)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Stitch photographs and write the environment whole or not at all.

    Raises `CoreError` when an argument or a file is of no use; nothing is written then.
    """
    started = time.perf_counter()
    options, pack, report = corrections(args), load_named_pack("generic"), ProgressPrinter()
    if args.kind == "fisheye":
        probe = measure(args.images, pack, options, report=report)
        return write(args, probe, started, blind=0.0)
    circles = args.kind != "photos"
    found = stitch(args.images, pack, options, Token(), report, args.fov, unstitched=circles)
    facts = {
        "blind": round(found.blind, 4),
        "photographs": [_photograph(each) for each in found.photographs],
    }
    return write(args, found.probe, started, **facts)


def _photograph(each: Photograph) -> dict[str, Any]:
    names = ("azimuth_deg", "elevation_deg", "roll_deg", "fov_deg")
    facts: dict[str, Any] = {"file": str(each.frame.path), "placed": False} | dict.fromkeys(names)
    if each.angles_deg is not None:
        values = (*each.angles_deg, each.fov_deg)
        facts |= {"placed": True} | {n: round(v, 2) for n, v in zip(names, values, strict=True)}
    return facts
