"""``turnlight photo``: the faces in a photograph, and the light that they show."""

from __future__ import annotations

import argparse
import math
from functools import partial
from pathlib import Path
from typing import Any, Final

from app.commands.arguments import add_json, argument
from app.commands.printing import answer, short
from app.core.faces.finder import Face, find_faces
from app.core.faces.light_reading import FaceLight, read_light
from app.core.localization.photo_check import read_photo
from app.core.solver.style_pack import load_named_pack
from app.core.text import tr
from app.core.text.directions import SHORT_SIDES, face_direction_words
from app.core.text.quantities import stops_words

_LIKEST: Final = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say what ``photo`` does and takes."""
    parser.description = tr(
        "Read from each face in a photograph where its key light stands, how much "
        "brighter one cheek is than the other, and which style it shows. The picture "
        "is read on this machine and kept nowhere."
    )
    add = partial(argument, parser)
    add("picture PICTURE", tr("JPEG, PNG, TIFF or WebP"), type=Path)
    add_json(parser, run)


def run(args: argparse.Namespace) -> int:
    """Find the faces and print their light. No face is not an error."""
    photo = read_photo(args.picture)
    width = photo.picture.shape[1]
    focal = None
    if photo.fov_deg is not None:
        focal = width / 2 / math.tan(math.radians(photo.fov_deg) / 2)
    faces = find_faces(photo.picture)
    read = [read_light(photo.picture, face, focal) for face in faces]
    scale = photo.size[0] / width
    facts = [_facts(*both, scale) for both in zip(faces, read, strict=True)]
    lines = [_line(number + 1, light) for number, light in enumerate(read)]
    words = "\n".join(lines) or tr("There is no face in this picture that can be read.")
    return answer(args, {"faces": facts}, words)


def _facts(face: Face, light: FaceLight, scale: float) -> dict[str, Any]:
    """Say for JSON what a face shows; its box in pixels of the file's own picture."""
    angles = {
        "yaw_deg": light.pose.yaw_deg,
        "pitch_deg": light.pose.pitch_deg,
        "key_azimuth_deg": light.azimuth_deg,
        "key_elevation_deg": light.elevation_deg,
        "key_error_deg": light.error_deg,
        "softness_deg": light.softness_deg,
        "ratio_stops": light.ratio_stops,
    }
    return {
        "box": [round(edge * scale) for edge in face.box],
        "confidence": short(face.confidence),
        **{name: None if value is None else round(value, 2) for name, value in angles.items()},
        "key": light.key,
        "styles": [{"name": name, "score": short(score)} for name, score in light.styles],
        "turn_error_deg": None,
        "status": "unsure" if light.reason else "read",
        "reason": light.reason or None,
    }


def _line(number: int, light: FaceLight) -> str:
    """Say in a line what a face shows."""
    words = [_key(light)]
    if light.ratio_stops is not None:
        words.append(tr("cheeks {stops} apart", stops=stops_words(round(light.ratio_stops, 1))))
    if light.styles:
        words.append(tr("looks like {styles}", styles=_titles(light)))
    return f"  {number}  " + "; ".join(words)


def _key(light: FaceLight) -> str:
    if light.reason:
        return tr("not read: {reason}", reason=light.reason)
    if light.azimuth_deg is None or light.elevation_deg is None:
        return tr("key from behind")
    where = face_direction_words(light.azimuth_deg, light.elevation_deg)
    error = round(light.error_deg or 0.0)
    return tr("key {where}, within {error}°", where=where, error=error)


def _titles(light: FaceLight) -> str:
    """Name the likest styles with their sides."""
    styles = {style.name: style for style in load_named_pack("generic").styles}
    found = [styles[name] for name, _ in light.styles[:_LIKEST]]
    sides = [SHORT_SIDES.get(style.side, "") for style in found]
    return ", ".join(
        f"{style.title} ({side})" if side else style.title
        for style, side in zip(found, sides, strict=True)
    )
