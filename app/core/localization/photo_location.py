"""Check a photo: read it, locate it, and measure how far it is from the light.

A photo is like a live picture with more pixels and more information: EXIF provides its orientation,
time and field of view. If a photo cannot be located with that field of view, the search is repeated
without it. Such a photo must have been cropped, since nothing makes a picture wider than its lens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal

import cv2

from app.core.base.angles import difference, whole, wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import Progress, Report, Task, Token, silent
from app.core.faces.finder import Face
from app.core.guidance.guide import Goal, Reading, guide
from app.core.localization.features import HeadingIndex
from app.core.localization.heading import (
    FINE,
    UNSURE,
    Heading,
    HeadingMatch,
    Sight,
    compare,
    see,
    to_heading,
)
from app.core.localization.heading_conversion import assumed_fov, offset_angle, turn_of_heading
from app.core.localization.picture_file import RAW_ENDINGS, PictureFile, picture_size, read_picture
from app.core.localization.sitter import Sitter, background_mask, find_sitter
from app.core.solver.peaks import value_at
from app.core.solver.style_result import StyleResult
from app.core.text import tr

Photo = PictureFile
"""An upright photo, reduced to a working size."""

PHOTO_ENDINGS: Final = RAW_ENDINGS | {
    *(".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".heic", ".heif")
}
"""Suffixes of files that may be photos. For HEIC, the error explains how to get a JPEG."""

_LONGEST: Final = 1600  # pixels of the longer side: more add no detail to the background
_SHORTEST: Final = 200
_PANORAMA: Final = 2.0
_PANORAMA_OFF: Final = 0.01
_NO_SITTER: Final = 0.7
_SEARCH: Final = Progress(Task.FINDING_BACKGROUND)
_CROPPED: Final = 0.87  # fraction of the width in EXIF, as tangents: less cannot be due to rounding
_WIDER: Final = 1.15
# required confidence: with the sitter, with a sitter ignored, without one
_PROOF: Final = (0.8, 0.88, 0.96)
_FREE_PROOF: Final = (0.92, 0.97, 0.96)  # an unknown lens can stand in for a sideways offset
_SAME_DEG: Final = 1.0
# the same for two results that agree: for the less certain and the more certain result
_SAME_PROOF: Final = (0.45, 0.65)
_FREE_SAME_PROOF: Final = (0.9, 0.9)
_OTHER_PROOF: Final = 0.97  # the stated lens was already tried, and nothing makes a picture wider
_ALIKE: Final = (0.8, 1.0)  # fraction of the points: at the probe's own position, and elsewhere
_AGREE: Final = 25  # points: a mirror image never has this many
_NEARER: Final = 0.97  # objects never look smaller from the probe, so the lens must be narrower


@dataclass(frozen=True, slots=True)
class PhotoLocation:
    """The direction in which a photo was taken.

    Attributes:
        heading_deg: Panorama azimuth of the camera's axis, in degrees, or None if unsure.
        facing_deg: Panorama azimuth that the sitter faced, in degrees, or None if unsure. The turn
            is this azimuth minus the photographer's azimuth at turn 0.
        sitter_deg: Angle of the sitter from the axis, in degrees, positive to the right, or None if
            no sitter was detected, in which case a sitter in the centre is assumed.
        fov_deg: Horizontal field of view, in degrees, either recorded or estimated, or None if
            unsure.
        confidence: Confidence in the result, 0 to 1.
        mirrored: Whether only the photo's mirror image shows this place. If so, the angles are
            those of the mirror image.
    """

    status: Literal["found", "unsure"]
    heading_deg: float | None = None
    facing_deg: float | None = None
    sitter_deg: float | None = None
    fov_deg: float | None = None
    confidence: float = 0.0
    mirrored: bool = False


@dataclass(frozen=True, slots=True)
class PhotoSearch:
    """The result of searching for a photo in a panorama.

    Attributes:
        sitter: The sitter used in finding the heading, in the unmirrored frame, or None if the
            heading was found without a sitter.
        stated_deg: Field of view recorded in EXIF, in degrees, if it cannot be right, otherwise
            None.
    """

    heading: Heading
    sitter: Sitter | None = None
    mirrored: bool = False
    stated_deg: float | None = None


@dataclass(frozen=True, slots=True)
class ShotVerdict:
    """How far a photo is from the light, as shown on screen.

    Attributes:
        turn_deg, goal_deg: Turns of the photo and of the goal, in whole degrees.
        to_go_deg: Goal minus turn in the shorter direction, in degrees, positive clockwise.
        outside_deg: Distance to the arc in whole degrees, or 0 inside the arc.
        match, best: Match at this turn and at the best turn, 0 to 100.
    """

    turn_deg: int
    goal_deg: int
    to_go_deg: int
    outside_deg: int
    match: int
    best: int


def is_panorama(path: Path) -> bool:
    """Return whether a file has the proportions of a whole panorama, without decoding its pixels.

    Raises:
        CoreError: If the file cannot be read.
    """
    columns, rows = picture_size(path)
    return abs(columns / rows - _PANORAMA) <= _PANORAMA_OFF * _PANORAMA


def read_photo(path: Path, token: Token | None = None) -> Photo:
    """Read a photo, reduced to at most 1,600 pixels on its longer side.

    Raises:
        CoreError: If the file is missing, damaged, not a photo, or too large.
        Cancelled: If the token is cancelled.
    """
    photo = read_picture(path, _LONGEST, token)
    if min(photo.size) < _SHORTEST:
        raise CoreError(
            tr(
                "{name} is only {columns} x {rows} pixels.",
                name=path.name,
                columns=photo.size[0],
                rows=photo.size[1],
            ),
            tr("Open the original photo, not its thumbnail."),
        )
    return photo


def locate_photo(
    photo: Photo, index: HeadingIndex, token: Token | None = None, report: Report = silent
) -> PhotoLocation:
    """Find the direction in which a photo was taken, and the sitter's angle in it.

    Raises:
        Cancelled: If the token is cancelled.
    """
    search = search_photo(photo, index, token=token, report=report)
    heading = search.heading
    if heading.heading_deg is None:
        return PhotoLocation("unsure", confidence=heading.confidence)
    angle = _angle(search.sitter, heading.fov_deg)
    facing = turn_of_heading(heading.heading_deg, sitter_deg=angle or 0.0)
    # An undetected sitter may be anywhere in the picture.
    confidence = heading.confidence * (_NO_SITTER if angle is None else 1.0)
    return PhotoLocation(
        "found", heading.heading_deg, facing, angle, heading.fov_deg, confidence, search.mirrored
    )


def lens_azimuth(location: PhotoLocation, face: Face, columns: int) -> float | None:
    """Return the panorama azimuth of the lens as seen from a face, or None if it is unknown.

    Args:
        columns: Width of the picture that contains the face.
    """
    if location.heading_deg is None or location.fov_deg is None:
        return None
    left, _, right, _ = face.box
    aside = offset_angle((left + right) / 2, columns, location.fov_deg)
    return turn_of_heading(location.heading_deg, sitter_deg=aside)


def search_photo(
    photo: Photo,
    index: HeadingIndex,
    fov_deg: float | None = None,
    token: Token | None = None,
    report: Report = silent,
    *,
    mirrored: bool | None = None,
) -> PhotoSearch:
    """Search for a photo in the panorama, first with all of its metadata and then with less.

    Args:
        fov_deg: Horizontal field of view, in degrees, if the user entered it. A field of view from
            EXIF is only tried first, because the photo may have been cropped.
        mirrored: Whether the photo is a mirror image, or None to try both.

    Raises:
        Cancelled: If the token is cancelled.
    """
    token = token or Token()
    search = _Trials(photo.fov_deg if fov_deg is None else None)
    first = fov_deg or photo.fov_deg
    for flip in (False, True) if mirrored is None else (mirrored,):
        if search.agree >= _AGREE:
            break  # perhaps from elsewhere, but not mirrored
        search.with_sitter = None
        picture = photo.flipped.picture if flip else photo.picture
        report(0.5 * flip, _SEARCH)
        token.check()
        assumed_deg = assumed_fov((picture.shape[1], picture.shape[0]))
        sitter = _sitter_in(picture, first or assumed_deg)
        tries = [(first, sitter), (first, None), (fov_deg, sitter), (fov_deg, None)]
        sights: dict[Sitter | None, Sight] = {}
        for number, (width, who) in enumerate(dict.fromkeys(tries)):
            token.check()
            report(0.5 * flip + 0.1 * (number + 1), _SEARCH)
            if who not in sights:
                mask = None if who is None else background_mask(who, picture.shape[:2])
                sights[who] = see(picture, mask, FINE)
            match = _heading_match(sights[who], index, width, _angle(who, width or assumed_deg))
            if match is not None and search.ends(match, width, who, flip):
                return _as_stored(search.best)
        if search.spare is not None:
            return _as_stored(search.spare)
    return search.best


@dataclass(slots=True)
class _Trials:
    """The results so far for a photo, with or without a field of view recorded in EXIF."""

    stated_deg: float | None
    best: PhotoSearch = field(default_factory=lambda: PhotoSearch(UNSURE))
    spare: PhotoSearch | None = None
    agree: int = 0  # largest number of agreeing points
    most: float = 0.0  # the same for a camera with the stated lens in any position
    with_sitter: Heading | None = None  # the result that uses the person in the picture

    def ends(
        self, match: HeadingMatch, width: float | None, sitter: Sitter | None, mirrored: bool
    ) -> bool:
        """Add a result, and return whether it is the last one."""
        search = PhotoSearch(self._judge(match, width, sitter), sitter, mirrored)
        evidence = match.evidence
        if self.stated_deg is not None and width is None:
            least = _ALIKE[evidence.loose_deg > 0.0] * self.most
            search = _with_agreement(search, self.stated_deg, evidence.agree >= least)
        elif width is not None:
            self.most = max(self.most, evidence.agree + evidence.gain)
        heading = search.heading
        if heading.status == "found":
            if self.stated_deg is None or width is None or heading.zoom >= _NEARER:
                self.best = search
                return True
            self.spare = self.spare or search
            return False
        self.agree = max(self.agree, heading.inliers)
        if (heading.confidence, heading.inliers) > (
            self.best.heading.confidence, self.best.heading.inliers
        ):  # fmt: skip
            self.best = PhotoSearch(heading)
        return False

    def _judge(self, match: HeadingMatch, width: float | None, sitter: Sitter | None) -> Heading:
        """Require more confidence if a person is ignored, and less if two results agree."""
        alone, with_sitter = to_heading(match, 0.0), self.with_sitter
        case = 0 if sitter is not None else 1 if with_sitter is not None else 2
        if sitter is not None:
            self.with_sitter = alone
        proof, same = (_PROOF, _SAME_PROOF) if width else (_FREE_PROOF, _FREE_SAME_PROOF)
        if with_sitter is not None and _alike(with_sitter, alone):
            less, more = sorted((with_sitter.confidence, alone.confidence))
            if less >= same[0] and more >= same[1]:
                return to_heading(match, confidence=1.0 - (1.0 - less) * (1.0 - more))
        return to_heading(match, proof[case])


def _alike(one: Heading, other: Heading) -> bool:
    if one.heading_deg is None or other.heading_deg is None:
        return False
    return abs(difference(one.heading_deg, other.heading_deg)) <= _SAME_DEG


def _with_agreement(search: PhotoSearch, stated_deg: float, is_explained: bool) -> PhotoSearch:
    """Compare an estimated field of view with the one recorded in EXIF.

    The recorded field of view has already been tried. A different result therefore needs more
    confidence, and no camera with the recorded lens, at any position, may explain the picture
    better.
    """
    heading = search.heading
    if heading.heading_deg is None:
        return search
    half, stated_half = (math.tan(math.radians(d) / 2.0) for d in (heading.fov_deg, stated_deg))
    cropped, wider = half < _CROPPED * stated_half, half > _WIDER * stated_half
    if not is_explained or (not cropped and heading.confidence < _OTHER_PROOF):
        return replace(search, heading=_refusal(heading))
    if cropped or wider:
        return replace(search, stated_deg=stated_deg)
    return replace(search, heading=replace(heading, fov_deg=stated_deg))


def _refusal(heading: Heading) -> Heading:
    return replace(UNSURE, inliers=heading.inliers, confidence=heading.confidence)


def _as_stored(search: PhotoSearch) -> PhotoSearch:
    """Return the search result with the roll angle of the unmirrored photo."""
    if not search.mirrored:
        return search
    heading = search.heading
    return replace(search, heading=replace(heading, roll_deg=-heading.roll_deg))


def _sitter_in(picture: Bytes, fov_deg: float) -> Sitter | None:
    try:
        return find_sitter(picture, fov_deg, keen=True)
    except CoreError:
        # Without the network no sitter is found, but the background still is.
        return None


def _heading_match(
    sight: Sight, index: HeadingIndex, fov_deg: float | None, sitter_deg: float | None
) -> HeadingMatch | None:
    try:
        return compare(sight, index, fov_deg, sitter_deg=sitter_deg)
    except cv2.error:
        # A picture that OpenCV cannot process has no heading.
        return None


def _angle(sitter: Sitter | None, fov_deg: float) -> float | None:
    return None if sitter is None else offset_angle(sitter.column, 1, fov_deg)


def judge(turn_deg: float, goal: Goal, result: StyleResult) -> ShotVerdict:
    """Return how far a turn is from the light.

    Args:
        turn_deg: Turn of the photo, in degrees.
    """
    guidance, _ = guide(goal, Reading(turn_deg, 0.0))
    turn = whole(turn_deg)
    here = value_at(result.match_curve, float(turn))
    if turn == whole(result.turn_refined_deg):
        here = result.match
    elif float(result.match_curve.max()) <= result.match + 1e-6:
        # Between the turns of the grid, the curve may rise slightly above its best.
        here = min(here, result.match)
    return ShotVerdict(
        turn_deg=turn,
        goal_deg=guidance.goal,
        to_go_deg=int(wrap(guidance.goal - turn)),
        outside_deg=guidance.until_light or 0,
        match=max(math.floor(here), 0),
        best=max(math.floor(result.match), 0),
    )
