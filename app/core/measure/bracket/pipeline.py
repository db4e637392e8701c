"""The whole way from files to an environment: what `merge` does, and the app after a capture.

    files -> bracket -> pixels -> aligned -> response -> what moved -> merged -> levelled
          -> lamps -> sun, gains, meter readings -> clutter filled -> clip audit

Frames of two fisheye circles are not aligned, and stitched between merging and levelling. A mirror
ball is found in aligned frames, and unwrapped after merging.

Every step is a module beside this one; here is only their order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from app.core.base.arrays import Bytes, Float32, Float64
from app.core.base.colour import srgb_encode
from app.core.base.errors import ProbeError
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.sphere import remap_frame, rotate_light
from app.core.environment.environment import Environment, energy, from_radiance, kept_shares
from app.core.environment.holes import GOES_ON, canvas
from app.core.measure.ball.ball_finder import Ball, find_ball, fused, refined
from app.core.measure.ball.mirror_ball import (
    BallOptions,
    ball_notes,
    find_lens,
    joined,
    panorama_rows,
    unwrap,
)
from app.core.measure.bracket import align, deghosting, handheld
from app.core.measure.bracket.align import Levelling, first_shot, levelling
from app.core.measure.bracket.bracket import not_all_around, read_bracket
from app.core.measure.bracket.foreign_frames import Foreign, Reason, foreign_frames
from app.core.measure.bracket.half_size import anchors, halvable, is_whole
from app.core.measure.bracket.merge import SIZE, merge
from app.core.measure.bracket.response import ResponseChoice, choose_response
from app.core.measure.bracket.weighting import doubts
from app.core.measure.finish.display import display_panorama
from app.core.measure.finish.finish import Finished, MergeOptions, finish
from app.core.measure.finish.inpainting import fill
from app.core.measure.finish.tripod_detection import foot_of
from app.core.measure.fisheye.dual_fisheye import Circles, may_be_circles, recognise
from app.core.measure.fisheye.fisheye_stitch import Stitching, circle_size, to_panorama
from app.core.measure.plan.camera_table import camera_facts
from app.core.measure.read.decoding import (
    MemoryRows,
    OpenedFrame,
    Opener,
    open_frame,
    proxy_shape,
    sample_places,
    sampled,
    shrunk,
    transparent,
)
from app.core.measure.read.frame import Bracket, Exposure, Frame, Merged
from app.core.measure.read.pixels import FrameStack, open_frames, reduced, relaid
from app.core.styles.style_pack import StylePack
from app.core.text import tr
from app.core.text.quantities import small_percent

_MOST_KEPT: Final = 12288 * 6144
_BLACK: Final = 0.0024  # linear: code 8, as compression leaves of black
_HALF: Final = 0.5  # of a texel
_MOST_BLIND: Final = 0.9  # of the sphere
_REHEARSAL: Final = (128, 256)
# Frames at half size that differ over so much of the sphere are looked at for damage.
_SUSPICIOUS: Final = 0.01


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A file of a bracket that was not merged, and why."""

    path: Path
    reason: Reason

    @property
    def sentence(self) -> str:
        """Name it, and say what to do."""
        name = self.path.name
        if self.reason is Reason.BLACK:
            return tr("{name} is black and was left out.", name=name)
        if self.reason is Reason.OTHER_SCENE:
            return tr(
                "{name} shows another scene and was left out. Remove it from the bracket.",
                name=name,
            )
        return tr(
            "{name} is no exposure of this bracket and was left out: its tones were changed, as in "
            "an HDR picture or a preview.",
            name=name,
        )


@dataclass(frozen=True, slots=True)
class Probe:
    """The light of a place as a bracket tells it, and how far to trust that.

    `bracket` holds the frames that were used, with their true exposures. `display`, (h, w, 3)
    uint8 sRGB, is the panorama as measured. `stitching` is None except for unstitched frames,
    `ball` except for pictures of a mirror ball. `blind` is the share of the sphere that was filled
    because no picture shows it. `left_out` are files that are no exposures of the series.
    """

    bracket: Bracket
    response: ResponseChoice
    alignments: tuple[align.Alignment, ...]
    lays: tuple[handheld.Lay, ...]
    levelling: Levelling
    moved: deghosting.Moved
    finished: Finished
    warnings: tuple[str, ...]
    notes: tuple[str, ...] = ()
    stitching: Stitching | None = None
    ball: Ball | None = None
    blind: float = 0.0
    left_out: tuple[LeftOut, ...] = ()
    display: Bytes = field(default_factory=lambda: np.empty((0, 0, 3), np.uint8), repr=False)

    @property
    def merged(self) -> Merged:
        """The light, with everything done to it."""
        return self.finished.merged

    @property
    def rough(self) -> bool:
        """Whether it is one photograph, in which what is clipped is a guess."""
        return len(self.bracket.frames) == 1

    @property
    def shares(self) -> dict[str, Float32]:
        """What a file keeps beside the light: clipped in one photograph, and not seen; (H, W)."""
        return kept_shares(self.merged.clipped if self.rough else None, self.finished.unseen)

    def environment(self, name: str) -> Environment:
        """Return the light as an environment that can be solved.

        EnvironmentFileError for pictures that are not panoramas, and when everything is
        black.
        """
        light, clipped = from_radiance(self.merged.radiance.copy(), name), self.merged.clipped
        return replace(
            light,
            rough=self.rough,
            clipped=clipped if self.rough and clipped.any() else None,
            unseen=self.finished.unseen,
        )


def measure(
    paths: Sequence[Path],
    pack: StylePack,
    options: MergeOptions | None = None,
    *,
    opener: Opener = open_frame,
    token: Token | None = None,
    report: Report = silent,
) -> Probe:
    """Make an environment of a bracket: exposures in any order, or one folder of them.

    Of one photograph, where the options take it alone, it is a rough one. Raises ProbeError (one
    sentence and what to do) when the files are no bracket or a wish cannot be met, and Cancelled.
    """
    options, token = options or MergeOptions(), token or Token()
    bracket = read_bracket(paths, options.times, alone=options.alone, sort_out=options.sort_out)
    if bracket.panorama or not may_be_circles(bracket.shape):
        _check_options(bracket, options)
    found = _to_light(bracket, options, opener, token, span(report, 0.0, 0.9))
    token.check()
    report(0.9, Progress(Task.FINDING_LAMPS))
    found, blind = _without_gaps(found, token)
    with ThreadPoolExecutor(1) as beside:
        display = beside.submit(display_panorama, found.merged.radiance)
        finished = _finished(found, pack, options, blind)
    report(1.0, Progress(Task.DONE))
    notes = tuple(note for note in (found.levelling.note, *finished.notes) if note)
    return replace(found, finished=finished, display=display.result(), notes=notes)


def measure_ball(
    paths: Sequence[Path],
    wanted: BallOptions,
    pack: StylePack,
    options: MergeOptions | None = None,
    *,
    token: Token | None = None,
    report: Report = silent,
) -> Probe:
    """Make an environment of a bracket of a mirror ball, from one side or two.

    Raises as `measure` does, and ProbeError where there is not exactly one ball.
    """
    options, token = options or MergeOptions(), token or Token()
    brackets = [read_bracket(some, options.times) for some in (paths, wanted.second) if some]
    probes = []
    for number, bracket in enumerate(brackets):
        _check_size(bracket, replace(options, full=True))
        part = span(report, 0.9 * number / len(brackets), 0.9 * (number + 1) / len(brackets))
        probes.append(_light_of(bracket, options, open_frame, token, part, ball=True))
    balls = [refined(each.ball, each.merged.radiance) for each in probes if each.ball is not None]
    guessed: tuple[str, ...] = ()
    for number, probe in enumerate(probes):
        if probe.bracket.frames[0].focal_mm is None:
            balls[number] = find_lens(probe.merged, balls[number], wanted, token)
            guessed = (tr("No file states the lens: what is behind the ball told it."),)
    rows = panorama_rows(max(ball.radius_px for ball in balls))
    sides = [
        unwrap(probe.merged, ball, rows, wanted, token)
        for probe, ball in zip(probes, balls, strict=True)
    ]
    seen = sides[0] if len(sides) == 1 else joined(sides[0], sides[1], wanted.from_deg)
    report(0.9, Progress(Task.FINDING_LAMPS))
    light = probes[0].merged.moved(seen.texels[..., :3], seen.texels[..., 3:])
    light, room = fill(light, seen.blind), _room(brackets[0])
    finished = finish(light, pack, options, room_stops=room, blind=seen.blind)
    share = float(energy(seen.blind)) / (4.0 * math.pi)
    report(1.0, Progress(Task.DONE))
    return replace(
        probes[0],
        finished=finished,
        ball=balls[0],
        blind=share,
        warnings=tuple(dict.fromkeys(line for probe in probes for line in probe.warnings)),
        notes=(*ball_notes(balls, share), *guessed, *seen.notes, *finished.notes),
        display=display_panorama(finished.merged.radiance),
    )


def _check_options(bracket: Bracket, options: MergeOptions) -> None:
    """Refuse options that only a panorama can take, and pictures too large for memory."""
    _check_size(bracket, options)
    if not bracket.panorama and (options.gains or options.lux or options.masks):
        raise ProbeError(
            tr("These pictures are not full panoramas (2:1): they have no lamps or directions."),
            tr("Leave out what names lamps or masks."),
        )


def _check_size(bracket: Bracket, options: MergeOptions) -> None:
    """Refuse results that would take more memory than a computer can be expected to have."""
    rows, columns = bracket.shape
    if rows * columns <= _MOST_KEPT or (bracket.panorama and not options.full):
        return
    raise ProbeError(
        tr(
            "At {columns} x {rows} pixels these frames are too large to be merged at "
            "their own size.",
            columns=columns,
            rows=rows,
        ),
        tr("Leave out --full.")
        if bracket.panorama
        else tr("Scale all of them down by the same factor."),
    )


def rehearse(pack: StylePack) -> None:
    """Go the whole way once with a small made-up bracket.

    Libraries are loaded, tables computed and memory is asked for then. Done while a camera is
    exposing, it saves a third of the first `measure` of a process.
    """
    frames = tuple(
        Frame(Path(f"rehearsal {stop}"), _REHEARSAL, exposure=Exposure(4.0**-stop))
        for stop in range(3)
    )
    bracket = Bracket(frames, tuple(float(-2 * stop) for stop in range(3)))
    found = _to_light(bracket, MergeOptions(), _made_up, Token(), silent)
    _finished(found, pack, MergeOptions())
    display_panorama(found.merged.radiance)


def _made_up(frame: Frame, *, hold: bool, token: Token, half: bool = False) -> OpenedFrame:
    """Open a frame that is in no file: squares of light at its exposure."""
    del hold, token, half
    assert frame.exposure is not None
    squares = np.random.default_rng(0).random((frame.shape[0] // 8, frame.shape[1] // 8, 3))
    light = 2.0 * frame.exposure.factor * squares.repeat(8, axis=0).repeat(8, axis=1)
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    places = sample_places(frame.shape)
    small = shrunk(codes, proxy_shape(frame.shape))
    return OpenedFrame(MemoryRows(codes), small, sampled(codes, places), 0.0)


def _to_light(
    bracket: Bracket, options: MergeOptions, opener: Opener, token: Token, report: Report
) -> Probe:
    """Go from files to light, with bright frames at half their size where that is enough."""
    halves = () if options.full else _halves(bracket)
    found = _light_of(bracket, options, opener, token, report, halves)
    if any(halves) and found.moved.share > _SUSPICIOUS:
        small = [frame for frame, half in zip(bracket.frames, halves, strict=True) if half]
        if not all(is_whole(frame, token) for frame in small):
            return _light_of(bracket, options, open_frame, token, report)
    return found


def _light_of(
    bracket: Bracket,
    options: MergeOptions,
    opener: Opener,
    token: Token,
    report: Report,
    halves: Sequence[bool] = (),
    ball: bool = False,
) -> Probe:
    """Go from files to light, not finished; what was opened is closed however it ends."""
    opened, circles = _opened(bracket, opener, token, span(report, 0.0, 0.4), halves, not ball)
    choose = partial(choose_response, mode=options.response)
    with opened, ThreadPoolExecutor(1) as beside:
        early = beside.submit(choose, opened.samples, opened.stops)
        sphere = circles is None and not ball
        bracket = replace(bracket, unstitched=not sphere)
        _check_options(bracket, options)
        size = None if options.full or ball else SIZE
        aligned = _align(opened, circles is None, sphere, token, span(report, 0.4, 0.5))
        with aligned.stack as stack:
            # Frames that were turned have other samples.
            same = stack is opened
            response = early.result() if same else choose(stack.samples, stack.stops)
            foreign = () if ball else _foreign(stack, response, options)
            if foreign:
                return _without(bracket, stack, foreign, options, token, report)
            used = replace(bracket, frames=stack.frames, stops=stack.stops)
            found = _ball_in(stack, token) if ball else None
            report(0.5, Progress(Task.CHECKING_EXPOSURES))
            known = response.response.name == "sRGB"
            motion = deghosting.trust(
                stack.proxies,
                response.stops,
                response.response,
                seen=stack.seen,
                known=known and not response.remarks,
                sphere=sphere,
            )
            level = levelling(used, aligned.first_rotation(used), aligned.picture(used))
            merged = merge(
                stack,
                response.response,
                response.stops,
                scheme=options.weights,
                known=known,
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
    return Probe(
        bracket=replace(used, stops=tuple(response.stops)),
        response=response,
        alignments=aligned.alignments,
        lays=aligned.lays,
        levelling=level,
        moved=motion,
        finished=Finished(merged, merged),
        warnings=(
            *bracket.warnings,
            *stack.warnings,
            *aligned.sentences,
            *response.sentences(names),
            *motion.sentences,
            *(stitching.warnings() if stitching is not None else ()),
        ),
        stitching=stitching,
        ball=found,
    )


def _foreign(
    stack: FrameStack, choice: ResponseChoice, options: MergeOptions
) -> tuple[Foreign, ...]:
    """Find frames that are no exposures of the series; given times are believed."""
    if options.times is not None or any(mask is not None for mask in stack.seen):
        return ()
    return foreign_frames(stack.proxies, stack.samples, choice, stack.stops, options.response)


def _without(
    bracket: Bracket,
    stack: FrameStack,
    foreign: Sequence[Foreign],
    options: MergeOptions,
    token: Token,
    report: Report,
) -> Probe:
    """Go from files to light without the frames that are no exposures of the series."""
    left_out = tuple(LeftOut(stack.frames[each.frame].path, each.reason) for each in foreign)
    names = {each.path for each in left_out}
    kept = [k for k, frame in enumerate(stack.frames) if frame.path not in names]
    rest = replace(
        bracket,
        frames=tuple(stack.frames[k] for k in kept),
        stops=tuple(stack.stops[k] for k in kept),
        warnings=(*bracket.warnings, *stack.warnings, *(each.sentence for each in left_out)),
        unstitched=False,
    )
    probe = _light_of(rest, options, open_frame, token, report)
    return replace(probe, left_out=(*left_out, *probe.left_out))


def _ball_in(stack: FrameStack, token: Token) -> Ball:
    """Find the ball in small pictures that lie on each other."""
    light = fused(reduced(stack, handheld.LONGEST, token), stack.stops)
    ball = find_ball(light, stack.frames[0].focal_mm)
    return ball.resized(stack.shape)


def _unlike(stack: FrameStack, choice: ResponseChoice) -> tuple[float, ...]:
    """Measure how far frames differ, unless they are panoramas or the curve is why."""
    doubtful = bool(choice.remarks) or stack.shape[1] == 2 * stack.shape[0]
    if choice.response.name == "sRGB" and doubtful:
        return ()
    return doubts(stack.samples, choice.response.table, choice.stops)


def _opened(
    bracket: Bracket,
    opener: Opener,
    token: Token,
    report: Report,
    halves: Sequence[bool],
    whole: bool,
) -> tuple[FrameStack, Circles | None]:
    """Open the frames; those of two circles in full, since half the sphere fills half of them."""
    opened = open_frames(bracket, opener=opener, token=token, report=report, halves=halves)
    if not whole:
        return opened, None
    try:
        circles = _circles(opened)
    except ProbeError:
        opened.close()
        raise
    if circles is None or all(opened.whole):
        return opened, circles
    return open_frames(bracket, token=token, report=report), circles


def _circles(stack: FrameStack) -> Circles | None:
    """Look at every frame whether it is a panorama, or two fisheye circles."""
    names = [frame.path.name for frame in stack.frames]
    circles = recognise(stack.proxies, names)
    fisheye = [frame.path.name for frame in stack.frames if frame.fisheye]
    if circles is None and fisheye:
        raise ProbeError(
            tr(
                "{fisheye} is a fisheye picture, but its two image circles cannot be made out.",
                fisheye=fisheye[0],
            ),
            tr("Stitch it in the camera or with its maker's program."),
        )
    if circles is None and len(stack.frames) == 1 and stack.shape[1] != 2 * stack.shape[0]:
        raise not_all_around(stack.frames[0])
    return circles


def _halves(bracket: Bracket) -> tuple[bool, ...]:
    """Choose the frames that are decoded at half their size, which is still more than is wanted."""
    fits = bracket.panorama and bracket.shape[0] >= 2 * SIZE[0]
    if not fits or not all(halvable(frame) for frame in bracket.frames):
        return ()
    return tuple(not whole for whole in anchors(bracket.stops))


def _without_gaps(found: Probe, token: Token) -> tuple[Probe, Float32 | None]:
    """Fill what the frames do not show: where they are transparent, or black canvas.

    Returns also where that is, (H, W), 1 where it was filled.
    """
    bracket, rotation = found.bracket, found.levelling.rotation
    if bracket.unstitched or not bracket.panorama:
        return found, None
    shape = found.merged.clipped.shape
    frame = bracket.frames[0]
    unseen = transparent(frame, (shape[0], shape[1]))
    # The frames of a 360 camera have no canvas: what is black there was dark.
    if rotation is None and camera_facts(frame.camera) is None:
        coded = frame.kind in ("uint8", "uint16")
        unit = 2.0 ** (found.merged.reference_ev - max(bracket.stops))
        black = canvas(found.merged.radiance, _BLACK * unit if coded else None)
        unseen = black if unseen is None else unseen if black is None else unseen | black
    elif rotation is not None and unseen is not None:
        unseen = rotate_light(unseen[..., None].astype(np.float32), rotation)[..., 0] > _HALF
    if unseen is None:
        return found, None
    token.check()
    blind = unseen.astype(np.float32)
    share = float(energy(blind)) / (4.0 * math.pi)
    if share > _MOST_BLIND:
        raise ProbeError(
            tr("{name} shows only {share} of what is around.", name=frame.path.name,
               share=small_percent(1.0 - share)),
            tr("Choose a panorama that is not transparent over most of the sphere."),
        )  # fmt: skip
    merged = fill(found.merged, blind, GOES_ON)
    words = tr(
        "{name} does not show {share} of the sphere. It was filled from around.",
        name=frame.path.name,
        share=small_percent(share),
    )
    finished = replace(found.finished, merged=merged, measured=merged)
    warnings = (*found.warnings, words)
    return replace(found, finished=finished, blind=share, warnings=warnings), blind


def _finished(
    found: Probe, pack: StylePack, options: MergeOptions, blind: Float32 | None = None
) -> Finished:
    """Do what can be done to a panorama; other pictures are left as they are."""
    if not found.bracket.panorama:
        return found.finished
    foot, room = foot_of(found.levelling.rotation), _room(found.bracket)
    alone = found.bracket.frames[0].path.name if found.rough else ""
    return finish(found.merged, pack, options, foot=foot, room_stops=room, alone=alone, blind=blind)


@dataclass(frozen=True, slots=True)
class _Aligned:
    """Frames that lie on each other."""

    stack: FrameStack
    alignments: tuple[align.Alignment, ...]
    sentences: tuple[str, ...]
    lays: tuple[handheld.Lay, ...] = ()

    def first_rotation(self, bracket: Bracket) -> Float64 | None:
        """Return what was done to the frame that was shot first, whose pose counts."""
        return self.alignments[first_shot(bracket)].rotation if self.alignments else None

    def picture(self, bracket: Bracket) -> Bytes | None:
        """Return a small copy of the frame in which edges can be seen best, if one is needed."""
        poses = [frame.pose for frame in bracket.frames if frame.pose is not None]
        if not self.alignments or not any(pose.pitch_deg or pose.roll_deg for pose in poses):
            return None
        return self.stack.proxies[align.reference_of(self.stack.proxies)]


def _align(stack: FrameStack, moves: bool, sphere: bool, token: Token, report: Report) -> _Aligned:
    """Lay frames on each other where they do not lie so already, if they are to be moved at all."""
    report(0.0, Progress(Task.ALIGNING_FRAMES))
    if not moves:
        return _Aligned(stack, (), ())
    found = align.estimate(stack.proxies, stack.stops)
    names = [frame.path.name for frame in stack.frames]
    if not sphere or stack.shape[1] != 2 * stack.shape[0]:
        return _aligned_by_hand(stack, found, names, token, report)
    turns = [one.rotation for one in found]
    if any(turn is not None for turn in turns):
        ways = [None if turn is None else partial(remap_frame, matrix=turn) for turn in turns]
        stack = relaid(stack, ways, token=token, report=report)
    return _Aligned(stack, found, align.sentences(found, names))


def _aligned_by_hand(
    stack: FrameStack,
    unturned: tuple[align.Alignment, ...],
    names: Sequence[str],
    token: Token,
    report: Report,
) -> _Aligned:
    """Undo what a hand did between the frames of ordinary pictures."""
    small = reduced(stack, handheld.LONGEST, token)
    scale = max(stack.shape) / max(small[0].shape)
    home = handheld.reference_of(small)
    lays = handheld.lay_on_each_other(small, stack.stops, home, scale)
    moves = [lay.homography if lay.needed else None for lay in lays]
    seen = handheld.shown(stack.proxies, moves, stack.shape)
    if any(move is not None for move in moves) or any(mask is not None for mask in seen):
        ways = [None if m is None else partial(handheld.laid, homography=m) for m in moves]
        stack = relaid(stack, ways, seen=seen, token=token, report=report)
    return _Aligned(stack, unturned, handheld.sentences(lays, names), lays)


def _levelled(merged: Merged, level: Levelling) -> Merged:
    """Turn merged light so that up is up."""
    if level.rotation is None:
        return merged
    light, lost = (rotate_light(part, level.rotation) for part in (merged.radiance, merged.shares))
    return merged.moved(light, lost)


def _room(bracket: Bracket) -> float | None:
    """Count the stops from the darkest frame to the darkest that the camera could have shot."""
    known = camera_facts(bracket.frames[0].camera)
    if known is None:
        return None
    limits = known.limits
    floor = Exposure(min(limits.shutters_s), min(limits.isos), max(limits.apertures))
    return max(min(bracket.stops) - floor.ev, 0.0)
