"""Checks a photo or a video of the turn against the goal and the place.

Everything here runs in a job.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Final

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.errors import CoreError
from app.core.base.progress import PhraseReport, Token
from app.core.faces.finder import find_faces
from app.core.faces.shot_against_goal import Check, Promise, check_face, graded_by, promise_of_place
from app.core.guidance.guide import Goal
from app.core.localization.features import HeadingIndex, build_index, read_index
from app.core.localization.photo_location import (
    Photo,
    PhotoLocation,
    judge,
    lens_azimuth,
    locate_photo,
    read_photo,
)
from app.core.measure.film.comparison import GLANCES, beside, looks_mirrored
from app.core.measure.film.film import MOST_FRAMES, WIDTH, flipped, read_film
from app.core.measure.film.frames import film_frames
from app.core.places.files.shots import Shot, add_shot, keep_film_frames, read_shots
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight
from app.core.solver.style_result import StyleResult
from app.core.text import tr
from app.ui.presenters.window_model import Model
from app.words.measure.ways import beside_words, mirror_words

_READ: Final = 0.6  # fraction of the progress; copying takes the rest


@dataclass(frozen=True, slots=True, eq=False)
class ShotContext:
    """The data against which a photo is checked, captured when the photo was opened.

    Attributes:
        index: Index of the place's background, or None until it is built.
        front_deg: Panorama azimuth, in degrees, at which the photographer stands at turn 0.
        title: Title of the style, including its lamp.
        lamp: Whether a lamp is added to the light of the place.
        mirrored: Whether to treat a photo as mirrored if its background is inconclusive.
        pack_style: Name of the style in the pack.
    """

    folder: Path
    light: PlaceLight = field(repr=False)
    index: HeadingIndex | None = field(repr=False)
    result: StyleResult = field(repr=False)
    goal: Goal
    front_deg: float
    title: str
    now: datetime
    head: Head = field(repr=False)
    lamp: bool
    mirrored: bool
    pack_style: str = ""


def shot_context(model: Model, index: HeadingIndex | None, now: datetime) -> ShotContext | None:
    """Return the context for checking photos, or None if there is no place or goal."""
    goal, result, plan = model.goal, model.goal_result, model.lamp_plan
    if model.place_folder is None or model.light is None or model.head is None:
        return None
    if goal is None or result is None:
        return None
    own = model.own_style
    title = own.title if own is not None else result.title
    return ShotContext(
        model.place_folder,
        model.light,
        index,
        result,
        goal,
        model.front_deg,
        title if plan is None else tr("{style} with {lamp}", style=title, lamp=plan.lamp),
        now,
        model.head,
        plan is not None,
        model.settings.mirrored,
        model.pack_style or result.name,
    )


def check_photo(path: Path, context: ShotContext, token: Token, report: PhraseReport) -> Shot:
    """Load, locate and check a photo, and save it with the place."""
    report(0.0, tr("Reading the photo"))
    photo = read_photo(path, token)
    location = _located(photo, context, token, lambda done, words: report(_READ * done, words))
    token.check()
    mirrored = location.mirrored if location.status == "found" else context.mirrored
    photo = photo.flipped if mirrored else photo
    shot = _shot_of(path, photo, location, mirrored, context)
    return add_shot(
        context.folder,
        path,
        _judged(shot, _face_check(photo, location, context), context),
        photo.picture,
        token,
        lambda done, words: report(_READ + (1.0 - _READ) * done, words),
    )


def check_film(
    video: Path, context: ShotContext, token: Token, report: PhraseReport
) -> tuple[tuple[str, ...], tuple[Shot, ...]]:
    """Compare a video of the turn with the place, and save the best frames as photos.

    Returns:
        The messages, and all photos taken at the place.
    """
    index = context.index or build_index(context.light.display, token)
    fits = looks_mirrored(film_frames(video, GLANCES, WIDTH), index)
    mirrored = context.mirrored if fits is None else fits

    def frames(most: int) -> Iterator[tuple[float, float, Bytes]]:
        plain = film_frames(video, most, WIDTH)
        return flipped(plain) if mirrored else plain

    film = read_film(frames(MOST_FRAMES), token, report)
    results = film.results(context.head.pack)
    result = beside(film, results, frames(GLANCES), context.light, context.head.pack, index)
    keep_film_frames(context.folder, film, results, context.now, result.offset_deg)
    words = mirror_words(context.mirrored, fits), beside_words(result)
    return tuple(filter(None, words)), read_shots(context.folder)[0]


def _located(
    photo: Photo, context: ShotContext, token: Token, report: PhraseReport
) -> PhotoLocation:
    index = context.index
    if index is None:
        display = context.light.display
        try:
            index = read_index(context.folder, display) or build_index(display, token)
        except CoreError:
            # A bare room has no features to locate.
            return PhotoLocation("unsure")
    return locate_photo(photo, index, token, report)


def _shot_of(
    path: Path, photo: Photo, location: PhotoLocation, mirrored: bool, context: ShotContext
) -> Shot:
    return Shot(
        name=path.name,
        added_at=context.now.isoformat(),
        found=location.status == "found",
        style=context.result.name,
        title=context.title,
        goal_facing_deg=wrap(context.goal.turn_deg + context.front_deg),
        taken_at=None if photo.taken_at is None else photo.taken_at.isoformat(),
        heading_deg=location.heading_deg,
        facing_deg=location.facing_deg,
        sitter_deg=location.sitter_deg,
        fov_deg=location.fov_deg,
        focal_mm=photo.focal_mm,
        confidence=location.confidence,
        mirrored=mirrored,
    )


def _face_check(
    photo: Photo, location: PhotoLocation, context: ShotContext
) -> tuple[Check, Promise] | None:
    """Compare the light on the largest face with the light that the style should produce here."""
    faces = find_faces(photo.picture)
    if not faces or context.lamp:
        return None
    name, (goal, arc) = context.pack_style, context.goal.facing(context.front_deg)
    pack = graded_by(context.head.name, context.head.pack, name)
    promise = promise_of_place(context.light, goal, arc, pack, name, context.head.transport)
    lens = lens_azimuth(location, faces[0], photo.picture.shape[1])
    return check_face(photo.picture, faces[0], promise, photo.focal_px, lens), promise


def _judged(
    shot: Shot, check_and_promise: tuple[Check, Promise] | None, context: ShotContext
) -> Shot:
    """Return the photo with the results for its face and its turn's distance from the light."""
    inside = False
    if check_and_promise is not None:
        check, promise = check_and_promise
        by_face = not shot.found and check.facing_deg is not None
        inside = by_face and check.standing == "inside"
        shot = replace(
            shot,
            found=shot.found or by_face,
            # The sitter faces the direction of the nose plus the yaw of the goal.
            facing_deg=shot.facing_deg
            if check.facing_deg is None
            else wrap(check.facing_deg + context.goal.yaw_deg),
            by_face=by_face,
            grade=check.grade,
            key_deg=check.light.azimuth_deg,
            key_promised_deg=promise.light.azimuth_deg,
            ratio_stops=check.light.ratio_stops,
            ratio_promised_stops=promise.ratio_stops,
        )
    if shot.facing_deg is None:
        return shot
    verdict = judge(wrap(shot.facing_deg - context.front_deg), context.goal, context.result)
    outside = 0 if inside else verdict.outside_deg
    return replace(shot, outside_deg=outside, match=verdict.match, best=verdict.best)
