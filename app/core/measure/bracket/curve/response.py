"""Choose the camera's response curve and detect wrong exposure tags.

The curve is sRGB, as in the paper that this program implements, unless the bracket contradicts it.
The steps between the frames are measured (`brightness_transfer`). If they disagree with the files,
either one frame's tag is wrong, or the camera's curve is not sRGB and is recovered from the bracket
(`app.core.measure.bracket.curve.response_recovery`).

With a known curve, one frame's wrong tag stands out, because it shifts all pairs that include this
frame, and no others, by the same amount at every level. With an unknown curve and the usual three
frames, a wrong tag on one frame with one curve is equivalent to a wrong tag on another frame with a
power of that curve. In this case, the curve closest to sRGB is used, and all frames that may be
wrong are named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal, TypeAlias

import numpy as np

from app.core.base.arrays import Bytes, Float64
from app.core.base.remarks import Remark
from app.core.measure.bracket.curve.brightness_transfer import CodeMatches, match_codes, reach
from app.core.measure.bracket.curve.exposure_steps import StepCheck, check_matches
from app.core.measure.bracket.curve.response_recovery import (
    RecoveredCurve,
    recover_curve,
    recover_own_curves,
    srgb_table,
)
from app.core.measure.bracket.remarks import (
    CurveDoubtful,
    CurveRecovered,
    CurveUnchecked,
    FramesUnfit,
    OwnCurves,
    TwoFramesAlone,
    WrongTag,
)

Mode: TypeAlias = Literal["srgb", "recover", "auto"]

# A recovered curve fits its own bracket to within 0.1 to 1 of the tolerance, or 2 in dark scenes
# with hard curves. With a tag that is wrong by a quarter of a stop, the misfit is 2.4 to 14.
_RECOVERED_FITS: Final = 1.5
_MISFIT: Final = 4.0
# Separate curves for red, green and blue lower the cost by 4 to 25% if there is really one curve
# (since each has more freedom than it needs), by half for film, and by 90% if they clearly differ.
_CHANNELS_DIFFER: Final = 0.6
_CHANNEL_HOLD: Final = 0.1
_MID_TONES: Final = slice(64, 193)
_OWN_FIT: Final = 0.5


@dataclass(frozen=True, slots=True)
class Response:
    """A response curve, given as the linear light of each code.

    Attributes:
        table: (3, 256) float64, or (K, 3, 256) if each frame has its own curve. Linear light of
            each code in red, green and blue, which increases strictly from 0 at code 0 to 1 at code
            255. Channels of scanned film can end at different values, the highest of which is 1.
        residual_stops: `StepCheck.residual_stops` with this curve, or NaN if no frames overlap.
    """

    name: str
    table: Float64 = field(repr=False)
    residual_stops: float = float("nan")


@dataclass(frozen=True, slots=True)
class ResponseChoice:
    """The chosen response curve and the corrected exposures, in stops.

    Attributes:
        stops: Nominal exposures after the correction of wrong tags. They may therefore be out of
            order.
        check: Comparison of the measured and nominal steps under sRGB, before any correction.
        tag_errors: Tag errors of a fifth of a stop or more.
    """

    response: Response
    stops: tuple[float, ...]
    check: StepCheck = field(repr=False)
    tag_errors: tuple[TagError, ...] = ()
    remarks: tuple[Remark, ...] = ()

    def with_tags(self, names: Sequence[str]) -> tuple[Remark, ...]:
        """Return all remarks, given the names of the frames, brightest first."""
        return (*(error.remark(names) for error in self.tag_errors), *self.remarks)


def srgb_response() -> Response:
    """Return the sRGB curve (IEC 61966-2-1)."""
    return Response("sRGB", np.tile(srgb_table(), (3, 1)))


def srgb_choice() -> ResponseChoice:
    """Return the sRGB curve without checking it."""
    return ResponseChoice(srgb_response(), (), StepCheck((), math.nan, 0.0))


def choose_response(samples: Bytes, stops: Sequence[float], mode: Mode = "auto") -> ResponseChoice:
    """Choose the response curve of a bracket and find wrong tags.

    Moving objects and frames that are rotated by a few degrees do no harm. The curve is always sRGB
    if no frames overlap.

    Args:
        samples: (K, N, 3) uint8. Codes at the same positions in all frames, brightest first.
        stops: Nominal exposures in stops, in decreasing order.
        mode: "srgb" for sRGB, with a warning if the steps disagree; "recover" to recover the curve
            from the bracket; or "auto" for sRGB unless noise cannot explain the disagreement.

    Raises:
        ValueError: If the samples, the stops or the mode are invalid.
    """
    if mode not in ("srgb", "recover", "auto"):
        raise ValueError(f'the response is "srgb", "recover" or "auto", not "{mode}"')
    plain_stops = tuple(float(value) for value in stops)
    matches = match_codes(samples, plain_stops, reach(plain_stops))
    check = check_matches(matches, plain_stops, srgb_table())
    plain = ResponseChoice(
        replace(srgb_response(), residual_stops=check.residual_stops), plain_stops, check
    )
    if not check.possible:
        return _unchecked(plain, mode)
    if mode != "recover":
        choice = _with_srgb(plain, matches)
        if choice is not None:
            return choice
        if mode == "srgb":
            return replace(plain, remarks=(_disagreement(check),))
    return _recovered(plain, matches, mode)


def _unchecked(plain: ResponseChoice, mode: Mode) -> ResponseChoice:
    """Report that the frames do not overlap and therefore do not determine the curve."""
    if len(plain.stops) < 2:
        return plain
    return replace(plain, remarks=(CurveUnchecked(recover=mode == "recover"),))


def _with_srgb(plain: ResponseChoice, matches: CodeMatches) -> ResponseChoice | None:
    """Keep sRGB if the steps agree, or if they do once wrong tags are corrected."""
    if plain.check.agrees:
        return plain
    explanation = explain_by_tags(matches, plain.check, plain.stops, srgb_table())
    if explanation is None:
        return None
    stops, errors, check = explanation
    response = replace(plain.response, residual_stops=check.residual_stops)
    return replace(plain, response=response, stops=stops, tag_errors=errors)


def _disagreement(check: StepCheck) -> CurveDoubtful:
    """Report how much the steps disagree with sRGB."""
    order = sorted(check.steps, key=lambda step: abs(step.off) / step.nominal)
    typical = order[len(order) // 2]  # a typical step, since the worst may have another cause
    return CurveDoubtful(typical.measured, typical.nominal)


def _recovered(plain: ResponseChoice, matches: CodeMatches, mode: Mode) -> ResponseChoice:
    """Recover the curve, assuming a wrong tag if the frames fit only then."""
    stops = plain.stops
    curve = recover_curve(matches, stops)
    check = check_matches(matches, stops, curve.table)
    errors: tuple[TagError, ...] = ()
    if check.disagreement > _RECOVERED_FITS and len(stops) > 2:
        tagged = recover_with_tag(matches, stops, curve, check)
        if tagged is not None:
            curve, stops, errors, check = tagged
    table, check = _by_channel(matches, stops, curve, check)
    own = _each_its_own(plain, matches, check)
    if own is not None:
        return own
    if mode == "auto" and not check.disagreement < plain.check.disagreement:
        return replace(plain, remarks=(FramesUnfit(plain.check.residual_stops),))
    residual = check.residual_stops
    remarks: tuple[Remark, ...] = (CurveRecovered(residual),) if mode == "auto" else ()
    if len(stops) == 2:
        remarks = (*remarks, TwoFramesAlone())
    if check.disagreement > _MISFIT:
        remarks = (*remarks, FramesUnfit(residual))
    response = Response("recovered", table, residual)
    return replace(plain, response=response, stops=stops, tag_errors=errors, remarks=remarks)


def _each_its_own(
    plain: ResponseChoice, matches: CodeMatches, check: StepCheck
) -> ResponseChoice | None:
    """Return a separate curve for each frame, or None unless nothing else makes the frames fit."""
    if check.disagreement <= _RECOVERED_FITS or len(plain.stops) < 2:
        return None
    table, stops = recover_own_curves(matches, plain.stops)
    better = check_matches(matches, stops, table)
    if better.disagreement > _OWN_FIT * check.disagreement:
        return None
    response = Response("recovered", table, better.residual_stops)
    return replace(plain, response=response, stops=stops, remarks=(OwnCurves(),))


def _by_channel(
    matches: CodeMatches, stops: Sequence[float], shared: RecoveredCurve, check: StepCheck
) -> tuple[Float64, StepCheck]:
    """Return a curve, (3, 256), for each channel, identical for all channels if one curve fits.

    A bracket does not determine the relative scale of the channels. A sensor clips all channels at
    its white point, and thus at equal linear values. Film does not, so if a raised black reveals a
    scan, equal codes in the mid-tones are assumed to be neutral (Debevec and Malik 1997, 2.2).
    """
    table = np.tile(shared.table, (3, 1))
    parts = [matches.where(matches.channel == channel) for channel in range(3)]
    if check.agrees or min(len(part) for part in parts) == 0:
        return table, check
    curves = [
        recover_curve(part, stops, start=shared.unknowns, hold=_CHANNEL_HOLD) for part in parts
    ]
    if sum(curve.cost for curve in curves) > _CHANNELS_DIFFER * shared.cost:
        return table, check
    table = np.stack([curve.table for curve in curves])
    if matches.raised_black:
        table /= np.exp(np.log(table[:, _MID_TONES]).mean(axis=1, keepdims=True))
        table /= table.max()
    return table, check_matches(matches, stops, table)


Stops: TypeAlias = tuple[float, ...]

# Marked shutter times are rounded (1/15 s is really 1/16 s) by up to 0.12 stops, or 0.2 with noise.
# Smaller differences that are equal at all levels are corrected without a remark.
_WORTH_A_WORD: Final = 0.2
_ALIKE: Final = 1.15
_TRIED: Final = 5
_REST: Final = 0.2
_ON_THE_MARK: Final = 0.03
_USUAL_CONTRAST: Final = 0.3


@dataclass(frozen=True, slots=True)
class TagError:
    """A frame with a wrong exposure tag, and the error of this tag in stops."""

    frame: int
    stops: float
    suspects: tuple[int, ...]

    def remark(self, names: Sequence[str]) -> WrongTag:
        """Return the remark, which includes the names of the frames."""
        others = tuple(names[number] for number in self.suspects if number != self.frame)
        return WrongTag(names[self.frame], self.stops, others)


def explain_by_tags(
    matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[Stops, tuple[TagError, ...], StepCheck] | None:
    """Find the wrong tags that reconcile a known curve, (256,), with the measured steps.

    Returns:
        The corrected exposures, the errors of a fifth of a stop or more, and the check with the
        corrections, or None if wrong tags do not explain the steps and the curve must therefore be
        different.
    """
    trials = [_one_wrong(frame, matches, check, stops, table) for frame in _paired(check)]
    fitting = [trial for trial in trials if trial[2].agrees]
    if fitting:
        # In a bracket of two frames, or without more overlap, either tag may be wrong. The darker
        # frame is chosen, since the scale comes mostly from the brighter, metered one.
        least = min(trial[2].disagreement for trial in fitting)
        alike = [trial for trial in fitting if trial[2].disagreement <= _ALIKE * least + 0.05]
        frame, stops_off, better = alike[-1]
        suspects = tuple(trial[0] for trial in alike)
        errors = (TagError(frame, stops_off, suspects),) if _telling(stops_off) else ()
        return _shift_stops(stops, {frame: stops_off}), errors, better
    if _longer_steps(check):
        return None
    return _several_wrong(matches, check, stops, table)


def recover_with_tag(
    matches: CodeMatches, stops: Stops, curve: RecoveredCurve, check: StepCheck
) -> tuple[RecoveredCurve, Stops, tuple[TagError, ...], StepCheck] | None:
    """Recover a curve and one wrong exposure from three or more frames.

    Returns:
        The curve, the corrected exposures, the error and the resulting check, or None if there is
        no single tag whose correction makes the frames fit much better.
    """
    trials: list[tuple[int, RecoveredCurve, StepCheck]] = []
    for frame in _likeliest(matches, check, stops, curve):
        trial = recover_curve(matches, stops, free_frame=frame)
        better = check_matches(matches, _shift_stops(stops, {frame: trial.tag_stops}), trial.table)
        fits = better.disagreement < 0.5 * check.disagreement and trial.cost < 0.7 * curve.cost
        if fits and _telling(trial.tag_stops):
            trials.append((frame, trial, better))
    if not trials:
        return None
    least = min(trial[1].cost for trial in trials)
    alike = [trial for trial in trials if trial[1].cost <= _ALIKE * least]
    frame, best, better = min(alike, key=lambda trial: _unlikely(trial[1]))
    error = TagError(frame, best.tag_stops, tuple(trial[0] for trial in alike))
    return best, _shift_stops(stops, {frame: best.tag_stops}), (error,), better


def _unlikely(curve: RecoveredCurve) -> float:
    """Return a score, based on judgement, for how unlikely a curve and its tag error are.

    Most curves have roughly the same contrast as sRGB, measured over the brighter half of the nodes
    (codes above 40), where all curves are well determined. Tags are usually wrong by a whole stop
    (doubled or halved by mistake) or by a third of a stop, which is one click of the dial.
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
    """Return the frames that share well-exposed areas with another frame."""
    return sorted({step.bright for step in check.steps} | {step.dark for step in check.steps})


def _likeliest(
    matches: CodeMatches, check: StepCheck, stops: Stops, curve: RecoveredCurve
) -> list[int]:
    """Choose the few frames of a long bracket that may be wrong, to limit the recoveries."""
    frames = _paired(check)
    if len(frames) <= _TRIED:
        return frames
    trials = [_one_wrong(frame, matches, check, stops, curve.table) for frame in frames]
    trials.sort(key=lambda trial: trial[2].disagreement)
    return [trial[0] for trial in trials[:_TRIED]]


def _telling(stops: float) -> bool:
    return abs(stops) >= _WORTH_A_WORD


def _shift_stops(stops: Stops, by: dict[int, float]) -> Stops:
    """Return the exposures, with some of them corrected by frame index."""
    return tuple(value + by.get(frame, 0.0) for frame, value in enumerate(stops))


def _one_wrong(
    frame: int, matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[int, float, StepCheck]:
    """Trust all frames but one, and return that frame, its error in stops and the new check."""
    signs = [(step.bright == frame) - (step.dark == frame) for step in check.steps]
    off = [sign * step.off for sign, step in zip(signs, check.steps, strict=True) if sign]
    error = float(np.median(off))
    return frame, error, check_matches(matches, _shift_stops(stops, {frame: error}), table)


def _longer_steps(check: StepCheck) -> bool:
    """Return whether all steps are off by about the same factor, as with a power of the curve."""
    nominal = np.array([step.nominal for step in check.steps])
    off = np.array([step.off for step in check.steps])
    factor = float(nominal @ off / (nominal @ nominal))
    rest = float(np.sum((off - factor * nominal) ** 2))
    return len(off) > 1 and rest <= _REST * float(np.sum(off**2))


def _several_wrong(
    matches: CodeMatches, check: StepCheck, stops: Stops, table: Float64
) -> tuple[Stops, tuple[TagError, ...], StepCheck] | None:
    """Use only the measured steps, provided that they do not depend on the level.

    The median of the nominal exposures is kept, which preserves absolute luminance.
    """
    if len(_paired(check)) < len(stops):
        return None
    design = np.zeros((len(check.steps), len(stops)))
    for row, step in enumerate(check.steps):
        design[row, step.bright], design[row, step.dark] = 1.0, -1.0
    errors = np.linalg.lstsq(design, np.array([step.off for step in check.steps]), rcond=None)[0]
    errors -= np.median(errors)
    by = {frame: float(error) for frame, error in enumerate(errors)}
    better = check_matches(matches, _shift_stops(stops, by), table)
    if not better.agrees:
        return None
    wrong = tuple(
        TagError(frame, error, (frame,)) for frame, error in by.items() if _telling(error)
    )
    return _shift_stops(stops, by), wrong, better
