"""Exposure tags that do not hold: which frame, and by how much.

One frame's wrong tag shifts all its pairs by the same amount, at every level, and no others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from app.core.hdr.response_recovery import recover_curve
from app.core.hdr.steps import check_matches

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.base.arrays import Float64
    from app.core.hdr.brightness_transfer import CodeMatches
    from app.core.hdr.response_recovery import Recovered
    from app.core.hdr.steps import StepCheck

Stops: TypeAlias = tuple[float, ...]

# Marked shutter times are rounded (1/15 s is 1/16 s): up to 0.12 stops, hence 0.2 with noise.
# Smaller differences that are equal at all levels are put right without a word.
_WORTH_A_WORD: Final = 0.2
_ALIKE: Final = 1.15
_TRIED: Final = 5
_REST: Final = 0.2
_ON_THE_MARK: Final = 0.03
_USUAL_CONTRAST: Final = 0.3


@dataclass(frozen=True, slots=True)
class TagError:
    """A frame that was exposed otherwise than its file says: brighter by so many stops."""

    frame: int
    stops: float
    suspects: tuple[int, ...]

    def sentence(self, names: Sequence[str]) -> str:
        """Say it, naming the frame."""
        name = names[self.frame]
        word = "brighter" if self.stops > 0 else "darker"
        text = (
            f"{name[:1].upper()}{name[1:]} is {abs(self.stops):.2f} stops {word} than its exposure "
            "tags say; the measured exposure is used."
        )
        others = [names[number] for number in self.suspects if number != self.frame]
        if not others:
            return text
        doubt = " or ".join(others)
        return f"{text} It cannot be told whether the tags of {doubt} are wrong instead."


def explain_by_tags(
    matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[Stops, tuple[TagError, ...], StepCheck] | None:
    """Find the wrong tags that make a known curve, (256,), fit steps that do not agree.

    Returns exposures to believe, the errors of a fifth of a stop or more, and the check with
    them; None when tags do not explain the steps (then the curve is another one).
    """
    trials = [_one_wrong(frame, matches, check, stops, table) for frame in _paired(check)]
    fitting = [trial for trial in trials if trial[2].agrees]
    if fitting:
        # The pairs of a bracket of two, or without more overlap, cannot tell one from another.
        # The darker frame is taken then: the brighter one's scale is mostly what was metered.
        least = min(trial[2].disagreement for trial in fitting)
        alike = [trial for trial in fitting if trial[2].disagreement <= _ALIKE * least + 0.05]
        frame, stops_off, better = alike[-1]
        suspects = tuple(trial[0] for trial in alike)
        errors = (TagError(frame, stops_off, suspects),) if _telling(stops_off) else ()
        return _moved(stops, {frame: stops_off}), errors, better
    if _longer_steps(check):
        return None
    return _several_wrong(matches, check, stops, table)


def recover_with_tag(
    matches: CodeMatches, stops: Stops, curve: Recovered, check: StepCheck
) -> tuple[Recovered, Stops, tuple[TagError, ...], StepCheck] | None:
    """Recover a curve together with the one exposure that is wrong, of three frames or more.

    Returns curve, exposures to believe, error, and the check with them; None when no single tag
    makes the frames fit much better.
    """
    trials: list[tuple[int, Recovered, StepCheck]] = []
    for frame in _likeliest(matches, check, stops, curve):
        trial = recover_curve(matches, stops, free_frame=frame)
        better = check_matches(matches, _moved(stops, {frame: trial.tag_stops}), trial.table)
        fits = better.disagreement < 0.5 * check.disagreement and trial.cost < 0.7 * curve.cost
        if fits and _telling(trial.tag_stops):
            trials.append((frame, trial, better))
    if not trials:
        return None
    least = min(trial[1].cost for trial in trials)
    alike = [trial for trial in trials if trial[1].cost <= _ALIKE * least]
    frame, best, better = min(alike, key=lambda trial: _unlikely(trial[1]))
    error = TagError(frame, best.tag_stops, tuple(trial[0] for trial in alike))
    return best, _moved(stops, {frame: best.tag_stops}), (error,), better


def _unlikely(curve: Recovered) -> float:
    """How odd a curve and the tag error that comes with it are; a judgement, not a measurement.

    Curves whose contrast is on the whole sRGB's are the usual ones: measured over the brighter
    half of the nodes (codes above 40), where all curves are well known. Tags that lie do so by
    a whole stop (doubled or halved by mistake) or else by a mark of the dial, a third.
    """
    contrast = abs(float(np.mean(curve.unknowns[len(curve.unknowns) // 2 :])))
    stops = curve.tag_stops
    if abs(stops - round(stops)) < _ON_THE_MARK and round(stops) != 0:
        oddity = 0.0
    elif abs(3.0 * stops - round(3.0 * stops)) < 3.0 * _ON_THE_MARK:
        oddity = 1.0
    else:
        oddity = 1.5
    return contrast / _USUAL_CONTRAST + oddity


def _paired(check: StepCheck) -> list[int]:
    """Frames that share well exposed places with another one."""
    return sorted({step.bright for step in check.steps} | {step.dark for step in check.steps})


def _likeliest(matches: CodeMatches, check: StepCheck, stops: Stops, curve: Recovered) -> list[int]:
    """Few frames of a long bracket that may be wrong, so that not all need a recovery."""
    frames = _paired(check)
    if len(frames) <= _TRIED:
        return frames
    found = [_one_wrong(frame, matches, check, stops, curve.table) for frame in frames]
    found.sort(key=lambda trial: trial[2].disagreement)
    return [trial[0] for trial in found[:_TRIED]]


def _telling(stops: float) -> bool:
    return abs(stops) >= _WORTH_A_WORD


def _moved(stops: Stops, by: dict[int, float]) -> Stops:
    """Exposures with some of them corrected."""
    return tuple(value + by.get(frame, 0.0) for frame, value in enumerate(stops))


def _one_wrong(
    frame: int, matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[int, float, StepCheck]:
    """Believe all frames but one; (frame, its error in stops, the check then)."""
    signs = [(step.bright == frame) - (step.dark == frame) for step in check.steps]
    off = [sign * step.off for sign, step in zip(signs, check.steps, strict=True) if sign]
    error = float(np.median(off))
    return frame, error, check_matches(matches, _moved(stops, {frame: error}), table)


def _longer_steps(check: StepCheck) -> bool:
    """Whether all steps are off by about one factor, as a power of the curve would have it."""
    nominal = np.array([step.nominal for step in check.steps])
    off = np.array([step.off for step in check.steps])
    factor = float(nominal @ off / (nominal @ nominal))
    rest = float(np.sum((off - factor * nominal) ** 2))
    return len(off) > 1 and rest <= _REST * float(np.sum(off**2))


def _several_wrong(
    matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[Stops, tuple[TagError, ...], StepCheck] | None:
    """Believe only what was measured, if it does not depend on the level.

    The exposures keep the median of what is stated, for the sake of absolute luminance.
    """
    paired = _paired(check)
    if len(paired) < len(stops):
        return None
    design = np.zeros((len(check.steps), len(stops)))
    for row, step in enumerate(check.steps):
        design[row, step.bright], design[row, step.dark] = 1.0, -1.0
    errors = np.linalg.lstsq(design, np.array([step.off for step in check.steps]), rcond=None)[0]
    errors -= np.median(errors)
    by = {frame: float(error) for frame, error in enumerate(errors)}
    better = check_matches(matches, _moved(stops, by), table)
    if not better.agrees:
        return None
    wrong = tuple(
        TagError(frame, error, (frame,)) for frame, error in by.items() if _telling(error)
    )
    return _moved(stops, by), wrong, better
