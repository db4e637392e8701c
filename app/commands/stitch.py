"""``turnlight stitch``: stitch photos taken in all directions into an environment."""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from app.commands.merge import add_corrections, corrections, write
from app.commands.shared.arguments import add_json, argument, degrees
from app.commands.shared.printing import ProgressPrinter
from app.core.measure.photos.measure import PhotosOptions
from app.core.measure.ways import measure
from app.core.text import tr


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``stitch``."""
    parser.description = tr(
        "Stitch photos taken from one spot into a full panorama, merge their exposures "
        "and fill the gaps."
    )
    add = partial(argument, parser)
    add("images IMAGE", tr("the photos, or a folder that contains them"), nargs="+", type=Path)
    add("-o --output ENV", tr(".exr or .hdr to write"), type=Path, required=True)
    kinds = tr("kind of pictures: photos, or unstitched fisheye circles (default: auto)")
    add("--kind", kinds, choices=("auto", "photos", "fisheye"))
    add("--fov DEG", tr("angle covered by a single wide panorama"), type=degrees)
    add_corrections(parser)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Stitch photos and write the environment atomically.

    Raises:
        CoreError: If an argument or a file is unusable. In that case nothing is written.
    """
    start_s = time.perf_counter()
    options, report = corrections(args), ProgressPrinter()
    if args.kind == "fisheye":
        return write(args, measure("fisheye", args.images, options, report=report), start_s)
    own = PhotosOptions(args.fov, unstitched=args.kind != "photos")
    measured = measure("photos", args.images, replace(options, own=own), report=report)
    return write(args, measured, start_s, photographs=[])
