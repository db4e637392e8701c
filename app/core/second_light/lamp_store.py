"""One captured lamp on the disk: its text, its capture and its small picture."""

from __future__ import annotations

import contextlib
import re
from typing import TYPE_CHECKING, Any, Final

import cv2
import numpy as np

from app.core.base.colour import srgb_encode, to_bytes
from app.core.base.errors import CoreError
from app.core.base.images import write_exr, write_png
from app.core.base.sphere import remap_frame
from app.core.second_light.captured import centring
from app.core.storage.places.light import fingerprint_of
from app.core.storage.places.names import words_of
from app.core.storage.settings.json_file import number, optional, read_json, take, text, write_json

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from app.core.second_light.captured import CapturedLamp
    from app.core.storage.settings.json_file import Facts

MAX_TITLE: Final = 80
"""Longest title, characters."""

_FORMAT: Final = 1
_MOST_BYTES: Final = 1 << 16
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,40}")
_SHA: Final = r"[0-9a-f]{64}"
_PICTURE: Final = 256
_AGAIN: Final = "Make room or allow writing there, then try again."


def write_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Write a lamp's files; the text comes last and makes it count.

    Raises
    ------
    CoreError
        When the disk refuses. Then what was there still counts.
    """
    both = np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32)
    target = capture_named(folder, lamp.name, checksum(lamp))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_exr(target, both, lamp.white_cd_m2)
        with contextlib.suppress(CoreError):  # Only its looks would be lost.
            write_png(folder / f"{lamp.name}.png", picture_of(lamp))
    except OSError as error:
        raise CoreError(f"The lamp was not kept in {folder}: {words_of(error)}.", _AGAIN) from error
    except CoreError as error:
        raise CoreError(f"The lamp was not kept. {error.message}", _AGAIN) from error
    write_text(folder, lamp)


def write_text(folder: Path, lamp: CapturedLamp) -> None:
    """Write what is known of a lamp; its capture must be there. Errors as `write_lamp`."""
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
        raise CoreError(f"The lamp was not kept. {error.message}", _AGAIN) from error


def facts_of(folder: Path, name: str) -> tuple[Facts, tuple[str, ...]]:
    """Read what is known of a lamp, as much as there is.

    Returns
    -------
    dict
        title, distance_m, white_cd_m2, lux, camera and sha256; what was lost has its default.

    Raises
    ------
    CoreError
        When the system does not give it out, or a newer version has written it.
    """
    file = read_json(folder / f"{name}.json", _MOST_BYTES)
    if file.state == "unreadable":
        raise CoreError(f"The lamp {name} cannot be read: {file.why}.", f"Look at {folder}.")
    found, lost = dict(file.facts), list(file.lost)
    version = found.get("format", _FORMAT)
    if isinstance(version, int) and version > _FORMAT:
        raise CoreError(f"A newer Turnlight has kept the lamp {name}.", "Update this one.")
    bare = name.replace("-", " ").capitalize()

    def part(key: str, check: Callable[[Any], Any], default: Any, noun: str) -> Any:
        return take(found, key, check, default, lost, noun)

    facts: Facts = {
        "title": part("title", text(MAX_TITLE), bare, "its name") or bare,
        "distance_m": part("distance_m", optional(number(0.01, 100.0)), None, "its distance"),
        "white_cd_m2": part("white_cd_m2", optional(number(1e-12, 1e12)), None, "its brightness"),
        "lux": part("lux", optional(number(0.0, 1e12)), None, "its illuminance"),
        "camera": part("camera", text(80), "", "its camera"),
        "sha256": part("sha256", text(64, _SHA), "", "its checksum"),
    }
    if file.state == "whole" and not lost:
        return facts, ()
    said = f"A part of this lamp could not be read: {', '.join(lost) or file.why or 'its text'}."
    return facts, (said,)


def capture_path(folder: Path, name: str, facts: Facts) -> Path:
    """Find the capture that the text names; where the text lost it, the newest there is.

    Raises
    ------
    CoreError
        When it is missing.
    """
    sha = facts["sha256"]
    if sha:
        path = capture_named(folder, name, sha)
        if path.is_file():
            return path
    elif found := captures(folder, name):
        return max(found, key=lambda each: each.stat().st_mtime)
    raise CoreError(
        f"The capture of “{facts['title']}” is missing.", f"Look at {folder}, or capture it again."
    )


def capture_named(folder: Path, name: str, sha256: str) -> Path:
    """Where a capture lies."""
    return folder / f"{name}-{sha256[:12]}.exr"


def captures(folder: Path, name: str) -> list[Path]:
    """All captures of a lamp that there are."""
    ends = re.compile(re.escape(name) + r"-[0-9a-f]{12}\.exr")
    return sorted(each for each in folder.glob(f"{name}-*.exr") if ends.fullmatch(each.name))


def names(folder: Path) -> list[str]:
    """List the names of the lamps: of texts, and of captures whose text is gone."""
    if not folder.is_dir():
        return []
    found = {file.stem for file in folder.glob("*.json") if _NAME.fullmatch(file.stem)}
    for file in folder.glob("*.exr"):
        stem = re.fullmatch(r"(.+)-[0-9a-f]{12}", file.stem)
        if stem and _NAME.fullmatch(stem[1]):
            found.add(stem[1])
    return sorted(found)


def checksum(lamp: CapturedLamp) -> str:
    """SHA-256 of a lamp's light and mask."""
    return fingerprint_of(np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32))


def picture_of(lamp: CapturedLamp) -> NDArray[np.uint8]:
    """Show a lamp as seen from the probe.

    Returns
    -------
    NDArray[np.uint8], (256, 256, 3)
        sRGB, the lamp in the middle and not burnt out, the room around it dark.
    """
    ahead = centring(lamp.light)
    seen = np.asarray(remap_frame(lamp.radiance, ahead), np.float32)
    mask = np.asarray(remap_frame(lamp.alpha, ahead), np.float32)
    height, width = mask.shape
    rows, columns = np.nonzero(mask[:, width // 4 : -(width // 4)] > 0.5)
    half = height // 12
    if rows.size:
        off = max(np.abs(rows - height / 2).max(), np.abs(columns - width / 4).max())
        half = int(np.clip(1.5 * off, height // 24, height // 2))
    middle = np.s_[height // 2 - half : height // 2 + half, width // 2 - half : width // 2 + half]
    lit = seen[mask > 0.5]
    top = float(np.percentile(lit, 95.0)) if lit.size else float(seen.max())
    how = cv2.INTER_AREA if 2 * half > _PICTURE else cv2.INTER_LINEAR
    shown = cv2.resize(
        seen[middle] * np.float32(0.9 / top), (_PICTURE, _PICTURE), interpolation=how
    )
    return to_bytes(srgb_encode(np.clip(shown, 0.0, 1.0)))
