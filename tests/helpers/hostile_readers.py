"""Every reader of the program on one file, in a process of its own: `Zygote` runs `read_all`."""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from typing import Final

from app.core.base.errors import CoreError
from app.core.base.imaging.image_input import picture_bytes
from app.core.base.imaging.image_input import read_picture as read_small
from app.core.environment.environment import read_environment
from app.core.environment.environment_file import is_linear
from app.core.localization.photo_location import is_panorama, read_photo
from app.core.localization.picture_file import picture_size, read_picture, read_shown_panorama
from app.core.measure.film.frames import film_frames
from app.core.measure.finish.masks import check_picture_mask, picture_mask
from app.core.measure.read.makernote import read_ricoh_note
from app.core.measure.read.metadata import read_header
from app.core.painting.user_style import read_layers
from app.core.painting.user_styles import import_style, list_user_styles
from app.core.solver.transport import load_transport
from app.core.styles.painted_style_file import is_painted, read_painted
from app.core.styles.style_file import read_style
from app.devices.clock import VirtualClock
from app.devices.errors import DeviceError
from app.devices.webcam.files import VideoFile

__all__ = ["READERS", "read_all"]

_MOST: Final = 100 << 20


def _library(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "mine.toml").write_bytes(path.read_bytes())
        list_user_styles(Path(name))


def _imported(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        import_style(Path(name), path)


def _played(path: Path) -> None:
    video = VideoFile(path, VirtualClock(0.0), width=320)
    try:
        video.connect()
        for _ in range(20):
            video.read()
    finally:
        video.disconnect()


READERS: Final[tuple[Callable[[Path], object], ...]] = (
    lambda path: list(islice(film_frames(path, 12, 320), 20)),
    _played,
    read_picture,
    lambda path: read_picture(path, 256),
    picture_size,
    read_shown_panorama,
    read_photo,
    is_panorama,
    lambda path: read_small(path, _MOST, _MOST),
    lambda path: picture_bytes(path, _MOST, _MOST),
    is_linear,
    read_environment,
    read_header,
    read_ricoh_note,
    check_picture_mask,
    lambda path: picture_mask(path, (64, 128)),
    read_style,
    read_painted,
    is_painted,
    read_layers,
    _library,
    _imported,
    load_transport,
)


def read_all(name: str) -> int:
    """Read a file in every way; 0 where each read it or refused it with an error of its own."""
    code = 0
    for number, read in enumerate(READERS):
        try:
            read(Path(name))
        except (CoreError, DeviceError, OSError):
            continue
        except Exception:  # noqa: BLE001 - reported
            print(f"reader {number}")
            traceback.print_exc()
            code = 1
    return code
