"""What the window keeps, saved and read by functions that run in a process of their own.

Each works in the current folder. ``save(kind, number)`` keeps version `number` of a thing of that
kind, ``shown(kind)`` prints what is read again.
"""

from __future__ import annotations

import hashlib
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from unittest.mock import patch

import numpy as np

from app.core.base.errors import CoreError
from app.core.painting.canvas import make_canvas
from app.core.painting.draft_file import Draft, load_draft, save_draft
from app.core.painting.user_styles import list_user_styles, save_user_style, update_user_style
from app.core.places.files.light import read_light, store_environment
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.places.place_list import list_places
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, make_lamp
from app.core.second_light.captured_lamps.lamp_library import (
    add_lamp,
    list_lamps,
    read_lamp,
    update_lamp,
)
from app.core.storage.settings import Settings
from app.core.storage.settings_file import read_settings, write_settings
from app.export.set_page import write_pdf, write_png

__all__ = ["KINDS", "bench_into", "capture_from", "save", "shown"]

KINDS: Final = ("place", "style", "lamp", "settings", "draft", "sheet.png", "sheet.pdf")
_NOON: Final = datetime(2026, 6, 21, 12, tzinfo=UTC)


def save(kind: str, number: str) -> int:
    """Keep a version; 2 and a sentence on standard error when that is refused."""
    try:
        _save(kind, int(number))
    except CoreError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def bench_into(folder: str) -> int:
    """``turnlight bench -o`` without its minutes of measuring."""
    from app.cli import main
    from benchmarks.speed.timing import command
    from benchmarks.speed.timing.runner.run import Bench

    machine = {"cores": 1, "words": "x" * 9000}
    with patch.object(command, "run_all", lambda *_, **__: Bench((), 1e9, (), machine)):
        return main(["bench", "-o", folder])


def capture_from(url: str, speed: str) -> int:
    """``turnlight capture`` into the folder "session", so many times as fast as in life."""
    from app.cli import main
    from app.commands import capture
    from tests.helpers.scaled_clock import ScaledClock

    with patch.object(capture, "SystemClock", lambda: ScaledClock(float(speed))):
        return main(["capture", "--camera", url, "-o", "session"])


def shown(kind: str) -> int:
    """Print a digest of what is kept; nothing of it may be damaged."""
    print(hashlib.sha256(_read(kind)).hexdigest())
    return 0


def _noise(number: int, *shape: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.random.default_rng(number).random(shape, np.float32)


def _lamp(number: int) -> CapturedLamp:
    alpha = np.zeros((64, 128), np.float32)
    alpha[20:30, 60:70] = 1.0
    light = _noise(number, 64, 128, 3) * alpha[..., None] * 50 + np.float32(0.01)
    return make_lamp("mine", light, alpha, title="Mine", white_cd_m2=100.0, distance_m=1.0)


def _save(kind: str, number: int) -> None:
    here = Path.cwd()
    if kind == "place":
        found = list_places(here / "places")
        folder = found[0].folder if found else create_place(here / "places", "Hall", _NOON)
        stored = store_environment(folder, _noise(number, 64, 128, 3))
        place = replace(read_place(folder), notes=f"Version {number}")
        place = replace(place, environment=stored.environment, fingerprint=stored.fingerprint)
        write_place(folder, place)
    elif kind == "style":
        canvas = make_canvas(2 * _noise(number, 64, 64) - 1, _noise(number + 9, 64, 64))
        styles, _ = list_user_styles(here / "styles")
        if styles:
            update_user_style(here / "styles", styles[0], canvas)
        else:
            save_user_style(here / "styles", canvas, "Mine")
    elif kind == "lamp":
        if list_lamps(here / "lamps")[0]:
            kept = read_lamp(here / "lamps", "mine")
            update_lamp(here / "lamps", replace(_lamp(number), name=kept.name, title=kept.title))
        else:
            add_lamp(here / "lamps", _lamp(number))
    elif kind == "settings":
        write_settings(here / "settings.json", Settings().with_("sitter_name", f"Zoë {number}" * 9))
    elif kind == "draft":
        canvas = make_canvas(2 * _noise(number, 64, 64) - 1, _noise(number + 9, 64, 64))
        save_draft(here / "draft.npz", Draft(canvas))
    else:
        from tests.unit.test_set_sheet_page import sheet_of

        write = write_png if kind == "sheet.png" else write_pdf
        write(here / kind, sheet_of(title=f"Style {number}"))


def _read(kind: str) -> bytes:
    here = Path.cwd()
    if kind == "place":
        (row,) = list_places(here / "places")
        place = read_place(row.folder)
        light, said = read_light(row.folder, place)
        assert not said
        return place.notes.encode() + light.radiance.tobytes()
    if kind == "style":
        (style,), damaged = list_user_styles(here / "styles")
        assert not damaged
        return style.weights.tobytes() + style.ignore.tobytes()
    if kind == "lamp":
        (_,), broken = list_lamps(here / "lamps")
        assert not broken
        return read_lamp(here / "lamps", "mine").radiance.tobytes()
    if kind == "settings":
        settings, lost = read_settings(here / "settings.json")
        assert not lost
        return repr(settings).encode()
    if kind == "draft":
        return load_draft(here / "draft.npz").canvas.weights.tobytes()
    return (here / kind).read_bytes()
