"""Sentences about mirror balls, photos, films, fisheye circles and planned brackets."""

from __future__ import annotations

from typing import Final

from app.core.base.phrases import listed, percent
from app.core.measure.ball.remarks import (
    BallBlind,
    BallColoured,
    BallDirty,
    BallSize,
    BallSmall,
    LensFromBackground,
)
from app.core.measure.film.comparison import Beside
from app.core.measure.film.remarks import (
    FilmBlank,
    FilmOpen,
    FilmPart,
    FilmRough,
    FilmStill,
    FrontCamera,
)
from app.core.measure.fisheye.remarks import CirclesStitched, SeamUnsure
from app.core.measure.photos.remarks import CameraMoved, GapsFilled, OneExposure, PhotosLeftOut
from app.core.measure.plan.remarks import (
    BracketShifted,
    DarkestExposure,
    OffsetMissed,
    WiderSteps,
)
from app.core.text import tr
from app.words.sentences import Sentences

_SIDES: Final[dict[float | str, str]] = {
    "left": tr("left"),
    "right": tr("right"),
    "upper": tr("upper"),
    "lower": tr("lower"),
    0.0: tr("top"),
    90.0: tr("right"),
    180.0: tr("bottom"),
    270.0: tr("left"),
}
_GAPS: Final = {"overhead": tr("overhead"), "below": tr("below"), "sides": tr("to the sides")}


def _ball_dirty(remark: BallDirty) -> str:
    return tr(
        "About {share:.1f}% of the ball looks dirty and was filled from its surroundings.",
        share=100.0 * remark.share,
    )


def _ball_blind(remark: BallBlind) -> str:
    if remark.sides > 1:
        return tr(
            "{share:.1f}% of the sphere is hidden behind the ball and was filled from "
            "its surroundings.",
            share=100.0 * remark.share,
        )
    return tr(
        "{share:.1f}% of the sphere is hidden behind the ball and the photographer and "
        "was filled from its surroundings. Photos from a second side would show it.",
        share=100.0 * remark.share,
    )


def _circles(remark: CirclesStitched) -> str:
    return tr(
        "The frames are two fisheye circles and were stitched, with the {front} circle "
        "as the front and its {side} side up.",
        front=_SIDES[remark.front],
        side=_SIDES[remark.up_deg],
    )


def _left_out(remark: PhotosLeftOut) -> str:
    return tr("Left out because no position was found: {names}.", names=listed(remark.names))


def _gaps(remark: GapsFilled) -> str:
    return tr(
        "No photo covers {share} of the panorama, mostly {where}. It was filled from its "
        "surroundings.",
        share=percent(remark.share),
        where=_GAPS[remark.where],
    )


def _film_blank(remark: FilmBlank) -> str:
    return tr(
        "The background was blank for {share}% of the film. A steady turn is assumed there.",
        share=round(100 * remark.share),
    )


def _shifted(remark: BracketShifted) -> str:
    if remark.middle_ev < 0.0:
        return tr(
            "The place is too dark for the camera. The bracket is shot {stops:.1f} EV "
            "darker than metered.",
            stops=-remark.middle_ev,
        )
    return tr(
        "The place is too bright for the camera. The bracket is shot {stops:.1f} EV "
        "brighter than metered.",
        stops=remark.middle_ev,
    )


SENTENCES: Final[Sentences] = {
    BallDirty: _ball_dirty,
    BallColoured: tr(
        "The ball is tinted: it reflects red, green and blue as {red:.2f} : {green:.2f} "
        ": {blue:.2f}. The tint was corrected."
    ),
    BallSize: tr(
        "The ball is {width_px} pixels wide, which resolves {resolution_deg:.1f}°, with less "
        "detail towards its rim."
    ),
    BallSmall: tr("Move closer or use a longer lens, so that the ball is larger."),
    BallBlind: _ball_blind,
    LensFromBackground: tr(
        "The files do not record the focal length. It was estimated from the background."
    ),
    CirclesStitched: _circles,
    SeamUnsure: tr(
        "The lenses could not be calibrated where the circles overlap, so directions "
        "near the seam may be off by a few degrees. If you can, stitch with the camera "
        "maker’s software."
    ),
    OneExposure: tr("Only one exposure: lamps and windows are clipped and brighter in reality."),
    PhotosLeftOut: _left_out,
    CameraMoved: tr("The camera moved between photos. Nearby objects may appear twice."),
    GapsFilled: _gaps,
    FilmPart: tr("The face is visible over only {seen_deg}° of the turn."),
    FilmStill: tr("The camera stood still. Walk around with the sitter to cover all turns."),
    FilmOpen: tr("The film does not end where it began, so its angles are less certain."),
    FilmBlank: _film_blank,
    FilmRough: tr("The face changed more than light can explain. Treat the result as rough."),
    FrontCamera: tr(
        "This film was taken with a front camera. If text in it is backwards, turn on "
        "Mirrored and open the film again."
    ),
    OffsetMissed: tr(
        "The camera cannot reach {wanted_ev:+.1f} EV; the nearest is {nearest_ev:+.1f} EV."
    ),
    DarkestExposure: tr(
        "The place is bright: the camera’s darkest exposure is {floor_ev:+.1f} EV."
    ),
    WiderSteps: tr(
        "With {frames} frames, the dark ones are {step_ev:.1f} EV apart instead of {usual_ev:g}."
    ),
    BracketShifted: _shifted,
}
"""Sentence for each type of remark: text with field names, or a function that returns it."""


def beside_words(beside: Beside) -> str:
    """Describe whether a film and a panorama agree, and what to do if they do not."""
    if beside.typical_deg is None:
        return tr("Film and panorama have no style in common. Trust the film.")
    if beside.agree:
        return tr("Film and panorama agree to within {deg}°.", deg=beside.typical_deg)
    return tr(
        "Film and panorama differ by {deg}°. Trust the film, or measure again if the "
        "light has changed.",
        deg=beside.typical_deg,
    )


def mirror_words(mirrored: bool, fits: bool | None) -> str:
    """Report whether a film was flipped if that contradicts the setting, or return "" otherwise.

    Args:
        mirrored: Whether the setting says that the film is mirrored.
        fits: True if only the mirror image of the film matches the place, False if only the film as
            recorded does, or None if that cannot be determined.
    """
    if fits is None or fits == mirrored:
        return ""
    if fits:
        return tr("The film is mirrored: only its mirror image fits the place. It was flipped.")
    return tr("The film fits the place as it is. It was not flipped.")
