"""``turnlight align``: compare two photos and report how far remains to turn."""

from __future__ import annotations

import argparse
import math
import time
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import add_json, argument, check_ending, check_outputs
from app.commands.shared.printing import answer, say
from app.core.base.angles import direction_of
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_png
from app.core.base.phrases import percent
from app.core.localization.align import align, laid_over
from app.core.localization.homography import Alignment
from app.core.localization.picture_file import PictureFile, read_picture
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.text import tr
from app.words.phrases.turns import direction_words

_LONGEST: Final = 4096  # pixels along the longer side; feature detection uses smaller copies
_USUAL_FOV_DEG: Final = 60.0
_FIELDS_DEG: Final = (5.0, 170.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``align``."""
    parser.description = tr(
        "Find the homography that maps VIEW, the camera’s current view, to TARGET, the "
        "view at the goal."
    )
    add = partial(argument, parser)
    add("target TARGET", tr("the view at the goal"), type=Path)
    add("view VIEW", tr("the camera’s current view, not mirrored"), type=Path)
    add(
        "-o --output OVERLAY.png",
        tr("write TARGET overlaid with VIEW, at most 4,096 pixels wide and high"),
        type=Path,
    )
    add(
        "--opacity PERCENT",
        tr("opacity of VIEW in the overlay (default: 50)"),
        type=float,
        default=50.0,
    )
    add(
        "--fov DEG",
        tr("horizontal field of view of TARGET (default: from the file, or else 60)"),
        type=float,
    )
    add(
        "--view-fov DEG",
        tr(
            "horizontal field of view of VIEW (default: from the file, or else the same as "
            "for TARGET)"
        ),
        type=float,
    )
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Align two photos and, if requested, write an overlay of them.

    The overlay is written atomically, and never over either photo.

    Returns:
        Exit code 0, even if the position of VIEW is uncertain, since that is a valid answer.

    Raises:
        CoreError: If an argument or a photo is unusable. In that case nothing is written.
    """
    start_s = time.perf_counter()
    _check(args)
    target, view = (read_picture(path, _LONGEST) for path in (args.target, args.view))
    fov = args.fov or target.fov_deg or _USUAL_FOV_DEG
    view_fov = args.view_fov or view.fov_deg or fov
    sitter = _sitter_in(view, view_fov)
    mask = None if sitter is None else background_mask(sitter, view.picture.shape[:2])
    alignment = align(
        target.picture,
        view.picture,
        fov_deg=fov,
        sitter_deg=0.0 if sitter is None else sitter.angle_deg,
        view_fov_deg=view_fov,
        mask=mask,
    )
    if alignment.status != "found" and mask is not None:
        # A sitter may appear in either photo, so mask people in both.
        alignment = align(target.picture, view.picture, fov_deg=fov, view_fov_deg=view_fov)
    has_overlay = _write_overlay(args, alignment, target, view)
    facts = _facts(args, alignment, has_overlay, sitter, time.perf_counter() - start_s)
    return answer(args, facts, _words(args, alignment, has_overlay))


def _check(args: argparse.Namespace) -> None:
    """Reject bad arguments before any computation starts."""
    for name, value in (("--fov", args.fov), ("--view-fov", args.view_fov)):
        if value is not None and not _FIELDS_DEG[0] <= value <= _FIELDS_DEG[1]:
            raise CoreError(
                tr(
                    "{name} must be from 5 to 170 degrees, not {value:g}.",
                    name=name,
                    value=value,
                )
            )
    if not (math.isfinite(args.opacity) and 0.0 <= args.opacity <= 100.0):
        raise CoreError(
            tr("--opacity must be from 0 to 100, not {opacity:g}.", opacity=args.opacity)
        )
    if args.output is None:
        return
    check_ending(args.output, (".png",), tr("overlays"))
    check_outputs([args.output], [args.target, args.view])


def _sitter_in(view: PictureFile, fov_deg: float) -> Sitter | None:
    try:
        return find_sitter(view.picture, fov_deg, keen=True)
    except CoreError as error:
        say(error)
        return None


def _write_overlay(
    args: argparse.Namespace, alignment: Alignment, target: PictureFile, view: PictureFile
) -> bool:
    if args.output is None:
        return False
    if alignment.homography is None:
        say(tr("No overlay was written: VIEW could not be aligned."))
        return False
    share = args.opacity / 100.0
    write_png(args.output, laid_over(target.picture, view.picture, alignment.homography, share))
    return True


def _facts(
    args: argparse.Namespace,
    alignment: Alignment,
    has_overlay: bool,
    sitter: Sitter | None,
    seconds: float,
) -> dict[str, Any]:
    matrix, error = alignment.homography, alignment.turn_error_deg
    return {
        "status": alignment.status,
        "homography": None if matrix is None else [[float(v) for v in row] for row in matrix],
        "inliers": alignment.inliers,
        "overlap": round(alignment.overlap, 4),
        "turn_error_deg": None if error is None else round(error, 3),
        "confidence": round(alignment.confidence, 4),
        "sitter_deg": None if sitter is None else round(sitter.angle_deg, 2),
        "overlay": str(args.output) if has_overlay else None,
        "seconds": round(seconds, 3),
    }


def _words(args: argparse.Namespace, alignment: Alignment, has_overlay: bool) -> str:
    if alignment.turn_error_deg is None:
        return tr(
            "Unsure: VIEW and TARGET cannot be aligned reliably; {count} points agree.",
            count=alignment.inliers,
        )
    rows = [
        (tr("To go:"), _degrees(alignment.turn_error_deg)),
        (tr("Points:"), tr("{count} agree", count=alignment.inliers)),
        (tr("Overlap:"), tr("{share} of TARGET", share=percent(alignment.overlap))),
    ]
    if has_overlay:
        rows.append((tr("Overlay:"), str(args.output)))
    return "\n".join(f"{name:<9}  {value}" for name, value in rows)


def _degrees(angle: float) -> str:
    size = f"{abs(angle):.1f}°"
    return size if direction_of(angle) == "none" else f"{size} {direction_words(angle)}"
