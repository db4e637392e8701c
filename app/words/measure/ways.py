"""The words of a mirror ball, of photos, films, fisheye circles and of a planned bracket."""

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
        "About {share:.1f} % of what the ball shows looks like dirt, and was filled from its "
        "surroundings.",
        share=100.0 * remark.share,
    )


def _ball_blind(remark: BallBlind) -> str:
    if remark.sides > 1:
        return tr(
            "{share:.1f} % of the sphere, behind the ball, was not seen and is filled from around.",
            share=100.0 * remark.share,
        )
    return tr(
        "{share:.1f} % of the sphere, behind the ball and the photographer, was not seen and "
        "is filled from around. Pictures from a second side show it.",
        share=100.0 * remark.share,
    )


def _circles(remark: CirclesStitched) -> str:
    return tr(
        "The frames are two fisheye circles. They were stitched; the {front} circle is taken as "
        "the front, its {side} as up.",
        front=_SIDES[remark.front],
        side=_SIDES[remark.up_deg],
    )


def _left_out(remark: PhotosLeftOut) -> str:
    return tr("Could not be placed, and left out: {names}.", names=listed(remark.names))


def _gaps(remark: GapsFilled) -> str:
    return tr(
        "No photo shows {share} of all directions, mostly {where}. They were filled.",
        share=percent(remark.share),
        where=_GAPS[remark.where],
    )


def _film_blank(remark: FilmBlank) -> str:
    return tr(
        "The background was blank for {share} % of the film; there an even turn is assumed.",
        share=round(100 * remark.share),
    )


def _shifted(remark: BracketShifted) -> str:
    if remark.middle_ev < 0.0:
        return tr(
            "The place is too dark for the camera: the bracket is shot {stops:.1f} EV darker "
            "than metered.",
            stops=-remark.middle_ev,
        )
    return tr(
        "The place is too bright for the camera: the bracket is shot {stops:.1f} EV brighter "
        "than metered.",
        stops=remark.middle_ev,
    )


SENTENCES: Final[Sentences] = {
    BallDirty: _ball_dirty,
    BallColoured: tr(
        "The ball is coloured: it reflects red, green and blue like {red:.2f} : {green:.2f} : "
        "{blue:.2f}. That was corrected."
    ),
    BallSize: tr(
        "The ball is {width_px} pixels wide: it resolves {resolution_deg:.1f}°, and less toward "
        "its rim."
    ),
    BallSmall: tr("Go nearer or use a longer lens, so that the ball is larger."),
    BallBlind: _ball_blind,
    LensFromBackground: tr("Focal length not in the files; estimated from the background."),
    CirclesStitched: _circles,
    SeamUnsure: tr(
        "Where the circles overlap there is too little to measure the lenses by: directions near "
        "the seam may be off by some degrees. If you can, stitch with the maker's program."
    ),
    OneExposure: tr("One exposure; lamps and windows are clipped, and really are brighter."),
    PhotosLeftOut: _left_out,
    CameraMoved: tr("The camera moved between photos: near things may be doubled."),
    GapsFilled: _gaps,
    FilmPart: tr("The face was seen at {seen_deg}° of the turn; the rest is not seen."),
    FilmStill: tr("The camera stood still. For all turns, let it go around with the sitter."),
    FilmOpen: tr("The film does not come back to where it began: its angles are less certain."),
    FilmBlank: _film_blank,
    FilmRough: tr("The face changed more than light explains: treat this as rough."),
    FrontCamera: tr(
        "A front camera took this film. If text in it reads backwards, switch on Mirrored and "
        "open it again."
    ),
    OffsetMissed: tr(
        "{wanted_ev:+.1f} EV is out of the camera's reach; {nearest_ev:+.1f} EV is the nearest."
    ),
    DarkestExposure: tr(
        "The place is bright: the camera's darkest exposure is {floor_ev:+.1f} EV."
    ),
    WiderSteps: tr(
        "With {frames} frames the dark ones are {step_ev:.1f} EV apart instead of {usual_ev:g}."
    ),
    BracketShifted: _shifted,
}
"""By remark: its sentence with the names of its fields, or what writes it."""


def beside_words(beside: Beside) -> str:
    """Say whether a film and a panorama agree, and what to do where they do not."""
    if beside.typical_deg is None:
        return tr("Film and panorama offer no style in common: trust the film.")
    if beside.agree:
        return tr("Film and panorama agree: their turns are {deg}° apart.", deg=beside.typical_deg)
    return tr(
        "Film and panorama disagree: their turns are {deg}° apart. Trust the film; if the light "
        "has changed, measure again.",
        deg=beside.typical_deg,
    )


def mirror_words(mirrored: bool, fits: bool | None) -> str:
    """Say how a film is read where the place decides otherwise than the setting; "" where not.

    `fits`: whether only its mirror image shows the place; None where neither does.
    """
    if fits is None or fits == mirrored:
        return ""
    if fits:
        return tr("The film is mirrored: only its mirror image fits the place. It is read as that.")
    return tr("The film fits the place as it is. It is not read as mirrored.")
