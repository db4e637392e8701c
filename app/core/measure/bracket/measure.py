"""Measure the light from a bracket, merging exposures in any order into an HDR panorama.

    files -> bracket -> merged light -> gaps filled -> lamps -> sun, gains, meter readings
          -> clutter filled -> clip audit

`align_and_merge` contains the steps up to the merged light.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.arrays import Float32
from app.core.base.errors import ProbeError
from app.core.base.phrases import small_percent
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.sphere import rotate_light
from app.core.camera_catalogue import camera_facts
from app.core.environment.environment import energy
from app.core.environment.holes import GOES_ON, canvas
from app.core.environment.remarks import PartUnseen
from app.core.measure.bracket.align_and_merge import check_options, merge_bracket
from app.core.measure.bracket.grouping import read_bracket
from app.core.measure.finish.corrections import FinishedLight, finish
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.inpainting import fill
from app.core.measure.finish.tripod_detection import foot_of
from app.core.measure.fisheye.circles import may_be_circles
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.decoding import transparent
from app.core.measure.read.frame import Bracket, Exposure
from app.core.measure.read.opened_frame import Opener, open_frame
from app.core.text import tr

_BLACK: Final = 0.0024  # linear light of code 8, up to which compression can raise black
_HALF: Final = 0.5  # filled fraction at and above which a texel counts as filled
_MOST_BLIND: Final = 0.9  # maximum unseen fraction of the sphere


def measure(
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
    *,
    opener: Opener = open_frame,
) -> Measurement:
    """Measure the light from exposures of a place, given in any order or as one folder.

    Pictures with two fisheye circles are stitched. A single photo yields a rough estimate of the
    light if the options allow it. The errors are those of `measurement.Entry`.

    Args:
        opener: Function that opens the frames. Some of them may already be open.
    """
    options, token = options or MeasureOptions(), token or Token()
    bracket = read_bracket(files, options.times, alone=options.alone, sort_out=options.sort_out)
    if bracket.panorama or not may_be_circles(bracket.shape):
        check_options(bracket, options)
    probe = merge_bracket(bracket, options, opener, token, span(report, 0.0, 0.9))
    token.check()
    report(0.9, Progress(Task.FINDING_LAMPS))
    probe, blind = _without_gaps(probe, token)
    with ThreadPoolExecutor(1) as beside:
        display = beside.submit(display_panorama, probe.merged.radiance)
        light = finished(probe, options, blind)
    report(1.0, Progress(Task.DONE))
    notes = tuple(note for note in (probe.levelling.remark, *light.notes) if note)
    return replace(probe, finished=light, display=display.result(), notes=notes)


def _without_gaps(probe: Measurement, token: Token) -> tuple[Measurement, Float32 | None]:
    """Fill the gaps in the frames, which are transparent areas and black canvas.

    Returns:
        The measurement, and a mask, (H, W) float32, which is 1 where the light was filled in. The
        mask is None if there are no gaps.
    """
    bracket, rotation = probe.bracket, probe.levelling.rotation
    if bracket.unstitched or not bracket.panorama:
        return probe, None
    shape = probe.merged.clipped.shape
    frame = bracket.frames[0]
    unseen = transparent(frame, (shape[0], shape[1]))
    # The frames of a 360 camera have no canvas, so their black areas were dark.
    if rotation is None and camera_facts(frame.camera) is None:
        coded = frame.kind in ("uint8", "uint16")
        unit = 2.0 ** (probe.merged.reference_ev - max(bracket.stops))
        black = canvas(probe.merged.radiance, _BLACK * unit if coded else None)
        unseen = black if unseen is None else unseen if black is None else unseen | black
    elif rotation is not None and unseen is not None:
        unseen = rotate_light(unseen[..., None].astype(np.float32), rotation)[..., 0] > _HALF
    if unseen is None:
        return probe, None
    token.check()
    blind = unseen.astype(np.float32)
    share = float(energy(blind)) / (4.0 * math.pi)
    if share > _MOST_BLIND:
        raise ProbeError(
            tr("{name} covers only {share} of the sphere.", name=frame.path.name,
               share=small_percent(1.0 - share)),
            tr("Choose a panorama without large transparent areas."),
        )  # fmt: skip
    merged = fill(probe.merged, blind, GOES_ON)
    finished = replace(probe.finished, merged=merged, measured=merged)
    warnings = (*probe.warnings, PartUnseen(frame.path.name, share))
    return replace(probe, finished=finished, blind=share, warnings=warnings), blind


def finished(
    measurement: Measurement, options: MeasureOptions, blind: Float32 | None = None
) -> FinishedLight:
    """Finish a panorama, leaving other pictures unchanged."""
    if not measurement.bracket.panorama:
        return measurement.finished
    foot, room = foot_of(measurement.levelling.rotation), room_below(measurement.bracket)
    alone = measurement.bracket.frames[0].path.name if measurement.rough else ""
    return finish(
        measurement.merged,
        options.styles,
        options,
        foot=foot,
        room_stops=room,
        alone=alone,
        blind=blind,
    )


def room_below(bracket: Bracket) -> float | None:
    """Return how many stops below the darkest frame the camera can go, or None if unknown."""
    facts = camera_facts(bracket.frames[0].camera)
    if facts is None:
        return None
    limits = facts.limits
    floor = Exposure(min(limits.shutters_s), min(limits.isos), max(limits.apertures))
    return max(min(bracket.stops) - floor.ev, 0.0)
