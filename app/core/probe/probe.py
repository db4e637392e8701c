"""The whole way from files to an environment: what `merge` does, and the app after a capture.

    files -> bracket -> pixels -> aligned -> response -> what moved -> merged -> levelled
          -> lamps -> sun, gains, meter readings -> clutter filled -> clip audit

Every step is a module beside this one; here is only their order.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.colour import srgb_encode
from app.core.environment import from_radiance
from app.core.errors import ProbeError
from app.core.probe import align, moved
from app.core.probe.bracket import read_bracket
from app.core.probe.clutter import foot_of
from app.core.probe.decoding import MemoryRows
from app.core.probe.display import display_panorama
from app.core.probe.finish import Finished, Wishes, finish
from app.core.probe.first_pass import (
    OpenedFrame,
    open_frame,
    proxy_shape,
    sample_places,
    sampled,
    shrunk,
)
from app.core.probe.frame import Bracket, Exposure, Frame
from app.core.probe.level import Levelling, first_shot, levelling
from app.core.probe.merge import SIZE, merge
from app.core.probe.pixels import FrameStack, open_frames, rotated
from app.core.probe.response import ResponseChoice, choose_response
from app.core.probe.theta_limits import theta_limits
from app.core.progress import Report, Token, silent, span
from app.core.sphere import rotate_light

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.environment import Environment
    from app.core.pack import StylePack
    from app.core.probe.first_pass import Opener
    from app.core.probe.frame import Merged

__all__ = ["Probe", "Wishes", "measure", "rehearse"]

Float64: TypeAlias = NDArray[np.float64]

_REHEARSAL: Final = (128, 256)


@dataclass(frozen=True, slots=True)
class Probe:
    """The light of a place as a bracket tells it, and how far to trust that.

    Attributes
    ----------
    bracket : Bracket
        The frames that were used, with their true exposures.
    response : ResponseChoice
        Camera curve.
    alignments : tuple[Alignment, ...]
        Of each frame; empty for pictures that are not panoramas.
    levelling : Levelling
        How the panorama was levelled.
    moved : Moved
        What moved between the frames.
    finished : Finished
        The light, with everything done to it, its lamps and its audit.
    display : (h, w, 3) uint8
        The panorama for looking at, as measured, sRGB.
    warnings : tuple[str, ...]
        Sentences for the user.
    notes : tuple[str, ...]
        What was done, in sentences; nothing to worry about.
    """

    bracket: Bracket
    response: ResponseChoice
    alignments: tuple[align.Alignment, ...]
    levelling: Levelling
    moved: moved.Moved
    finished: Finished
    display: NDArray[np.uint8] = field(repr=False)
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def merged(self) -> Merged:
        """The light, with everything done to it."""
        return self.finished.merged

    def environment(self, name: str) -> Environment:
        """Return the light as an environment that can be solved.

        Parameters
        ----------
        name : str
            Of the place.

        Raises
        ------
        EnvironmentFileError
            For pictures that are not panoramas, and when everything is black.
        """
        return from_radiance(self.merged.radiance.copy(), name)


def measure(
    paths: Sequence[Path],
    pack: StylePack,
    wishes: Wishes | None = None,
    *,
    opener: Opener = open_frame,
    token: Token | None = None,
    report: Report = silent,
) -> Probe:
    """Make an environment of a bracket.

    Parameters
    ----------
    paths : Sequence[Path]
        The exposures in any order, or one folder of them. They are only read.
    pack : StylePack
        Head and styles, for what clipped light means for the answers.
    wishes : Wishes, optional
        What is wanted besides.
    opener : Opener, optional
        Hands over frames that were read before (`app.core.probe.arriving`).
    token : Token, optional
        Stops the work.
    report : Report, optional
        Is told how far it is.

    Returns
    -------
    Probe

    Raises
    ------
    ProbeError
        When the files are no bracket, or a wish cannot be met: one sentence and what to do.
    Cancelled
        When the token was cancelled.
    """
    wishes, token = wishes or Wishes(), token or Token()
    bracket = read_bracket(paths, wishes.times)
    if not bracket.panorama and (wishes.gains or wishes.lux or wishes.masks):
        raise ProbeError(
            "These pictures are not full panoramas (2:1): they have no lamps or directions.",
            "Leave out what names lamps or masks.",
        )
    found = _to_light(bracket, wishes, opener, token, span(report, 0.0, 0.9))
    token.check()
    report(0.9, "finding lamps")
    with ThreadPoolExecutor(1) as beside:
        display = beside.submit(display_panorama, found.merged.radiance)
        finished = _finished(found, pack, wishes)
    report(1.0, "done")
    return Probe(
        bracket=found.bracket,
        response=found.response,
        alignments=found.alignments,
        levelling=found.level,
        moved=found.motion,
        finished=finished,
        display=display.result(),
        warnings=found.warnings,
        notes=tuple(note for note in (found.level.note, *finished.notes) if note),
    )


def rehearse(pack: StylePack) -> None:
    """Go the whole way once with a small made-up bracket.

    Libraries are loaded, tables computed and memory is asked for then. Done while a camera is
    exposing, it saves a third of the first `measure` of a process.

    Parameters
    ----------
    pack : StylePack
        Head and styles that will be used.
    """
    frames = tuple(
        Frame(Path(f"rehearsal {stop}"), _REHEARSAL, exposure=Exposure(4.0**-stop))
        for stop in range(3)
    )
    bracket = Bracket(frames, tuple(float(-2 * stop) for stop in range(3)))
    found = _to_light(bracket, Wishes(), _made_up, Token(), silent)
    _finished(found, pack, Wishes())
    display_panorama(found.merged.radiance)


def _made_up(frame: Frame, *, hold: bool, token: Token) -> OpenedFrame:
    """Open a frame that is in no file: squares of light at its exposure."""
    del hold, token
    assert frame.exposure is not None
    squares = np.random.default_rng(0).random((frame.shape[0] // 8, frame.shape[1] // 8, 3))
    light = 2.0 * frame.exposure.factor * squares.repeat(8, axis=0).repeat(8, axis=1)
    codes = np.rint(255.0 * srgb_encode(np.minimum(light, 1.0))).astype(np.uint8)
    places = sample_places(frame.shape)
    small = shrunk(codes, proxy_shape(frame.shape))
    return OpenedFrame(MemoryRows(codes), small, sampled(codes, places), 0.0)


@dataclass(frozen=True, slots=True)
class _Found:
    """Merged and levelled light, and what was found out on the way."""

    bracket: Bracket
    alignments: tuple[align.Alignment, ...]
    response: ResponseChoice
    motion: moved.Moved
    level: Levelling
    merged: Merged
    warnings: tuple[str, ...]


def _to_light(
    bracket: Bracket, wishes: Wishes, opener: Opener, token: Token, report: Report
) -> _Found:
    """Go from files to light; what was opened is closed however it ends."""
    opened = open_frames(bracket, opener=opener, token=token, report=span(report, 0.0, 0.4))
    choose = partial(choose_response, mode=wishes.response)
    with opened, ThreadPoolExecutor(1) as beside:
        early = beside.submit(choose, opened.samples, opened.stops)
        with _align(opened, token, span(report, 0.4, 0.5)) as aligned:
            stack = aligned.stack
            used = replace(bracket, frames=stack.frames, stops=stack.stops)
            report(0.5, "checking the exposures")
            # Frames that were turned have other samples.
            same = stack is opened
            response = early.result() if same else choose(stack.samples, stack.stops)
            motion = moved.trust(stack.proxies, response.stops, response.response)
            level = levelling(used, aligned.first_rotation(used), aligned.picture(used))
            merged = merge(
                stack,
                response.response,
                response.stops,
                scheme=wishes.weights,
                trust=motion.masks,
                size=None if wishes.full else SIZE,
                token=token,
                report=span(report, 0.55, 1.0),
            )
    names = [frame.path.name for frame in stack.frames]
    return _Found(
        bracket=replace(used, stops=tuple(response.stops)),
        alignments=aligned.alignments,
        response=response,
        motion=motion,
        level=level,
        merged=_levelled(merged, level),
        warnings=(
            *bracket.warnings,
            *stack.warnings,
            *aligned.sentences,
            *response.sentences(names),
            *motion.sentences,
        ),
    )


def _finished(found: _Found, pack: StylePack, wishes: Wishes) -> Finished:
    """Do what can be done to a panorama; other pictures are left as they are."""
    if not found.bracket.panorama:
        return Finished(found.merged, found.merged)
    foot = foot_of(found.level.rotation)
    return finish(found.merged, pack, wishes, foot=foot, room_stops=_room(found.bracket))


@dataclass(frozen=True, slots=True)
class _Aligned:
    """Frames that lie on each other."""

    stack: FrameStack
    alignments: tuple[align.Alignment, ...]
    sentences: tuple[str, ...]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.stack.close()

    def first_rotation(self, bracket: Bracket) -> Float64 | None:
        """Return what was done to the frame that was shot first, whose pose counts."""
        return self.alignments[first_shot(bracket)].rotation

    def picture(self, bracket: Bracket) -> NDArray[np.uint8] | None:
        """Return a small copy of the frame in which edges can be seen best, if one is needed."""
        poses = [frame.pose for frame in bracket.frames if frame.pose is not None]
        if not any(pose.pitch_deg or pose.roll_deg for pose in poses):
            return None
        return self.stack.proxies[align.reference_of(self.stack.proxies)]


def _align(stack: FrameStack, token: Token, report: Report) -> _Aligned:
    """Lay the frames on each other where they do not lie so already."""
    report(0.0, "aligning frames")
    found = align.estimate(stack.proxies, stack.stops)
    words = align.sentences(found, [frame.path.name for frame in stack.frames])
    turns = [one.rotation for one in found]
    if any(turn is not None for turn in turns):
        stack = rotated(stack, turns, token=token, report=report)
    return _Aligned(stack, found, words)


def _levelled(merged: Merged, level: Levelling) -> Merged:
    """Turn merged light so that up is up."""
    if level.rotation is None:
        return merged
    shares = np.stack([merged.clipped, merged.dark], axis=-1)
    turned = rotate_light(shares, level.rotation)
    return replace(
        merged,
        radiance=rotate_light(merged.radiance, level.rotation),
        clipped=np.clip(turned[..., 0], 0.0, 1.0),
        dark=np.clip(turned[..., 1], 0.0, 1.0),
    )


def _room(bracket: Bracket) -> float | None:
    """Count the stops from the darkest frame to the darkest that the camera could have shot."""
    known = theta_limits(bracket.frames[0].camera)
    if known is None:
        return None
    limits = known.limits
    floor = Exposure(min(limits.shutters_s), min(limits.isos), max(limits.apertures))
    return max(min(bracket.stops) - floor.ev, 0.0)
