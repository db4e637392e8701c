"""The user's captured lamps: save, rename, correct, delete and restore.

    FOLDER/<name>.json           what is known of the lamp; only ever replaced as a whole
    FOLDER/<name>-<digits>.exr   its capture, and its mask as channel A; named by its checksum
    FOLDER/<name>.png            a small picture of it
    FOLDER/trash/                lamps that were put away, and captures that were corrected

The text makes a lamp count: the capture is whole before the text names it. Where the text is
damaged, the capture still holds the light, its unit and the mask.

Every function raises CoreError when there is no lamp of a name, or a file cannot be read, moved or
written; what was there before still counts then.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.atomic_files import make_folder, os_errors_as, words_of
from app.core.base.colour import srgb_encode, to_bytes
from app.core.base.errors import CoreError, EnvironmentFileError
from app.core.base.imaging.image_input import clear_error, open_image
from app.core.base.imaging.images import write_exr, write_png
from app.core.base.paths import user_data
from app.core.base.progress import Progress, Report, Task, Token, silent, span
from app.core.base.remarks import Remark
from app.core.base.sphere import bounded, remap_frame
from app.core.environment.environment import from_radiance
from app.core.environment.environment_file import read_panorama
from app.core.measure.options import MeasureOptions
from app.core.measure.ways import measure
from app.core.places.files.light import fingerprint_of
from app.core.second_light.captured import (
    LARGEST,
    CapturedLamp,
    LampMask,
    centring,
    find_mask,
    make_lamp,
)
from app.core.second_light.lamp_presets import KINDS
from app.core.second_light.place_brightness import stated_white, with_lux
from app.core.storage.data_lock import writing
from app.core.storage.json_file import Facts, number, optional, read_json, take, text, write_json
from app.core.storage.library import (
    DamagedItem,
    Library,
    TrashedItem,
    files_in,
    title_key,
    unreadable_folder,
)
from app.core.text import tr

_FINEST: Final = 4 * LARGEST[1]  # columns; a lamp is kept in a quarter


@dataclass(frozen=True, slots=True, eq=False)
class LampCapture:
    """A lamp from files.

    Attributes:
        warnings: What the merge or the panorama's reader doubts.
        mask: Where the lamp was found; None where the file states it.
    """

    lamp: CapturedLamp
    warnings: tuple[Remark, ...] = ()
    mask: LampMask | None = None


def read_lamp_file(path: Path | str) -> LampCapture:
    """Read a lamp from a panorama of it in a dark room.

    `path`: OpenEXR or Radiance. A channel A is the mask (the light premultiplied); without one the
    lamp is found.
    Its unit is known where the file states ``whiteLuminance``.
    Raises CoreError when the file cannot be read, or no lamp is in it.
    """
    # As it is stored: what is transparent is not the lamp, rather than not seen.
    environment = from_radiance(read_panorama(path, coverage=False).radiance, Path(path).stem)
    name, warnings = environment.name, environment.warnings
    white, shape = stated_white(path), environment.shape
    radiance = bounded(environment.radiance, _FINEST)
    del environment  # It may be a gigabyte larger than what is needed of it.
    alpha, mask = _alpha(Path(path), shape), None
    if alpha is None:
        mask = find_mask(radiance)
        alpha = mask.alpha
    return LampCapture(make_lamp(name, radiance, alpha, white_cd_m2=white), tuple(warnings), mask)


def _alpha(path: Path, shape: tuple[int, int]) -> Float32 | None:
    """(H, 2 H) channel A of the first part, bounded; None where there is none."""
    source = open_image(path)
    if source is None:
        return None
    try:
        names = [str(name).lower() for name in source.spec().channelnames]
        channel = next((k for k, name in enumerate(names) if name in ("a", "alpha")), None)
        if channel is None:
            return None
        values = source.read_image(0, 0, channel, channel + 1, "float")
        if values is None:
            clear_error(source)
    finally:
        source.close()
    if values is None or np.asarray(values).size != shape[0] * shape[1]:
        raise EnvironmentFileError(
            tr(
                "The mask in {name} cannot be read, or has another size than its light.",
                name=path.name,
            ),
            tr("Export it again as a whole RGBA panorama."),
        )
    return bounded(np.asarray(values, np.float32).reshape(shape), _FINEST)


_LINEAR: Final = (".exr", ".hdr")


def capture_lamp(
    paths: Sequence[Path],
    options: MeasureOptions | None = None,
    *,
    title: str = "lamp",
    distance_m: float | None = None,
    token: Token | None = None,
    report: Report = silent,
) -> LampCapture:
    """Merge a bracket of a lamp in a dark room, and find the lamp in it.

    `paths`: exposures, or one folder of them, or one linear panorama (.exr, .hdr) with the mask as
    its channel A or without.
    `options`: how to merge. By default the camera's curve is taken as sRGB: what is in a dark
    room's frames is mostly noise, from which no curve can be recovered.
    `distance_m`: from the probe to the lamp, metres.
    Raises CoreError when the files are no panoramas, or no lamp stands out.
    """
    if len(paths) == 1 and paths[0].suffix.lower() in _LINEAR:
        capture = read_lamp_file(paths[0])
        lamp = replace(capture.lamp, title=title, distance_m=distance_m)
        return replace(capture, lamp=lamp)
    options = options or MeasureOptions(response="srgb", sun="leave")
    probe = measure("bracket", paths, options, token, span(report, 0.0, 0.8))
    if not probe.bracket.panorama:
        raise CoreError(
            tr("These pictures are not full panoramas (2:1)."),
            tr("Capture the lamp with the 360 camera that measures places."),
        )
    report(0.8, Progress(Task.FINDING_LAMP))
    merged = probe.merged
    mask = find_mask(merged.radiance, merged.clipped)
    cameras = {frame.camera for frame in probe.bracket.frames if frame.camera}
    lamp = make_lamp(
        "lamp",
        merged.radiance,
        mask.alpha,
        title=title,
        white_cd_m2=merged.cd_m2,
        distance_m=distance_m,
        camera=cameras.pop() if len(cameras) == 1 else "",
    )
    return LampCapture(lamp, tuple(probe.warnings), mask)


MAX_TITLE: Final = 80
"""Longest title, characters."""

_FORMAT: Final = 1
_MOST_BYTES: Final = 1 << 16
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9-]{0,40}")
_SHA: Final = r"[0-9a-f]{64}"
_PICTURE: Final = 256
_AGAIN: Final = tr("Make room or allow writing there, then try again.")


def write_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Write a lamp's files; the text comes last and makes it count."""
    both = np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32)
    target = capture_named(folder, lamp.name, checksum(lamp))
    sentence = tr("The lamp was not saved in {folder}: {reason}.")
    with os_errors_as(CoreError, sentence, _AGAIN, folder=folder):
        make_folder(folder)
        try:
            write_exr(target, both, lamp.white_cd_m2)
        except CoreError as error:
            message = tr("The lamp was not saved. {message}", message=error.message)
            raise CoreError(message, _AGAIN) from error
        with contextlib.suppress(CoreError):  # Only its looks would be lost.
            write_png(folder / f"{lamp.name}.png", picture_of(lamp))
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
        raise CoreError(
            tr("The lamp was not saved. {message}", message=error.message), _AGAIN
        ) from error


class LampPart(Enum):
    """What a lamp's text states."""

    NAME = auto()
    DISTANCE = auto()
    BRIGHTNESS = auto()
    ILLUMINANCE = auto()
    CAMERA = auto()
    CHECKSUM = auto()


@dataclass(frozen=True, slots=True)
class LampDamage:
    """The parts of a lamp's text that could not be read, or why all of it could not."""

    parts: tuple[LampPart, ...] = ()
    error: CoreError | None = None


def facts_of(folder: Path, name: str) -> tuple[Facts, LampDamage | None]:
    """Read what is known of a lamp, as much as there is.

    title, distance_m, white_cd_m2, lux, camera and sha256; what was lost has its default.
    Raises CoreError when the system does not give it out, or a newer version has written it.
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
            tr("The lamp {name} was saved by a newer Turnlight.", name=name),
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
    """Find the capture that the text names; where the text lost it, the newest there is."""
    sha = facts["sha256"]
    if sha:
        path = capture_named(folder, name, sha)
        if path.is_file():
            return path
    elif paths := captures(folder, name):
        return max(paths, key=lambda each: each.stat().st_mtime)
    raise CoreError(
        tr("The capture of “{title}” is missing.", title=facts["title"]),
        tr("Check {folder}, or capture it again.", folder=folder),
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
    stems = {file.stem for file in files_in(folder, ".json") if _NAME.fullmatch(file.stem)}
    for file in files_in(folder, ".exr"):
        stem = re.fullmatch(r"(.+)-[0-9a-f]{12}", file.stem)
        if stem and _NAME.fullmatch(stem[1]):
            stems.add(stem[1])
    return sorted(stems)


def checksum(lamp: CapturedLamp) -> str:
    """SHA-256 of a lamp's light and mask."""
    return fingerprint_of(np.dstack([lamp.radiance, lamp.alpha]).astype(np.float32))


def picture_of(lamp: CapturedLamp) -> Bytes:
    """Show a lamp as seen from the probe.

    Returns (256, 256, 3) uint8: sRGB, the lamp in the middle and not burnt out, the room around it
    dark.
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


_MOST_LAMPS: Final = 500
_HELD_M: Final = (0.05, 20.0)


@dataclass(frozen=True, slots=True)
class LampEntry:
    """A lamp of the library, without its light."""

    name: str
    title: str
    distance_m: float | None  # at which it was captured, metres
    lux: float | None  # what it gives there; None where its exposure was not known
    camera: str
    picture: Path | None  # small sRGB picture
    damage: LampDamage | None = None


_LIBRARY: Final = Library(
    noun="lamp",
    error=CoreError,
    not_put_away=lambda error: CoreError(
        tr("The lamp cannot be deleted: {reason}.", reason=words_of(error))
    ),
    longest=MAX_TITLE,
    reserved=KINDS,
    names=names,
    title_of=lambda folder, name: str(facts_of(folder, name)[0]["title"]),
    # A picture without its lamp is somebody's file all the same.
    is_taken=lambda folder, name: name in names(folder) or (folder / f"{name}.png").exists(),
)


def lamps_folder() -> Path:
    """Return the folder of the user's lamps; it need not exist."""
    return user_data() / "lamps"


def list_lamps(folder: Path) -> tuple[tuple[LampEntry, ...], tuple[DamagedItem, ...]]:
    """List the lamps of a folder without reading their light."""
    entries: list[LampEntry] = []
    damaged: list[DamagedItem] = []
    try:
        lamp_names = names(folder)
    except OSError as error:
        return (), (unreadable_folder(folder, error),)
    for name in lamp_names[:_MOST_LAMPS]:
        try:
            entries.append(_entry(folder, name, *facts_of(folder, name)))
        except CoreError as error:
            damaged.append(DamagedItem(folder / f"{name}.json", error))
    return tuple(sorted(entries, key=lambda each: title_key(each.title))), tuple(damaged)


def read_lamp(folder: Path, name: str) -> CapturedLamp:
    """Read a lamp; raises CoreError when there is none of that name, or it is damaged."""
    stem = _find(folder, name)
    facts, _ = facts_of(folder, stem)
    lamp = read_lamp_file(capture_path(folder, stem, facts)).lamp
    if facts.get("sha256", "") not in ("", checksum(lamp)):
        raise CoreError(
            tr(
                "The capture of “{title}” is damaged: its checksum does not fit.",
                title=facts["title"],
            ),
            tr("Capture the lamp again."),
        )
    white = lamp.white_cd_m2 if facts["white_cd_m2"] is None else facts["white_cd_m2"]
    return replace(
        lamp,
        name=stem,
        title=facts["title"],
        white_cd_m2=white,
        distance_m=facts["distance_m"],
        camera=facts["camera"],
    )


def add_lamp(folder: Path, lamp: CapturedLamp, title: str = "") -> CapturedLamp:
    """Save a lamp under a free name and title.

    Raises CoreError if it cannot be written, or the title is empty or too long. Nothing counts
    then.
    """
    with os_errors_as(
        CoreError, tr("The lamp was not saved in {folder}: {reason}."), _AGAIN, folder=folder
    ):
        make_folder(folder)
    with writing(folder):
        name, lamp_title = _LIBRARY.names_for(folder, _LIBRARY.clean_title(title or lamp.title))
        new_lamp = replace(lamp, name=name, title=lamp_title)
        write_lamp(folder, new_lamp)
    return new_lamp


def update_lamp(folder: Path, lamp: CapturedLamp) -> None:
    """Replace a lamp, its mask or brightness corrected; the old one goes to the trash."""
    name = _find(folder, lamp.name)
    old = read_lamp(folder, name)
    write_lamp(_LIBRARY.trash_folder(folder, name), old)
    write_lamp(folder, replace(lamp, title=_LIBRARY.clean_title(lamp.title)))
    if checksum(old) != checksum(lamp):
        with contextlib.suppress(OSError):
            capture_named(folder, name, checksum(old)).unlink()


def rename_lamp(folder: Path, name: str, title: str) -> CapturedLamp:
    """Rename a lamp; its file name stays.

    Raises CoreError if another lamp is called so, or it cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    new_lamp = replace(lamp, title=_LIBRARY.new_title(folder, lamp.name, title))
    write_text(folder, new_lamp)
    return new_lamp


def restate_lamp(
    folder: Path, name: str, *, distance_m: float | None = None, lux: float | None = None
) -> CapturedLamp:
    """Correct the facts of a lamp; its capture stays.

    `distance_m`: at which it was captured, metres; what is left out stays.
    Raises CoreError if these are no such numbers, or it cannot be read or written.
    """
    lamp = read_lamp(folder, name)
    if distance_m is not None:
        lamp = replace(lamp, distance_m=check_distance(distance_m))
    if lux is not None:
        lamp = with_lux(lamp, lux)
    write_text(folder, lamp)
    return lamp


def check_distance(distance_m: float) -> float:
    """Give a distance of a captured lamp back, unless none can be captured or held there."""
    low, high = _HELD_M
    if not low <= distance_m <= high:
        raise CoreError(
            tr("A lamp {distance:g} m away cannot be used.", distance=distance_m),
            tr(
                "Measure from the camera to the lamp: between {low:g} cm and {high:g} m.",
                low=100 * low,
                high=high,
            ),
        )
    return distance_m


def delete_lamp(folder: Path, name: str) -> TrashedItem:
    """Move a lamp to the trash."""
    stem = _find(folder, name)
    facts, _ = facts_of(folder, stem)
    files = [folder / f"{stem}.json", *captures(folder, stem), folder / f"{stem}.png"]
    there = [file for file in files if file.exists()]
    return _LIBRARY.put_away(folder, stem, facts["title"], there)


def restore_lamp(folder: Path, trashed: TrashedItem) -> CapturedLamp:
    """Restore a lamp from the trash.

    Under its old name and title, unless others bear them by now.
    """
    lamp = read_lamp(trashed.folder, trashed.name)
    name, title = _LIBRARY.names_for(folder, lamp.title, lamp.name)
    back = replace(lamp, name=name, title=title)
    write_lamp(folder, back)
    return back


def _entry(folder: Path, name: str, facts: Facts, damage: LampDamage | None) -> LampEntry:
    capture_path(folder, name, facts)
    picture = folder / f"{name}.png"
    return LampEntry(
        name,
        facts["title"],
        facts["distance_m"],
        facts["lux"],
        facts["camera"],
        picture if picture.is_file() else None,
        damage,
    )


def _find(folder: Path, name: str) -> str:
    there = names(folder)
    if name in there:
        return name
    titles = _LIBRARY.titles(folder)
    if title_key(name) in titles:
        return titles[title_key(name)]
    raise CoreError(
        tr("There is no lamp {name!r} in the library.", name=name),
        tr("There are: {names}.", names=", ".join(there)) if there else tr("There are: none yet."),
    )
