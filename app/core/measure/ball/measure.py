"""Measure light with a mirror ball, turning brackets from one or two sides into a panorama."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.remarks import Remark
from app.core.environment.environment import energy
from app.core.measure.ball.ball_finder import Ball, find_ball, fused, refined
from app.core.measure.ball.mirror_ball import (
    BallOptions,
    ball_notes,
    find_lens,
    join_sides,
    panorama_rows,
    unwrap,
)
from app.core.measure.ball.remarks import LensFromBackground
from app.core.measure.bracket.align_and_merge import check_size, merge_frames
from app.core.measure.bracket.alignment import handheld
from app.core.measure.bracket.grouping import read_bracket
from app.core.measure.bracket.measure import room_below
from app.core.measure.finish.corrections import finish
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.inpainting import fill
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import Bracket
from app.core.measure.read.opened_frame import open_frame
from app.core.measure.read.pixels import FrameStack, reduced


@dataclass(frozen=True, slots=True)
class BallFacts:
    """The ball as it appears in the pictures from the first side."""

    ball: Ball

    def facts(self) -> dict[str, Any]:
        """Return the facts as a dictionary for JSON."""
        return {"ball": {"width_px": round(2.0 * self.ball.radius_px)}}


def measure(
    files: Sequence[Path],
    options: MeasureOptions | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> Measurement:
    """Measure the light from exposures of a mirror ball, or from one folder of them.

    The exposures from another side are named in `BallOptions`. The errors are those of
    `measurement.Entry`, plus a `ProbeError` if there is not exactly one ball.
    """
    options, token = options or MeasureOptions(), token or Token()
    ball_options = options.of(BallOptions)
    brackets = [read_bracket(some, options.times) for some in (files, ball_options.second) if some]
    measurements, balls = [], []
    for number, bracket in enumerate(brackets):
        part = span(report, 0.9 * number / len(brackets), 0.9 * (number + 1) / len(brackets))
        one, ball = _merged(bracket, options, token, part)
        measurements.append(one)
        balls.append(ball)
    guessed: tuple[Remark, ...] = ()
    for number, one in enumerate(measurements):
        if one.bracket.frames[0].focal_mm is None:
            balls[number] = find_lens(one.merged, balls[number], ball_options, token)
            guessed = (LensFromBackground(),)
    rows = panorama_rows(max(ball.radius_px for ball in balls))
    views = [
        unwrap(one.merged, ball, rows, ball_options, token)
        for one, ball in zip(measurements, balls, strict=True)
    ]
    whole = views[0] if len(views) == 1 else join_sides(views[0], views[1], ball_options.from_deg)
    report(0.9, Progress(Task.FINDING_LAMPS))
    light = measurements[0].merged.moved(whole.texels[..., :3], whole.texels[..., 3:])
    light, room = fill(light, whole.blind), room_below(brackets[0])
    finished = finish(light, options.styles, options, room_stops=room, blind=whole.blind)
    share = float(energy(whole.blind)) / (4.0 * math.pi)
    report(1.0, Progress(Task.DONE))
    return replace(
        measurements[0],
        way="ball",
        finished=finished,
        own=BallFacts(balls[0]),
        blind=share,
        warnings=tuple(dict.fromkeys(each for one in measurements for each in one.warnings)),
        notes=(*ball_notes(balls, share), *guessed, *whole.notes, *finished.notes),
        display=display_panorama(finished.merged.radiance),
    )


def _merged(
    bracket: Bracket, options: MeasureOptions, token: Token, report: Report
) -> tuple[Measurement, Ball]:
    """Merge the pictures from one side and find the ball in them."""
    check_size(bracket, replace(options, full=True))
    balls: list[Ball] = []

    def look(stack: FrameStack) -> None:
        light = fused(reduced(stack, handheld.LONGEST, token), stack.stops)
        balls.append(find_ball(light, stack.frames[0].focal_mm).resized(stack.shape))

    merged = merge_frames(bracket, options, open_frame, token, report, look=look)
    return merged, refined(balls[0], merged.merged.radiance)
