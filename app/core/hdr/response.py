"""The camera's tone curve, and exposure tags that do not hold: what to undo before merging.

The curve is sRGB (as in the paper that this program implements) unless the bracket says
otherwise: the steps between the frames are measured (`app.core.hdr.steps`), and where they
disagree with the files either one frame's tag is wrong, or the camera's curve is not sRGB and is
recovered from the bracket (`app.core.hdr.response_recovery`).

With a known curve one frame's wrong tag stands out in its pairs. With an unknown curve and the
usual three frames, a wrong tag of one frame and another curve together can always be traded
for a wrong tag of another frame and a power of that curve; then the curve nearest to sRGB is
taken and all frames that could be wrong are named.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

from app.core.hdr.brightness_transfer import match_codes
from app.core.hdr.own_curves import recover_own_curves
from app.core.hdr.response_recovery import recover_curve, srgb_table
from app.core.hdr.steps import StepCheck, check_matches, check_steps, reach
from app.core.hdr.tags import TagError, explain_by_tags, recover_with_tag

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from app.core.base.arrays import Bytes, Float64
    from app.core.hdr.brightness_transfer import CodeMatches
    from app.core.hdr.response_recovery import Recovered

__all__ = [
    "Mode",
    "Response",
    "ResponseChoice",
    "StepCheck",
    "TagError",
    "check_steps",
    "choose_response",
    "srgb_response",
]

Mode: TypeAlias = Literal["srgb", "recover", "auto"]

# A recovered curve fits its own bracket to 0.1 to 1 of the tolerance, to 2 in dark scenes with
# hard curves; with a tag that lies by a quarter of a stop the misfit is 2.4 to 14.
_RECOVERED_FITS: Final = 1.5
_MISFIT: Final = 4.0
# Separate curves for red, green and blue lower the cost by 4 to 25 % where there is one curve
# (each has more freedom than it needs), by half for film and by 90 % where they plainly differ.
_CHANNELS_DIFFER: Final = 0.6
_CHANNEL_HOLD: Final = 0.1
_MID_TONES: Final = slice(64, 193)
_OWN_FIT: Final = 0.5
_OWN: Final = (
    "The camera gave each frame a tone curve of its own, as phones do. They were recovered from "
    "the bracket; bright and dark places are less exact than from a camera with one curve."
)
_TWO_FRAMES: Final = (
    "Two frames cannot tell another tone curve from a wrong exposure tag; "
    "the tags are believed. A third frame would tell."
)


@dataclass(frozen=True, slots=True)
class Response:
    """How the codes of a file turn into linear light.

    `table`, (3, 256) float64, is the linear light of each code in red, green and blue: strictly
    rising, 0 -> 0, 255 -> 1. Channels of scanned film can end at different values, the highest
    at 1. It is (K, 3, 256) where each frame has a curve of its own. `residual_stops` is
    `StepCheck.residual_stops` with this curve; NaN where no frames overlap.
    """

    name: str
    table: Float64 = field(repr=False)
    residual_stops: float = float("nan")
    note: str = ""

    def at(self, coded: ArrayLike) -> Float64:
        """Linear light, float64 in 0..1, of coded values (..., 3) in 0..1 of any depth.

        Interpolated linearly between the 256 codes; what lies outside is clipped.
        ValueError when the last axis is not 3 long.
        """
        values = np.asarray(coded, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != 3:
            raise ValueError(f"coded values need three channels, not {values.shape}")
        codes = np.arange(256) / 255.0
        channels = [np.interp(values[..., c], codes, self.table[c]) for c in range(3)]
        return np.stack(channels, axis=-1)

    def slope(self) -> Float64:
        """Change of the linear light with one code, (3, 256) float64, by central differences."""
        return np.asarray(np.gradient(self.table, axis=1), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class ResponseChoice:
    """The curve to merge with, and the exposures to believe, in stops.

    As stated, except where a tag was found wrong: then they need not fall. `check` is of
    measured against stated steps, before any correction, with sRGB. `tag_errors` are of a fifth
    of a stop or more.
    """

    response: Response
    stops: tuple[float, ...]
    check: StepCheck = field(repr=False)
    tag_errors: tuple[TagError, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """All sentences for the user; frames are counted from the brightest."""
        return self.sentences([f"frame {number + 1}" for number in range(len(self.stops))])

    def sentences(self, names: Sequence[str]) -> tuple[str, ...]:
        """All sentences for the user, naming the frames."""
        return (*(error.sentence(names) for error in self.tag_errors), *self.remarks)


def srgb_response() -> Response:
    """Return the sRGB curve (IEC 61966-2-1)."""
    return Response("sRGB", np.tile(srgb_table(), (3, 1)))


def choose_response(samples: Bytes, stops: Sequence[float], mode: Mode = "auto") -> ResponseChoice:
    """Choose the curve to merge a bracket with, and find tags that are wrong.

    `samples`, (K, N, 3) uint8, are the same places in all frames, brightest first, and `stops`
    the stated exposures, falling. Things that moved and frames that are turned by a few degrees
    are borne. "srgb" is sRGB, with a warning when the steps disagree; "recover" is recovered
    from the bracket; "auto" is sRGB unless noise cannot explain how the steps disagree. Always
    sRGB where frames do not overlap. ValueError for samples, stops or modes that do not fit.
    """
    if mode not in ("srgb", "recover", "auto"):
        raise ValueError(f'the response is "srgb", "recover" or "auto", not "{mode}"')
    stated = tuple(float(value) for value in stops)
    matches = match_codes(samples, stated, reach(stated))
    check = check_matches(matches, stated, srgb_table())
    plain = ResponseChoice(
        replace(srgb_response(), residual_stops=check.residual_stops), stated, check
    )
    if not check.possible:
        return _unchecked(plain, mode)
    if mode != "recover":
        found = _with_srgb(plain, matches)
        if found is not None:
            return found
        if mode == "srgb":
            return replace(plain, remarks=(_disagreement(check),))
    return _recovered(plain, matches, mode)


def _unchecked(plain: ResponseChoice, mode: Mode) -> ResponseChoice:
    """Say that frames without overlap tell nothing about the curve."""
    note = "No two frames show the same place well exposed, so that the tone curve is taken as sRGB"
    remarks: tuple[str, ...] = ()
    if len(plain.stops) > 1:
        wish = "recovered" if mode == "recover" else "checked"
        remarks = (f"{note}; it could not be {wish}.",)
    return replace(plain, response=replace(plain.response, note=f"{note}."), remarks=remarks)


def _with_srgb(plain: ResponseChoice, matches: CodeMatches) -> ResponseChoice | None:
    """Keep sRGB where the steps agree, or agree once wrong tags are put right."""
    if plain.check.agrees:
        return plain
    found = explain_by_tags(matches, plain.check, plain.stops, srgb_table())
    if found is None:
        return None
    stops, errors, check = found
    response = replace(plain.response, residual_stops=check.residual_stops)
    return replace(plain, response=response, stops=stops, tag_errors=errors)


def _disagreement(check: StepCheck) -> str:
    """Say by how much the steps disagree with sRGB."""
    order = sorted(check.steps, key=lambda step: abs(step.off) / step.nominal)
    typical = order[len(order) // 2]  # a typical one; the worst may be worst for another reason
    return (
        f"The frames are {typical.measured:.2f} stops apart where the files say "
        f"{typical.nominal:.2f}: the camera's tone curve is probably not sRGB. "
        "Let it be recovered from the bracket."
    )


def _recovered(plain: ResponseChoice, matches: CodeMatches, mode: Mode) -> ResponseChoice:
    """Recover the curve, along with a wrong tag where only that makes the frames fit."""
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
        return replace(plain, remarks=(_hopeless(plain.check.residual_stops),))
    residual = check.residual_stops
    remark = (
        f"The camera's tone curve is not sRGB; recovered from the bracket, "
        f"residual {residual:.2f} stops."
    )
    remarks = (remark,) if mode == "auto" else ()
    if len(stops) == 2:
        remarks = (*remarks, _TWO_FRAMES)
    if check.disagreement > _MISFIT:
        remarks = (*remarks, _hopeless(residual))
    note = f"The tone curve was recovered from the bracket, residual {residual:.2f} stops."
    response = Response("recovered", table, residual, note)
    return replace(plain, response=response, stops=stops, tag_errors=errors, remarks=remarks)


def _each_its_own(
    plain: ResponseChoice, matches: CodeMatches, check: StepCheck
) -> ResponseChoice | None:
    """Give each frame its own curve where only that makes the frames fit."""
    if check.disagreement <= _RECOVERED_FITS or len(plain.stops) < 2:
        return None
    table, stops = recover_own_curves(matches, plain.stops)
    better = check_matches(matches, stops, table)
    if better.disagreement > _OWN_FIT * check.disagreement:
        return None
    residual = better.residual_stops
    response = Response("recovered", table, residual, f"{_OWN} Residual {residual:.2f} stops.")
    return replace(plain, response=response, stops=stops, remarks=(_OWN,))


def _hopeless(residual: float) -> str:
    """Say that no curve and no single wrong tag explains the frames."""
    return (
        f"The frames do not fit each other ({residual:.2f} stops off): the light changed between "
        "them, or more than one exposure is not as stated."
    )


def _by_channel(
    matches: CodeMatches, stops: Sequence[float], shared: Recovered, check: StepCheck
) -> tuple[Float64, StepCheck]:
    """Give each channel its own curve where one for all does not do; (3, 256).

    A bracket cannot tell how large the channels are against each other. A sensor clips all
    channels at its white, hence at equal linear values. Film does not: where a raised black
    gives a scan away, equal codes in the mid-tones are neutral (Debevec and Malik 1997, 2.2).
    """
    table = np.tile(shared.table, (3, 1))
    parts = [matches.of_channel(channel) for channel in range(3)]
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
