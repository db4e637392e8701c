"""The photos taken at a place, and how far each of them missed the light.

    PLACE/shots.json         one entry per photo, always replaced as a whole
    PLACE/shots/originals/   copies of the photos (the user's own files are only read)
    PLACE/shots/shot-N.jpg   thumbnails for the list

A removed photo stays on disk, marked as removed, so that it can be restored. Its copy is deleted
when the place is next opened.
"""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import cv2

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.base.atomic_files import atomic_write_bytes
from app.core.base.errors import CoreError
from app.core.base.imaging.image_input import read_picture
from app.core.base.imaging.images import write_png
from app.core.base.progress import Report, Token, silent
from app.core.base.remarks import Remark
from app.core.measure.film.film import Film
from app.core.places.files.originals import ORIGINALS, adopt_files
from app.core.places.place import PlaceError
from app.core.places.remarks import PhotosLost
from app.core.solver.peaks import value_at
from app.core.solver.style_result import StyleResult
from app.core.solver.style_signature import FORMER_GRADES, GRADES
from app.core.storage.data_lock import writing
from app.core.storage.json_file import (
    Facts,
    Unfit,
    carry_unknown,
    keep_bad,
    moment,
    number,
    one_of,
    optional,
    read_json,
    record,
    text,
    truth,
    whole,
    write_json,
)
from app.core.text import tr

SHOTS: Final = "shots.json"
"""Name of the file that lists the photos in a place's folder."""

_FOLDER: Final = "shots"
_VERSION: Final = 1
_KEY: Final = r"shot-\d{4,6}"
_MOST_SHOTS: Final = 2000
_MOST_BYTES: Final = 8 << 20
_MOST_THUMBNAIL: Final = 1 << 20
_THUMBNAIL: Final = 384  # pixels of its longer side
_QUALITY: Final = 88


@dataclass(frozen=True, slots=True)
class Shot:
    """A photo and its verdict.

    Azimuths are given in the panorama's frame, so they stay valid when the marker for the
    photographer's position is moved.
    """

    name: str
    added_at: str
    found: bool
    style: str
    title: str
    goal_facing_deg: float  # azimuth that the sitter should face, in degrees
    taken_at: str | None = None
    # heading_deg, facing_deg: azimuth of the camera's axis, and the sitter's facing, in degrees
    heading_deg: float | None = None
    facing_deg: float | None = None
    # angle of the sitter from the axis, in degrees, positive to the right, or None if no sitter was
    # detected
    sitter_deg: float | None = None
    # fov_deg, focal_mm: horizontal field of view, in degrees; focal length for a frame of 36 x 24
    # mm
    fov_deg: float | None = None
    focal_mm: float | None = None
    confidence: float = 0.0  # 0 to 1
    outside_deg: int = 0  # whole degrees from the light, or 0 in the light
    # match, best: 0 to 100, the match at that turn and the style's best match at the place, or None
    # if the turn is unknown
    match: int | None = None
    best: int | None = None
    # by_face: whether the facing comes from the light on the face, not from the background
    by_face: bool = False
    mirrored: bool = False  # whether the photo was read as a mirror image
    grade: str | None = None  # grade of the style on the face
    # key_deg, key_promised_deg: azimuths of the key from the face, positive towards the sitter's
    # left
    key_deg: float | None = None
    key_promised_deg: float | None = None
    ratio_stops: float | None = None
    ratio_promised_stops: float | None = None
    removed: bool = False
    file: str = ""
    key: str = ""


def _time(value: Any) -> str:
    moment(value)
    return str(value)


_ANGLE: Final = number(-360.0, 360.0)
_FILE: Final = r"[^/\\\0.][^/\\\0]{0,254}"
_CHECKS: Final[dict[str, Callable[[Any], Any]]] = {
    "name": text(255),
    "added_at": _time,
    "found": truth,
    "style": text(200),
    "title": text(200),
    "goal_facing_deg": _ANGLE,
    "taken_at": optional(_time),
    "heading_deg": optional(_ANGLE),
    "facing_deg": optional(_ANGLE),
    "sitter_deg": optional(_ANGLE),
    "fov_deg": optional(number(0.0, 360.0)),
    "focal_mm": optional(number(0.0, 1e5)),
    "confidence": number(0.0, 1.0),
    "outside_deg": whole(0, 360),
    "match": optional(whole(0, 100)),
    "best": optional(whole(0, 100)),
    "by_face": truth,
    "mirrored": truth,
    "grade": optional(one_of(*GRADES, former=FORMER_GRADES)),
    "key_deg": optional(_ANGLE),
    "key_promised_deg": optional(_ANGLE),
    "ratio_stops": optional(number(0.0, 30.0)),
    "ratio_promised_stops": optional(number(0.0, 30.0)),
    "removed": truth,
    "file": text(255, _FILE),
}


def read_shots(folder: Path) -> tuple[tuple[Shot, ...], tuple[Remark, ...]]:
    """Read the photos of a place, skipping damaged entries.

    Returns:
        The photos in the order in which they were added, except for removed ones, and the remarks.
    """
    shots, remarks, _, _ = _read(folder)
    return tuple(shot for shot in shots if not shot.removed), remarks


def _read(folder: Path) -> tuple[list[Shot], tuple[Remark, ...], Facts, str]:
    file = read_json(folder / SHOTS, _MOST_BYTES)
    shots, bad_count = [], 0
    for key, value in file.facts.items():
        if re.fullmatch(_KEY, key) is None:
            continue
        try:
            shots.append(replace(_shot(value), key=key))
        except Unfit:
            bad_count += 1
    if file.state in ("missing", "whole") and not bad_count:
        return shots, (), file.facts, file.version
    remark = PhotosLost(bad_count, folder / _FOLDER / ORIGINALS)
    return shots, (remark,), file.facts, file.version


_shot: Final = record(
    Shot,
    _CHECKS,
    needs=("name", "added_at", "found", "style", "title", "goal_facing_deg", "file"),
)


def _facts(shot: Shot) -> Facts:
    facts = asdict(shot)
    del facts["key"]
    if not all(math.isfinite(each) for each in facts.values() if isinstance(each, float)):
        raise PlaceError(tr("The result for {name} is not a number.", name=shot.name))
    return facts


def _write(folder: Path, shots: list[Shot], file_facts: Facts, version: str) -> None:
    """Write all photos, keeping entries that are unreadable or from newer versions."""
    if len(shots) > _MOST_SHOTS:
        raise PlaceError(
            tr("This place has more than {most} photos.", most=_MOST_SHOTS),
            tr("Remove some of them."),
        )
    new: Facts = {"version": file_facts.get("version", _VERSION)}
    new |= {shot.key: carry_unknown(_facts(shot), {}, file_facts.get(shot.key)) for shot in shots}
    others = {name: value for name, value in file_facts.items() if name not in new}
    try:
        write_json(folder / SHOTS, new | others, _MOST_BYTES, version)
    except CoreError as error:
        raise PlaceError(
            tr("The photo was not saved. {message}", message=error.message),
            tr("Free some space, then open the photo again."),
        ) from error


def add_shot(
    folder: Path,
    photo: Path,
    shot: Shot,
    picture: Bytes,
    token: Token | None = None,
    report: Report = silent,
) -> Shot:
    """Add a photo to a place.

    Opening a photo again for the same style replaces its existing entry.

    Args:
        picture: (H, W, 3) uint8. The photo in sRGB, upright, for its thumbnail in the list.

    Raises:
        PlaceError: If the photo cannot be copied or the disk fails. In that case, the photo is not
            listed.
    """
    (copy,) = adopt_files(folder / _FOLDER, [photo], token, report)
    with writing(folder.parent):
        return _add(folder, copy, shot, picture)


def _add(folder: Path, copy: Path, shot: Shot, picture: Bytes) -> Shot:
    shots, remarks, file_facts, version = _read(folder)
    if remarks:
        keep_bad(folder / SHOTS, _MOST_BYTES)
    same = next((one for one in shots if (one.file, one.style) == (copy.name, shot.style)), None)
    key = _next_key(file_facts) if same is None else same.key
    stored = replace(shot, key=key, file=copy.name, name=shot.name[:255])
    _write_thumbnail(folder, key, picture)
    _write(folder, [one for one in shots if one.key != key] + [stored], file_facts, version)
    return stored


def _next_key(file_facts: Facts) -> str:
    numbers = [int(key[5:]) for key in file_facts if re.fullmatch(_KEY, key)]
    return f"shot-{max(numbers, default=0) + 1:04d}"


def _write_thumbnail(folder: Path, key: str, picture: Bytes) -> None:
    """Write the thumbnail, ignoring any failure, which would affect only the list."""
    share = min(_THUMBNAIL / max(picture.shape[:2]), 1.0)
    small = cv2.resize(picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA)
    rgb = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
    ok, data = cv2.imencode(".jpg", rgb, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    if ok:
        with contextlib.suppress(CoreError):
            atomic_write_bytes(folder / _FOLDER / f"{key}.jpg", data.tobytes())


def is_frame(shot: Shot) -> bool:
    """Return whether a photo is a frame from a video."""
    return shot.file.endswith(".frame.png")


def photo_of(folder: Path, shot: Shot) -> Path:
    """Return the path of the copy of a photo."""
    return folder / _FOLDER / ORIGINALS / shot.file


def thumbnail_of(folder: Path, shot: Shot) -> Bytes | None:
    """Read the thumbnail of a photo.

    Returns:
        (h, w, 3) uint8 sRGB, or None if there is no readable thumbnail.
    """
    path = folder / _FOLDER / f"{shot.key}.jpg"
    read = read_picture(path, _MOST_THUMBNAIL, _THUMBNAIL**2)
    return read if read is not None and max(read.shape[:2]) <= _THUMBNAIL else None


def mark_shot(folder: Path, key: str, *, removed: bool) -> None:
    """Remove a photo from the list, or restore it.

    Raises:
        PlaceError: If the photo no longer exists or the disk fails.
    """
    with writing(folder.parent):
        shots, _, file_facts, version = _read(folder)
        if all(shot.key != key for shot in shots):
            raise PlaceError(
                tr("This photo is no longer in the place."), tr("Open the photo again.")
            )
        new_shots = [replace(one, removed=removed) if one.key == key else one for one in shots]
        _write(folder, new_shots, file_facts, version)


def purge_shots(folder: Path) -> int:
    """Permanently delete removed photos and their copies.

    Returns:
        The number of deleted photos. Photos that cannot be deleted stay on disk.
    """
    shots, remarks, file_facts, version = _read(folder)
    purge = [shot for shot in shots if shot.removed]
    if remarks or not purge:
        return 0
    rest = [shot for shot in shots if not shot.removed]
    others = {
        name: value for name, value in file_facts.items() if name not in {s.key for s in purge}
    }
    with contextlib.suppress(CoreError):
        _write(folder, rest, others, version)
        files = {shot.file for shot in rest}
        for shot in purge:
            with contextlib.suppress(OSError):
                (folder / _FOLDER / f"{shot.key}.jpg").unlink(missing_ok=True)
                if shot.file not in files:
                    photo_of(folder, shot).unlink(missing_ok=True)
        return len(purge)
    return 0


def keep_film_frames(
    folder: Path, film: Film, results: Sequence[StyleResult], now: datetime, offset_deg: float = 0.0
) -> None:
    """Save the video's frames at the turns for the styles within reach as photos of the place.

    Frames that cannot be saved are left out.
    """
    with TemporaryDirectory() as work, suppress(CoreError, OSError):
        for result in results:
            turn = result.turn_refined_deg
            frame, clock = film.frame_at(turn), film.clock_at(turn)
            picture = film.pictures[frame] if result.attainable else None
            if picture is None:
                continue
            photo = Path(work) / f"{result.name} {clock.replace(':', '-')}.frame.png"
            write_png(photo, picture)
            nose = float(film.noses_deg[frame])
            shot = Shot(
                f"Film {clock}",
                now.isoformat(),
                True,
                result.name,
                result.title,
                wrap(turn + offset_deg),
                facing_deg=wrap(nose + offset_deg),
                sitter_deg=0.0,
                confidence=float(film.trust[frame]),
                match=int(value_at(result.match_curve, nose)),
                best=int(result.match),
            )
            add_shot(folder, photo, shot, picture)
