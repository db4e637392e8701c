"""``turnlight merge``: merge a bracket of exposures into an environment."""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import (
    add_json,
    argument,
    check_drawing,
    check_ending,
    check_outputs,
    mask_files,
)
from app.commands.shared.printing import ProgressPrinter, answer, say
from app.commands.shared.probe_words import (
    clutter_facts,
    own_facts,
    probe_facts,
    probe_table,
    wrote,
)
from app.core.base.errors import ProbeError
from app.core.base.imaging.images import write_exr, write_hdr, write_png
from app.core.measure.finish.masks import check_picture_mask, parse_mask
from app.core.measure.finish.tripod_detection import suggest
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.metadata import ENDINGS
from app.core.measure.ways import measure
from app.core.text import tr
from app.words.measure.masks import clutter_name, clutter_reason
from app.words.remarks import sentences

_WRITERS: Final = (".exr", ".hdr")
_MOST_STOPS: Final = 30
_SUN_WORDS: Final = {
    "clear": "clear",
    "hazy": "hazy",
    "thin-cloud": "thin cloud",
    "leave": "leave",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``merge``."""
    parser.description = tr(
        "Merge the exposures of a bracket, in any order, into an HDR environment. Shows "
        "what was clipped and how that affects the answers. A single 360 photo gives a "
        "rough environment."
    )
    add = partial(argument, parser)
    add("images IMAGE", tr("the exposures, or a folder that contains them"), nargs="+", type=Path)
    add_wishes(parser)
    add(
        "--full", tr("keep the full size of the frames instead of 2048 x 1024"), action="store_true"
    )
    add_json(parser, run)


def add_wishes(parser: argparse.ArgumentParser) -> None:
    """Add the options for the outputs and for details of the frames."""
    add = partial(argument, parser)
    add("-o --output ENV", tr(".exr or .hdr to write"), type=Path, required=True)
    _add_camera(parser)
    add_corrections(parser)


def _add_camera(parser: argparse.ArgumentParser) -> None:
    """Add the options for exposure times and for weighting."""
    add = partial(argument, parser)
    add("--times T,...", tr("exposure times in seconds, in the order of the files"))
    add(
        "--response",
        tr(
            "camera curve: sRGB, recovered from the bracket, or recovered only if the "
            "measured steps disagree (default: auto)"
        ),
        choices=("auto", "srgb", "recover"),
    )
    add(
        "--weights",
        tr("weighting of the frames: by noise, or as in the paper (default: noise)"),
        choices=("noise", "reinhard"),
    )


def add_corrections(parser: argparse.ArgumentParser) -> None:
    """Add the options for correcting lamps, the sun and masks, and for the preview."""
    add = partial(argument, parser)
    add(
        "--lamp-gain ID=STOPS",
        tr("brighten or darken a lamp, such as A=3; may be repeated"),
        action="append",
        default=[],
    )
    add(
        "--lamp-lux ID=LUX",
        tr("light meter reading taken facing a lamp; may be repeated"),
        action="append",
        default=[],
    )
    add(
        "--sun",
        tr("sky around a clipped sun, or leave to keep the sun as it is (default: clear)"),
        choices=tuple(_SUN_WORDS),
    )
    add(
        "--mask WHAT",
        tr(
            "fill an area from its surroundings: nadir:-65, box:-20,20,-90,-40, a PNG "
            "(white = fill), or suggested; may be repeated"
        ),
        action="append",
        default=[],
    )
    add("--preview PNG", tr("also write a preview picture"), type=Path)
    add("--exposure STOPS", tr("exposure of the preview, in stops"), type=_number, default=0.0)


def run(args: argparse.Namespace) -> int:
    """Merge a bracket and write the environment atomically.

    Raises:
        CoreError: If an argument or a file is unusable. In that case nothing is written.
    """
    start_s = time.perf_counter()
    options = replace(options_of(args), full=args.full)
    measured = measure("bracket", args.images, options, report=ProgressPrinter())
    return write(args, measured, start_s)


def write(args: argparse.Namespace, probe: Measurement, start_s: float, **more: Any) -> int:
    """Write the measured light and print a summary. The entries of `more` are added to the JSON."""
    say(*sentences((*probe.warnings, *probe.notes)))
    skip_search = bool(args.mask) or not probe.bracket.panorama
    suggestions = () if skip_search else suggest(probe.finished.measured)
    radiance, white = probe.merged.radiance, probe.merged.cd_m2
    if args.output.suffix.lower() == ".exr":
        write_exr(args.output, radiance, white, rough=probe.rough, shares=probe.shares)
    else:
        write_hdr(args.output, radiance)
    if args.preview is not None:
        marks = (*probe.finished.clutter, *suggestions)
        # Import here, as only a preview needs Qt.
        from app.export.merge_preview import preview

        picture = preview(probe.finished.measured, probe.finished.lights, marks, args.exposure)
        write_png(args.preview, picture)
    seconds = time.perf_counter() - start_s
    facts = {
        "file": str(args.output),
        **probe_facts(probe),
        "blind": round(probe.blind, 4),
        **more,
        **own_facts(probe),
        "suggested_masks": [clutter_facts(each) for each in suggestions],
        "seconds": round(seconds, 3),
    }
    lines = [
        tr("Suggested: {name}. {reason}", name=clutter_name(each), reason=clutter_reason(each))
        for each in suggestions
    ]
    last = wrote(probe, args.output, seconds)
    return answer(args, facts, probe_table(probe, *lines, "", last))


def options_of(args: argparse.Namespace, *more: Path) -> MeasureOptions:
    """Read the options added by `add_wishes`. List any photos besides `args.images` in `more`."""
    return replace(
        corrections(args, *more),
        times=None if args.times is None else tuple(_number(t) for t in args.times.split(",")),
        response=args.response,
        weights=args.weights,
    )


def corrections(args: argparse.Namespace, *more: Path) -> MeasureOptions:
    """Read the options added by `add_corrections`.

    Unwritable outputs and unreadable masks are rejected before any merging starts.
    """
    options = MeasureOptions(
        sun=_SUN_WORDS[args.sun],  # type: ignore[arg-type]
        gains=dict(_pair(text, "--lamp-gain") for text in args.lamp_gain),
        lux=dict(_pair(text, "--lamp-lux") for text in args.lamp_lux),
        masks=tuple(parse_mask(text) for text in args.mask),
        alone=True,
    )
    if abs(args.exposure) > _MOST_STOPS:
        raise ProbeError(tr("--exposure must be from -{most} to {most} stops.", most=_MOST_STOPS))
    check_ending(args.output, _WRITERS, tr("environments"))
    if args.preview is not None:
        check_ending(args.preview, (".png",), tr("previews"))
    masks = mask_files(options.masks)
    check_outputs([args.output, args.preview], [*args.images, *more, *masks], ENDINGS)
    if args.preview is not None:
        check_drawing()
    for mask in masks:
        check_picture_mask(mask)
    return options


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ProbeError(tr("{text!r} is not a number.", text=text.strip()))
    return value


def _pair(text: str, option: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not (name.strip() and equals):
        raise ProbeError(
            tr(
                "{option} takes a lamp and a number, such as A=3, not {text!r}.",
                option=option,
                text=text,
            )
        )
    return name, _number(value)
