"""A style that somebody painted, and its two files: a TOML text, and its weights as OpenEXR.

The weights' file bears the first digits of their checksum in its name, so that a change is
written beside what was there and counts only when the text that names it is in place.

Every function raises StyleError, with a sentence, for files that cannot be read or written, are
damaged, or were made by a newer version.
"""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.archive import CONTRADICTIONS, digest, parse_header, read_arrays, write_arrays
from app.core.base.errors import CoreError, StyleError, TransportError
from app.core.base.files import atomic_write_text
from app.core.base.image_input import clear_error, open_image, read_start
from app.core.base.images import write_image
from app.core.painting.canvas import MAX_SIZE, MIN_SIZE, Canvas, canvas_size, make_canvas, resized
from app.core.solver.style_file import PAINTED_FORMAT, read_painted
from app.core.solver.styles import Side, Style
from app.core.storage.library import one_line

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from OpenImageIO import ImageInput

    from app.core.base.arrays import Float32
    from app.core.solver.transport import Transport


DRAFT_FORMAT: Final = 1
"""Version of the file's layout."""

_LAYERS: Final = ("weights", "ignore", "start_weights", "start_ignore")
_MAX_BYTES: Final = 4 * len(_LAYERS) * MAX_SIZE**2 + 65_536
_TEXTS: Final = ("title", "origin", "style", "head")
_LONGEST: Final = 400
_HINT: Final = "The draft's file is untouched; painting starts from the style itself."


_MOST_DRAFTS: Final = 20
_AWAY: Final = "draft.npz"


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Unsaved painting."""

    canvas: Canvas
    title: str = ""
    origin: str = ""
    style: str = ""
    head: str = ""


def save_draft(path: Path, draft: Draft) -> None:
    """Write a draft whole or not at all; the one before is replaced."""
    header = {"format": DRAFT_FORMAT, **{key: getattr(draft, key)[:_LONGEST] for key in _TEXTS}}
    arrays = {name: getattr(draft.canvas, name) for name in _LAYERS}
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    write_arrays(path, arrays)


def load_draft(path: Path) -> Draft:
    """Read a draft."""
    try:
        arrays = read_arrays(path, "draft", _HINT, _MAX_BYTES)
    except (TransportError, OSError) as error:
        words = error.message if isinstance(error, TransportError) else f"{path.name}: {error}."
        raise StyleError(words, _HINT) from error
    try:
        header = parse_header(arrays["header"])
        version = int(header["format"])
        texts = {key: str(header[key])[:_LONGEST] for key in _TEXTS}
        layers = [np.asarray(arrays[name]) for name in _LAYERS]
    except CONTRADICTIONS as error:
        raise StyleError(f"{path.name} is damaged or not a draft.", _HINT) from error
    if version > DRAFT_FORMAT:
        raise StyleError(
            f"{path.name} was made by a newer Turnlight (format {version}).", "Update Turnlight."
        )
    if version < DRAFT_FORMAT or any(layer.dtype != np.float32 for layer in layers):
        raise StyleError(f"{path.name} is damaged or not a draft.", _HINT)
    return Draft(make_canvas(*layers), **texts)


MAX_BYTES: Final = 12_000_000
"""Largest file that is read; the largest canvas takes 8.4 MB unpacked."""

_CHANNELS: Final = ("weights", "ignore")
_EXR: Final = b"\x76\x2f\x31\x01"


def write_layers(path: Path, weights: Float32, ignore: Float32) -> None:
    """Write painted weights, without loss.

    `weights` and `ignore`: (S, S) float32, canvas layers.
    """
    pixels = np.ascontiguousarray(np.stack([weights, ignore], axis=-1), np.float32)
    write_image(path, pixels, "float", {"compression": "zip"}, _CHANNELS)


def read_layers(path: Path) -> tuple[Float32, Float32]:
    """Read painted weights from a file that may be anything.

    Returns read-only weights, (S, S) float32 in [-1, 1], and ignore, (S, S) float32 in [0, 1].
    """
    _check_file(path)
    source = open_image(path)
    if source is None:
        raise _damaged(path)
    try:
        layers = _layers(source, path)
    except (UnicodeError, MemoryError):
        raise _damaged(path) from None
    finally:
        source.close()
    return layers


def _check_file(path: Path) -> None:
    """Judge the file by its size and first bytes, before any decoder sees it."""
    try:
        if not path.is_file():
            raise StyleError(f"The weights {path.name} are missing.")
        if path.stat().st_size > MAX_BYTES:
            raise StyleError(f"{path.name} is too large for painted weights.")
        head = read_start(path, len(_EXR))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise StyleError(f"{path.name} cannot be read: {reason.lower()}.") from None
    if head != _EXR:
        raise _damaged(path)


def _layers(source: ImageInput, path: Path) -> tuple[Float32, Float32]:
    spec = source.spec()
    names = [str(name) for name in spec.channelnames]
    square = spec.width == spec.height and MIN_SIZE <= spec.width <= MAX_SIZE
    if sorted(names) != sorted(_CHANNELS) or not square or spec.deep or spec.depth != 1:
        raise StyleError(f"{path.name} does not hold painted weights.")
    size = int(spec.width)
    pixels = source.read_image(0, 0, 0, len(_CHANNELS), "float")
    if pixels is None:
        clear_error(source)
        raise _damaged(path)
    values = np.asarray(pixels, np.float32).reshape(size, size, len(_CHANNELS))
    weights, ignore = (np.ascontiguousarray(values[:, :, names.index(n)]) for n in _CHANNELS)
    if not (_within(weights, -1.0) and _within(ignore, 0.0)):
        raise StyleError(f"{path.name} holds numbers that are no painted weights.")
    weights.setflags(write=False)
    ignore.setflags(write=False)
    return weights, ignore


def _within(layer: Float32, low: float) -> bool:
    return bool(np.isfinite(layer).all() and layer.min() >= low and layer.max() <= 1.0)


def _damaged(path: Path) -> StyleError:
    return StyleError(f"{path.name} is damaged or incomplete.")


MAX_TITLE: Final = 80
"""Longest title, characters."""

_LENGTHS: Final = {"place": 40, "note": 400, "head": 80, "origin": 80}


@dataclass(frozen=True, slots=True, eq=False)
class UserStyle:
    """A painted style."""

    name: str
    title: str
    side: Side
    place: str
    note: str
    head: str
    origin: str
    # weights, ignore: (S, S), canvas layers, see `app.core.painting.canvas.Canvas`. Not to be
    # written to
    weights: Float32 = field(repr=False)
    ignore: Float32 = field(repr=False)

    @property
    def style(self) -> Style:
        """The same without its weights, for what shows styles of either kind; it has no lamps."""
        return Style(self.name, self.title, self.side, self.place, self.note, lamps=())

    @property
    def side_words(self) -> str:
        """The side named twice, or the place in words."""
        return self.style.side_words

    @property
    def full_title(self) -> str:
        """Title that tells left from right on its own."""
        return self.style.full_title


def from_user_style(style: UserStyle, transport: Transport) -> Canvas:
    """Start from a style of the user's own, painted on this head or another.

    Its layers are brought to this head's canvas size where that differs.
    """
    size = canvas_size(transport)
    return make_canvas(resized(style.weights, size), resized(style.ignore, size))


def clean_text(text: str, key: str) -> str:
    """Make a text fit for one line on screen and in a file; raises StyleError if it is too long."""
    value = one_line(text)
    if len(value) > _LENGTHS[key]:
        raise StyleError(f"This {key} is longer than {_LENGTHS[key]} characters.", "Shorten it.")
    return value


def checksum(style: UserStyle) -> str:
    """SHA-256 of a style's weights."""
    return digest({"weights": style.weights, "ignore": style.ignore})


def text_path(folder: Path, name: str) -> Path:
    """Where the text of a style lies."""
    return folder / f"{name}.toml"


def layers_path(folder: Path, name: str, sha256: str) -> Path:
    """Where the weights of a style lie."""
    return folder / f"{name}-{sha256[:12]}.exr"


def style_text(style: UserStyle) -> str:
    """Write down a style as TOML, without its weights."""
    head = {"title": style.title, "side": style.side, "place": style.place, "note": style.note}
    painted = {
        "format": PAINTED_FORMAT,
        "from": style.origin,
        "head": style.head,
        "size": len(style.weights),
        "sha256": checksum(style),
    }
    return f"{_lines(head)}\n[painted]\n{_lines(painted)}"


def write_user_style(folder: Path, style: UserStyle) -> None:
    """Write a style's two files; the text comes last and makes it count."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        target = layers_path(folder, style.name, checksum(style))
        write_layers(target, style.weights, style.ignore)
        atomic_write_text(text_path(folder, style.name), style_text(style))
    except (OSError, CoreError) as error:
        raise not_saved(error) from error


def not_saved(error: OSError | CoreError) -> StyleError:
    """Say why something was not saved."""
    words = str(error).lower()
    if "no space" in words or "disk is full" in words or "quota" in words:
        return StyleError(
            "Not saved: the disk is full.", "Your strokes are kept: make room, then save again."
        )
    said = error.message if isinstance(error, CoreError) else f"{error.strerror or error}".lower()
    if "read-only" in words or "not writable" in words or "permission denied" in words:
        return StyleError(
            "Not saved: the folder of your styles cannot be written to.",
            "Your strokes are kept: allow writing there, then save again.",
        )
    said = f"{said[:1].upper()}{said[1:].rstrip('.')}"
    return StyleError(f"Not saved. {said}.", "Your strokes are kept.")


def read_user_style(path: Path) -> UserStyle:
    """Read a painted style."""
    values = read_painted(path)
    weights, ignore = read_layers(layers_path(path.parent, values.name, values.sha256))
    style = UserStyle(
        values.name,
        values.title,
        values.side,
        values.place,
        values.note,
        values.head,
        values.origin,
        weights,
        ignore,
    )
    if checksum(style) != values.sha256 or len(weights) != values.size:
        raise StyleError(f"The weights of {path.name} are damaged: their checksum does not fit.")
    return style


def _lines(values: Mapping[str, object]) -> str:
    # A JSON text in quotes is a TOML text in quotes: the same escapes, and UTF-8 as it is.
    return "".join(f"{key} = {json.dumps(v, ensure_ascii=False)}\n" for key, v in values.items())


def find_draft(folder: Path, key: str) -> tuple[Path, Draft | None, tuple[str, ...]]:
    """Look for the draft that was begun from a style.

    A file that cannot be read is left as it is; the next free name is taken beside it.

    Returns:
        path: Where the draft is to be kept from now on.
        notes: What was wrong with files that are left as they are.
    """
    notes: list[str] = []
    stem = f"paint-{key}" if key else "paint"
    for number in range(1, _MOST_DRAFTS + 1):
        path = folder / (f"{stem}.npz" if number == 1 else f"{stem}.{number}.npz")
        if not path.exists():
            return path, None, tuple(notes)
        try:
            return path, load_draft(path), tuple(notes)
        except StyleError as error:
            notes.append(str(error))
    return folder / f"{stem}.{_MOST_DRAFTS + 1}.npz", None, tuple(notes)


def put_draft_away(folder: Path, key: str, trash: Path) -> None:
    """Move the draft of a deleted style to it: a new one of that name is not to begin with it."""
    path, draft, _ = find_draft(folder, key)
    if draft is not None:
        # Where it cannot be moved it stays where the style will look for it.
        with contextlib.suppress(OSError):
            os.replace(path, trash / _AWAY)


def bring_draft_back(folder: Path, key: str, trash: Path) -> None:
    """Bring the draft of a restored style back, under the name that the style has now."""
    path, other, _ = find_draft(folder, key)
    if other is None and (trash / _AWAY).exists():
        folder.mkdir(parents=True, exist_ok=True)
        os.replace(trash / _AWAY, path)
