"""The files of a captured lamp: a text file, a capture and a picture.

    FOLDER/<name>.json           title, distance, unit and camera; replaced only as a whole
    FOLDER/<name>-<digits>.exr   the capture, with the mask as channel A; named by its checksum
    FOLDER/<name>.png            a thumbnail

A lamp exists once its text file does, because the capture is complete before the text file names
it. If the text file is damaged, the capture still contains the light, its unit and the mask.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes
from app.core.base.atomic_files import make_folder, os_errors_as
from app.core.base.colour import srgb_encode, to_bytes
from app.core.base.errors import CoreError
from app.core.base.imaging.images import write_exr, write_png
from app.core.base.sphere import remap_frame
from app.core.places.files.light import fingerprint_of
from app.core.second_light.captured_lamps.captured_lamp import (
    CapturedLamp,
    centring,
)
from app.core.storage.item_library import files_in
from app.core.storage.json_file import Facts, number, optional, read_json, take, text, write_json
from app.core.text import tr

MAX_TITLE: Final = 80
"""Maximum length of a title, in characters."""

_FORMAT: Final = 1
_MOST_BYTES: Final = 1 << 16
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,40}")
_SHA: Final = r"[0-9a-f]{64}"
_PICTURE: Final = 256
AGAIN: Final = tr("Free some space or make the folder writable, then try again.")
"""Hint shown if a lamp could not be written."""


def write_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Write the files of a lamp, ending with the text file.

    Raises:
        CoreError: If a file cannot be written.
    """
    both = np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32)
    target = capture_named(folder, lamp.name, checksum(lamp))
    sentence = tr("The lamp was not saved in {folder}: {reason}.")
    with os_errors_as(CoreError, sentence, AGAIN, folder=folder):
        make_folder(folder)
        try:
            write_exr(target, both, lamp.white_cd_m2)
        except CoreError as error:
            message = tr("The lamp was not saved. {message}", message=error.message)
            raise CoreError(message, AGAIN) from error
        with contextlib.suppress(CoreError):  # The lamp works without its picture.
            write_png(folder / f"{lamp.name}.png", picture_of(lamp))
    write_text(folder, lamp)


def write_text(folder: Path, lamp: CapturedLamp) -> None:
    """Write a lamp's text file after its capture. Raises the same errors as `write_lamp`."""
    facts: Facts = {
        "format": _FORMAT,
        "title": lamp.title,
        "distance_m": lamp.distance_m,
        "white_cd_m2": lamp.white_cd_m2,
        "lux": lamp.lux,
        "camera": lamp.camera,
        "sha256": checksum(lamp),
    }
    try:
        write_json(folder / f"{lamp.name}.json", facts, _MOST_BYTES)
    except CoreError as error:
        raise CoreError(
            tr("The lamp was not saved. {message}", message=error.message), AGAIN
        ) from error


class LampPart(Enum):
    """The entries in a lamp's text file."""

    NAME = auto()
    DISTANCE = auto()
    BRIGHTNESS = auto()
    ILLUMINANCE = auto()
    CAMERA = auto()
    CHECKSUM = auto()


@dataclass(frozen=True, slots=True)
class LampDamage:
    """The unreadable entries in a lamp's text file, or the error if none of it is readable."""

    parts: tuple[LampPart, ...] = ()
    error: CoreError | None = None


def facts_of(folder: Path, name: str) -> tuple[Facts, LampDamage | None]:
    """Read a lamp's text file and determine how it is damaged.

    Returns:
        The entries title, distance_m, white_cd_m2, lux, camera and sha256, with defaults for
        damaged entries, and the damage, or None if there is none.

    Raises:
        CoreError: If the file cannot be read, or if it is from a newer version.
    """
    file = read_json(folder / f"{name}.json", _MOST_BYTES)
    if file.state == "unreadable":
        raise CoreError(
            tr("The lamp {name} cannot be read: {why}.", name=name, why=file.why),
            tr("Check {folder}.", folder=folder),
        )
    file_facts: Facts = dict(file.facts)
    bad: list[LampPart] = []
    version = file_facts.get("format", _FORMAT)
    if isinstance(version, int) and version > _FORMAT:
        raise CoreError(
            tr("The lamp {name} was saved by a newer version of Turnlight.", name=name),
            tr("Update Turnlight."),
        )
    bare = name.replace("-", " ").capitalize()

    def part(key: str, check: Callable[[Any], Any], default: Any, lost_part: LampPart) -> Any:
        return take(file_facts, key, check, default, bad, lost_part)

    facts: Facts = {
        "title": part("title", text(MAX_TITLE), bare, LampPart.NAME) or bare,
        "distance_m": part("distance_m", optional(number(0.01, 100.0)), None, LampPart.DISTANCE),
        "white_cd_m2": part(
            "white_cd_m2", optional(number(1e-12, 1e12)), None, LampPart.BRIGHTNESS
        ),
        "lux": part("lux", optional(number(0.0, 1e12)), None, LampPart.ILLUMINANCE),
        "camera": part("camera", text(80), "", LampPart.CAMERA),
        "sha256": part("sha256", text(64, _SHA), "", LampPart.CHECKSUM),
    }
    if file.state == "whole" and not bad:
        return facts, None
    return facts, LampDamage(tuple(bad), file.error)


def capture_path(folder: Path, name: str, facts: Facts) -> Path:
    """Return the capture named in the text file, or the newest capture if that name is lost."""
    sha = facts["sha256"]
    if sha:
        path = capture_named(folder, name, sha)
        if path.is_file():
            return path
    elif paths := captures(folder, name):
        return max(paths, key=lambda each: each.stat().st_mtime)
    raise CoreError(
        tr("The capture of “{title}” is missing.", title=facts["title"]),
        tr("Check {folder}, or capture the lamp again.", folder=folder),
    )


def capture_named(folder: Path, name: str, sha256: str) -> Path:
    """Return the path of the capture with a given checksum."""
    return folder / f"{name}-{sha256[:12]}.exr"


def captures(folder: Path, name: str) -> list[Path]:
    """List all captures of a lamp."""
    ends = re.compile(re.escape(name) + r"-[0-9a-f]{12}\.exr")
    return sorted(each for each in folder.glob(f"{name}-*.exr") if ends.fullmatch(each.name))


def names(folder: Path) -> list[str]:
    """List the names of all lamps, including captures without a text file."""
    stems = {file.stem for file in files_in(folder, ".json") if _NAME.fullmatch(file.stem)}
    for file in files_in(folder, ".exr"):
        stem = re.fullmatch(r"(.+)-[0-9a-f]{12}", file.stem)
        if stem and _NAME.fullmatch(stem[1]):
            stems.add(stem[1])
    return sorted(stems)


def checksum(lamp: CapturedLamp) -> str:
    """Return the SHA-256 of a lamp's light and mask."""
    return fingerprint_of(np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32))


def picture_of(lamp: CapturedLamp) -> Bytes:
    """Draw a lamp as seen from the probe, exposed for the lamp.

    Returns:
        (256, 256, 3) uint8. sRGB, with the lamp in the centre.
    """
    ahead = centring(lamp.light)
    view = np.asarray(remap_frame(lamp.radiance, ahead), np.float32)
    mask = np.asarray(remap_frame(lamp.alpha, ahead), np.float32)
    height, width = mask.shape
    rows, columns = np.nonzero(mask[:, width // 4 : -(width // 4)] > 0.5)
    half = height // 12
    if rows.size:
        off = max(np.abs(rows - height / 2).max(), np.abs(columns - width / 4).max())
        half = int(np.clip(1.5 * off, height // 24, height // 2))
    middle = np.s_[height // 2 - half : height // 2 + half, width // 2 - half : width // 2 + half]
    lamp_pixels = view[mask > 0.5]
    top = float(np.percentile(lamp_pixels, 95.0)) if lamp_pixels.size else float(view.max())
    how = cv2.INTER_AREA if 2 * half > _PICTURE else cv2.INTER_LINEAR
    picture = cv2.resize(
        view[middle] * np.float32(0.9 / top), (_PICTURE, _PICTURE), interpolation=how
    )
    return to_bytes(srgb_encode(np.clip(picture, 0.0, 1.0)))
