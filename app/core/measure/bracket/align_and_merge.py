"""Read, align and merge the frames of a bracket.

    opened -> aligned -> response -> motion -> merged -> (stitched) -> levelled

Frames that show two fisheye circles are not aligned but are stitched after merging.

Each step is a module in this package or in `measure.fisheye`. This module only defines the order of
the steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from app.core.base.arrays import Bytes, Float64
from app.core.base.errors import ProbeError
from app.core.base.progress import Progress, Report, Task, Token, span
from app.core.base.remarks import Remark
from app.core.base.sphere import remap_frame, rotate_light
from app.core.measure.bracket import deghosting
from app.core.measure.bracket.alignment import align, handheld
from app.core.measure.bracket.alignment.levelling import Levelling, first_shot, levelling
from app.core.measure.bracket.curve.response import ResponseChoice, choose_response
from app.core.measure.bracket.foreign_frames import Foreign, LeftOut, foreign_frames
from app.core.measure.bracket.grouping import not_all_around
from app.core.measure.bracket.half_size import anchors, halvable, is_whole
from app.core.measure.bracket.merge import SIZE, merge
from app.core.measure.bracket.weighting import doubts
from app.core.measure.finish.corrections import FinishedLight
from app.core.measure.fisheye.circles import Circles, recognise
from app.core.measure.fisheye.stitch import circle_size, to_panorama
from app.core.measure.measurement import Measurement
from app.core.measure.options import MeasureOptions
from app.core.measure.read.frame import Bracket, MergedLight
from app.core.measure.read.opened_frame import Opener, open_frame
from app.core.measure.read.pixels import FrameStack, open_frames, reduced, relaid
from app.core.text import tr

_MOST_KEPT: Final = 12288 * 6144
# Frames at half size that differ over more than this fraction of the sphere are checked for damage.
_SUSPICIOUS: Final = 0.01


def check_options(bracket: Bracket, options: MeasureOptions) -> None:
    """Check that the options suit the pictures and that there is enough memory."""
    check_size(bracket, options)
    if not bracket.panorama and (options.gains or options.lux or options.masks):
        raise ProbeError(
            tr("These pictures are not full panoramas (2:1), so lamps and masks cannot be used."),
            tr("Leave out the lamp and mask options."),
        )


def check_size(bracket: Bracket, options: MeasureOptions) -> None:
    """Check that the result fits in memory."""
    rows, columns = bracket.shape
    if rows * columns <= _MOST_KEPT or (bracket.panorama and not options.full):
        return
    raise ProbeError(
        tr(
            "These frames are too large to merge at full size: {columns} x {rows} pixels.",
            columns=columns,
            rows=rows,
        ),
        tr("Leave out --full.")
        if bracket.panorama
        else tr("Scale all of them down by the same factor."),
    )


def merge_bracket(
    bracket: Bracket, options: MeasureOptions, opener: Opener, token: Token, report: Report
) -> Measurement:
    """Merge a 360 camera's frames, decoding bright ones at half size if that is sufficient."""
    halves = () if options.full else _halves(bracket)
    measurement = merge_frames(bracket, options, opener, token, report, halves)
    if any(halves) and measurement.motion.share > _SUSPICIOUS:
        small = [frame for frame, half in zip(bracket.frames, halves, strict=True) if half]
        if not all(is_whole(frame, token) for frame in small):
            return merge_frames(bracket, options, open_frame, token, report)
    return measurement


def merge_frames(
    bracket: Bracket,
    options: MeasureOptions,
    opener: Opener,
    token: Token,
    report: Report,
    halves: Sequence[bool] = (),
    look: Callable[[FrameStack], None] | None = None,
) -> Measurement:
    """Merge frames, closing their files whatever happens.

    Args:
        halves: Whether each frame is decoded at half size.
        look: For ordinary pictures, a function called with the aligned frames before the merge.

    Returns:
        A measurement whose light is not finished yet.
    """
    ordinary = look is not None
    opened, circles = _open(bracket, opener, token, span(report, 0.0, 0.4), halves, not ordinary)
    choose = partial(choose_response, mode=options.response)
    with opened, ThreadPoolExecutor(1) as beside:
        early = beside.submit(choose, opened.samples, opened.stops)
        sphere = circles is None and not ordinary
        bracket = replace(bracket, unstitched=not sphere)
        check_options(bracket, options)
        size = None if options.full or ordinary else SIZE
        aligned = _align(opened, circles is None, sphere, token, span(report, 0.4, 0.5))
        with aligned.stack as stack:
            # Frames that were rotated have different samples.
            same = stack is opened
            response = early.result() if same else choose(stack.samples, stack.stops)
            foreign = () if ordinary else _foreign(stack, response, options)
            if foreign:
                return _without(bracket, stack, foreign, options, token, report)
            used = replace(bracket, frames=stack.frames, stops=stack.stops)
            if look is not None:
                look(stack)
            report(0.5, Progress(Task.CHECKING_EXPOSURES))
            is_srgb = response.response.name == "sRGB"
            motion = deghosting.trust(
                stack.proxies,
                response.stops,
                response.response,
                visibility=stack.visibility,
                exposures_known=is_srgb and not response.remarks,
                sphere=sphere,
            )
            level = levelling(used, aligned.first_rotation(used), aligned.picture(used))
            merged = merge(
                stack,
                response.response,
                response.stops,
                scheme=options.weights,
                exposures_known=is_srgb,
                doubts=_unlike(stack, response),
                trust=motion.masks,
                size=size if circles is None else circle_size(stack.shape, circles, size),
                sphere=sphere,
                token=token,
                report=span(report, 0.55, 1.0),
            )
    stitching = None
    if circles is not None:
        report(1.0, Progress(Task.STITCHING))
        merged, stitching = to_panorama(merged, circles, used.frames[0].camera, size, token)
    names = [frame.path.name for frame in stack.frames]
    merged = _levelled(merged, level)
    return Measurement(
        way=_way_of(used, circles),
        bracket=replace(used, stops=tuple(response.stops)),
        response=response,
        alignments=aligned.alignments,
        lays=aligned.lays,
        levelling=level,
        motion=motion,
        finished=FinishedLight(merged, merged),
        warnings=(
            *bracket.warnings,
            *stack.warnings,
            *aligned.remarks,
            *response.with_tags(names),
            *motion.remarks,
            *(stitching.remarks if stitching is not None else ()),
        ),
        own=stitching,
    )


def _way_of(bracket: Bracket, circles: Circles | None) -> str:
    if len(bracket.frames) == 1:
        return "single"
    return "bracket" if circles is None else "fisheye"


def _foreign(
    stack: FrameStack, choice: ResponseChoice, options: MeasureOptions
) -> tuple[Foreign, ...]:
    """Find frames that do not belong to the series, unless the user gave the exposure times."""
    if options.times is not None or any(mask is not None for mask in stack.visibility):
        return ()
    return foreign_frames(stack.proxies, stack.samples, choice, stack.stops, options.response)


def _without(
    bracket: Bracket,
    stack: FrameStack,
    foreign: Sequence[Foreign],
    options: MeasureOptions,
    token: Token,
    report: Report,
) -> Measurement:
    """Merge the files again, without the foreign frames."""
    left_out = tuple(LeftOut(stack.frames[each.frame].path, each.reason) for each in foreign)
    names = {each.path for each in left_out}
    indices = [k for k, frame in enumerate(stack.frames) if frame.path not in names]
    rest = replace(
        bracket,
        frames=tuple(stack.frames[k] for k in indices),
        stops=tuple(stack.stops[k] for k in indices),
        warnings=(*bracket.warnings, *stack.warnings, *(each.remark for each in left_out)),
        unstitched=False,
    )
    probe = merge_frames(rest, options, open_frame, token, report)
    return replace(probe, left_out=(*left_out, *probe.left_out))


def _unlike(stack: FrameStack, choice: ResponseChoice) -> tuple[float, ...]:
    """Measure how much frames differ, unless they are panoramas or the curve is the cause."""
    doubtful = bool(choice.remarks) or stack.shape[1] == 2 * stack.shape[0]
    if choice.response.name == "sRGB" and doubtful:
        return ()
    return doubts(stack.samples, choice.response.table, choice.stops)


def _open(
    bracket: Bracket,
    opener: Opener,
    token: Token,
    report: Report,
    halves: Sequence[bool],
    whole: bool,
) -> tuple[FrameStack, Circles | None]:
    """Open the frames, decoding them in full if they show two circles.

    Each of the two circles fills only half of a frame.
    """
    frame_stack = open_frames(bracket, opener=opener, token=token, report=report, halves=halves)
    if not whole:
        return frame_stack, None
    try:
        circles = _circles(frame_stack)
    except ProbeError:
        frame_stack.close()
        raise
    if circles is None or all(frame_stack.whole):
        return frame_stack, circles
    return open_frames(bracket, token=token, report=report), circles


def _circles(stack: FrameStack) -> Circles | None:
    """Return the two fisheye circles in the frames, or None if the frames are panoramas."""
    names = [frame.path.name for frame in stack.frames]
    circles = recognise(stack.proxies, names)
    fisheye = [frame.path.name for frame in stack.frames if frame.fisheye]
    if circles is None and fisheye:
        raise ProbeError(
            tr(
                "{fisheye} is a fisheye picture, but its two image circles could not be found.",
                fisheye=fisheye[0],
            ),
            tr("Stitch it in the camera or with the camera maker’s software."),
        )
    if circles is None and len(stack.frames) == 1 and stack.shape[1] != 2 * stack.shape[0]:
        raise not_all_around(stack.frames[0])
    return circles


def _halves(bracket: Bracket) -> tuple[bool, ...]:
    """Choose the frames to decode at half size, provided that is still larger than the result."""
    fits = bracket.panorama and bracket.shape[0] >= 2 * SIZE[0]
    if not fits or not all(halvable(frame) for frame in bracket.frames):
        return ()
    return tuple(not whole for whole in anchors(bracket.stops))


@dataclass(frozen=True, slots=True)
class _AlignedFrames:
    """The opened frames of a bracket, with their rotations or homographies and any remarks."""

    stack: FrameStack
    alignments: tuple[align.FrameAlignment, ...]
    remarks: tuple[Remark, ...]
    lays: tuple[handheld.Lay, ...] = ()

    def first_rotation(self, bracket: Bracket) -> Float64 | None:
        """Return the rotation of the first shot, whose pose determines the levelling."""
        return self.alignments[first_shot(bracket)].rotation if self.alignments else None

    def picture(self, bracket: Bracket) -> Bytes | None:
        """Return a small copy of the frame with the clearest edges, or None if none is needed."""
        poses = [frame.pose for frame in bracket.frames if frame.pose is not None]
        if not self.alignments or not any(pose.pitch_deg or pose.roll_deg for pose in poses):
            return None
        return self.stack.proxies[align.reference_of(self.stack.proxies)]


def _align(
    stack: FrameStack, moves: bool, sphere: bool, token: Token, report: Report
) -> _AlignedFrames:
    """Align the frames if they need aligning and may be moved."""
    report(0.0, Progress(Task.ALIGNING_FRAMES))
    if not moves:
        return _AlignedFrames(stack, (), ())
    alignments = align.estimate(stack.proxies, stack.stops)
    names = [frame.path.name for frame in stack.frames]
    if not sphere or stack.shape[1] != 2 * stack.shape[0]:
        return _aligned_by_hand(stack, alignments, names, token, report)
    turns = [one.rotation for one in alignments]
    if any(turn is not None for turn in turns):
        ways = [None if turn is None else partial(remap_frame, matrix=turn) for turn in turns]
        stack = relaid(stack, ways, token=token, report=report)
    return _AlignedFrames(stack, alignments, align.remarks(alignments, names))


def _aligned_by_hand(
    stack: FrameStack,
    unturned: tuple[align.FrameAlignment, ...],
    names: Sequence[str],
    token: Token,
    report: Report,
) -> _AlignedFrames:
    """Undo the hand motion between the frames of ordinary pictures."""
    small = reduced(stack, handheld.LONGEST, token)
    scale = max(stack.shape) / max(small[0].shape)
    home = handheld.reference_of(small)
    lays = handheld.lay_on_each_other(small, stack.stops, home, scale)
    moves = [lay.homography if lay.needed else None for lay in lays]
    visibility = handheld.visibility(stack.proxies, moves, stack.shape)
    if any(move is not None for move in moves) or any(mask is not None for mask in visibility):
        ways = [None if m is None else partial(handheld.warp, homography=m) for m in moves]
        stack = relaid(stack, ways, visibility=visibility, token=token, report=report)
    return _AlignedFrames(stack, unturned, handheld.remarks(lays, names), lays)


def _levelled(merged: MergedLight, level: Levelling) -> MergedLight:
    """Rotate merged light to make the horizon level."""
    if level.rotation is None:
        return merged
    light, clipping = (
        rotate_light(part, level.rotation) for part in (merged.radiance, merged.shares)
    )
    return merged.moved(light, clipping)
