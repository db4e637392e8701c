"""``turnlight locate``: find a photo's viewing direction in a panorama."""

from __future__ import annotations

import argparse
import json
import math
import time
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import add_json, argument
from app.commands.shared.printing import ProgressPrinter
from app.core.localization.features import build_index
from app.core.localization.photo_location import PhotoSearch, read_photo, search_photo
from app.core.localization.picture_file import read_shown_panorama
from app.core.text import tr
from app.words.photos import photo_warnings

_FOV_DEG: Final = (10.0, 150.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``locate``."""
    parser.description = tr(
        "Find the heading of a photo in a panorama of the place: the azimuth at the "
        "middle of the photo, 0 at the centre column of the panorama, positive clockwise "
        "as seen from above. Prints “unsure” rather than a wrong number."
    )
    add = partial(argument, parser)
    add("panorama PANORAMA", tr("OpenEXR, Radiance, JPEG, PNG or TIFF"), type=Path)
    add("photo PHOTO", tr("JPEG, PNG, TIFF or WebP"), type=Path)
    add(
        "--fov DEG",
        tr(
            "horizontal field of view of the upright photo (default: from its EXIF focal "
            "length, or else estimated)"
        ),
        type=_fov,
    )
    add(
        "--mirrored",
        tr("the photo is a mirror image (default: both orientations are tried)"),
        action="store_true",
    )
    add_json(parser, run)


def _fov(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and _FOV_DEG[0] <= value <= _FOV_DEG[1]):
        raise argparse.ArgumentTypeError(
            tr(
                "{text} is not a field of view between {least:g} and {most:g} degrees",
                text=text,
                least=_FOV_DEG[0],
                most=_FOV_DEG[1],
            )
        )
    return value


def run(args: argparse.Namespace) -> int:
    """Locate the photo in the panorama. Failing to find it is a valid answer."""
    start = time.perf_counter()
    photo = read_photo(args.photo)
    index = build_index(read_shown_panorama(args.panorama), report=ProgressPrinter())
    search = search_photo(photo, index, args.fov, mirrored=args.mirrored or None)
    seconds = time.perf_counter() - start
    print(json.dumps(_facts(search, seconds), indent=1) if args.json else _table(search))
    return 0


def _facts(search: PhotoSearch, seconds: float) -> dict[str, Any]:
    heading = search.heading
    has_heading = heading.status == "found"
    angles = (heading.heading_deg, heading.pitch_deg, heading.roll_deg, heading.fov_deg)
    names = ("heading_deg", "pitch_deg", "roll_deg", "fov_deg")
    numbers = {
        name: round(value, 3) if has_heading and value is not None else None
        for name, value in zip(names, angles, strict=True)
    }
    return {
        "status": heading.status,
        **numbers,
        "inliers": heading.inliers,
        "confidence": round(heading.confidence, 4),
        "mirrored": search.mirrored,
        "warnings": photo_warnings(search),
        "seconds": round(seconds, 3),
    }


def _table(search: PhotoSearch) -> str:
    heading = search.heading
    last = [
        _line(tr("points that agree"), str(heading.inliers)),
        _line(tr("confidence"), f"{math.floor(100 * heading.confidence)}%"),
    ]
    if heading.heading_deg is None:
        first = tr("Unsure: the photo could not be found in the panorama.")
        return "\n".join([first, *last])
    lines = [
        _line(tr("heading"), _degrees(heading.heading_deg)),
        _line(tr("pitch"), tr("{angle} up", angle=_degrees(heading.pitch_deg))),
        _line(tr("roll"), tr("{angle} clockwise", angle=_degrees(heading.roll_deg))),
        _line(tr("field of view"), _degrees(heading.fov_deg)),
        *last,
    ]
    if search.mirrored:
        lines.append(tr("The photo is mirrored, which is how some phones save selfies."))
    return "\n".join([*lines, *photo_warnings(search)])


def _degrees(value: float) -> str:
    return f"{value:.1f}°".replace("-", "−")


def _line(name: str, value: str) -> str:
    return f"  {name:<17}  {value}"
