"""``turnlight photo``: find the faces in a photo and analyse the light on them."""

from __future__ import annotations

import argparse
import contextlib
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.shared.arguments import add_json, argument
from app.commands.shared.printing import answer, say, short
from app.core.base.errors import CoreError
from app.core.faces.finder import Face, find_faces
from app.core.faces.light_from_face import FaceLight, read_light
from app.core.faces.shot_against_goal import (
    Check,
    Promise,
    check_face,
    promise_of_place,
)
from app.core.localization.features import build_index
from app.core.localization.photo_location import (
    Photo,
    PhotoLocation,
    lens_azimuth,
    locate_photo,
    read_photo,
)
from app.core.places.place_folder import light_at
from app.core.solver.solve import proposal, solve_all
from app.core.styles.style import Style
from app.core.styles.style_pack_file import load_named_pack
from app.core.styles.styles import select
from app.core.text import tr
from app.words.phrases.directions import SHORT_SIDES, face_direction_words, key_words, ratio_words
from app.words.phrases.quantities import stops_words
from app.words.phrases.turns import turn_words
from app.words.portrait.face_reading import UNREAD
from app.words.why_out_of_reach import grade_words

FRONT_CAMERA: Final = tr(
    "This photo was taken with a front camera. If text in it is backwards, add --mirrored."
)
"""Note shown for a photo whose left and right may be swapped."""

_LIKEST: Final = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``photo``."""
    parser.description = tr(
        "Read the light on each face in a photo: the position of the key light, the "
        "ratio between the cheeks and the style. With a place, also shows how far to turn. "
        "The photo stays on this computer and is not saved."
    )
    add = partial(argument, parser)
    add("picture PICTURE", tr("a JPEG, PNG, TIFF, WebP or raw file"), type=Path)
    add("--place PLACE", tr("a place or a panorama of the same spot"), type=Path)
    add("--style NAME", tr("the style you wanted (default: the best one for the place)"))
    add(
        "--mirrored",
        tr(
            "the photo is mirrored, which is how some phones save selfies (default: decided by "
            "comparing it with the place)"
        ),
        action="store_true",
    )
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Find the faces and print the light on each. A photo without a face is not an error."""
    photo = read_photo(args.picture)
    promise = _promise(args.place, args.style)
    location = _locate(photo, promise)
    # The place is a more reliable witness than the person who took the photo.
    flip = location.mirrored if location.status == "found" else bool(args.mirrored)
    _tell_mirrored(photo, location, by_option=args.mirrored)
    photo = photo.flipped if flip else photo
    width, focal = photo.picture.shape[1], photo.focal_px
    scale = photo.size[0] / width
    facts, lines = [], []
    for number, face in enumerate(find_faces(photo.picture)):
        if promise is None:
            check = Check(read_light(photo.picture, face, focal))
        else:
            lens_deg = lens_azimuth(location, face, width)
            check = check_face(photo.picture, face, promise, focal, lens_deg)
        facts.append(_facts(_mirror_face(face, width) if flip else face, check, promise, scale))
        facts[-1]["flash"] = photo.flash and check.light.at_lens
        lines.append(_line(number + 1, check, promise, flash=facts[-1]["flash"]))
    words = "\n".join(lines) or tr("No face in this photo can be read.")
    is_certain = location.status == "found" or args.mirrored
    return answer(args, {"faces": facts, "mirrored": flip if is_certain else None}, words)


def _tell_mirrored(photo: Photo, location: PhotoLocation, *, by_option: bool) -> None:
    """Report whether the photo was flipped, but only if that contradicts the user's option."""
    if location.status != "found":
        if photo.front_camera and not by_option:
            say(FRONT_CAMERA)
    elif location.mirrored and not by_option:
        say(tr("The photo is mirrored: only its mirror image fits the place. It was flipped."))
    elif by_option and not location.mirrored:
        say(tr("The photo fits the place as it is. It was not flipped."))


def _mirror_face(face: Face, width: int) -> Face:
    """Map a face detected in the mirrored photo back to the pixels of the original file."""
    marks = face.landmarks.copy()
    marks[:, 0] = width - marks[:, 0]
    return Face(marks, face.confidence)


def _promise(where: Path | None, name: str | None) -> Promise | None:
    """Return the light promised by a place or by the studio.

    Raises:
        CoreError: If the place or the style is unknown.
    """
    pack = load_named_pack("generic")
    names = [] if name is None else [style.name for style in select(pack.styles, [name])]
    if where is None:
        return Promise(pack, names[0]) if names else None
    place = light_at(where)
    results = solve_all(pack, place.searched, styles=names or None)
    best = proposal(results)
    best_result = next(result for result in results if result.name == best)
    arc = best_result.arc_deg if best_result.attainable else None
    return promise_of_place(place, best_result.turn_refined_deg, arc, pack, best_result.name)


def _locate(photo: Photo, promise: Promise | None) -> PhotoLocation:
    """Locate a photo by its background, if the background is distinctive enough."""
    if promise is not None and promise.place is not None:
        # A featureless room yields no match.
        with contextlib.suppress(CoreError):
            return locate_photo(photo, build_index(promise.place.display))
    return PhotoLocation("unsure")


def _facts(face: Face, check: Check, promise: Promise | None, scale: float) -> dict[str, Any]:
    """Return a face's JSON entries, with its box in pixel coordinates of the original file."""
    light = check.light
    numbers = {
        "yaw_deg": light.pose.yaw_deg,
        "pitch_deg": light.pose.pitch_deg,
        "key_azimuth_deg": light.azimuth_deg,
        "key_elevation_deg": light.elevation_deg,
        "key_error_deg": light.error_deg,
        "softness_deg": light.softness_deg,
        "ratio_stops": light.ratio_stops,
        "turn_deg": check.facing_deg,
        "turn_error_deg": check.turn_error_deg,
        "key_difference_deg": check.key_difference_deg,
        "ratio_promised_stops": None if promise is None else promise.ratio_stops,
        "match": check.match,
    }
    return {
        "box": [round(edge * scale) for edge in face.box],
        "confidence": short(face.confidence),
        **{name: None if value is None else round(value, 2) for name, value in numbers.items()},
        "key": light.key,
        "styles": [{"name": name, "score": short(score)} for name, score in light.styles],
        "style": None if promise is None else promise.name,
        "in_the_light": {"inside": True, "outside": False}.get(check.standing),
        "grade": check.grade,
        "status": "unsure" if light.key is None else "read",
        "reason": None if light.reason is None else UNREAD[light.reason],
    }


def _line(number: int, check: Check, promise: Promise | None, *, flash: bool | None = None) -> str:
    """Describe the light on a face and, on a second line, compare it with the promised light."""
    light = check.light
    words = [_key(light)]
    if flash:
        words.append(tr("a flash at the lens"))
    if light.ratio_stops is not None:
        words.append(tr("cheeks {stops} apart", stops=stops_words(round(light.ratio_stops, 1))))
    if light.styles:
        words.append(tr("looks like {styles}", styles=_titles(light)))
    line = f"  {number}  " + "; ".join(words)
    return line if promise is None else f"{line}\n     {_check_line(check, promise)}"


def _check_line(check: Check, promise: Promise) -> str:
    """Describe how much the light on a face differs from the promised light."""
    light, promised_light = check.light, promise.light
    style = next(one for one in load_named_pack("generic").styles if one.name == promise.name)
    words = []
    if check.grade is not None:
        words.append(f"{_title(style)}: {grade_words(check.grade, attainable=True)}")
    if light.azimuth_deg is not None and promised_light.azimuth_deg is not None:
        words.append(key_words(light.azimuth_deg, promised_light.azimuth_deg))
    if light.ratio_stops is not None and promise.ratio_stops is not None:
        words.append(ratio_words(light.ratio_stops, promise.ratio_stops))
    if promise.place is not None:
        words.append(_turn(check))
    return ". ".join(part for part in words if part) + "."


def _turn(check: Check) -> str:
    error = check.turn_error_deg
    if error is None:
        is_inside = check.standing == "inside"
        return tr("In the light") if is_inside else tr("The turn cannot be read from this face")
    if check.standing == "inside":
        return tr("In the light; {turn} to the best turn", turn=turn_words(error))
    return tr("Turn {turn}", turn=turn_words(error))


def _key(light: FaceLight) -> str:
    if light.key == "flat":
        return tr("flat light, no direction")
    if light.reason:
        return tr("not read: {reason}", reason=UNREAD[light.reason])
    if light.azimuth_deg is None or light.elevation_deg is None:
        return tr("key from behind")
    where = face_direction_words(light.azimuth_deg, light.elevation_deg)
    error = round(light.error_deg or 0.0)
    return tr("key {where}, within {error}°", where=where, error=error)


def _titles(light: FaceLight) -> str:
    """List the most similar styles, each with its side."""
    styles = {style.name: style for style in load_named_pack("generic").styles}
    return ", ".join(_title(styles[name]) for name, _ in light.styles[:_LIKEST])


def _title(style: Style) -> str:
    side = SHORT_SIDES.get(style.side, "")
    return f"{style.title} ({side})" if side else style.title
