"""Measure the light from a 360 camera's unstitched pictures, with two fisheye circles each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from app.core.base.progress import Report, Token, silent
from app.core.measure.bracket import measure as bracket
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions


def measure(
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light from one or more exposures of two circles, merging, then stitching them.

    Frames that the camera has already stitched are measured as a bracket. The errors are those of
    `measurement.Entry`.
    """
    options = replace(options or MeasureOptions(), alone=True)
    return bracket.measure(files, options, token, report)
