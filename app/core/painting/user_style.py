"""A painted style: its two files (a TOML text and weights in OpenEXR) and its answer.

The name of the weights file contains the first digits of the weights' checksum. Changed weights are
therefore written next to the previous file and become valid only with the text file that names
them.

Every function raises `StyleError` for files that cannot be read or written, are damaged or were
made by a newer version.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from app.core.base.archive import digest
from app.core.base.arrays import Float32, Floats
from app.core.base.atomic_files import (
    DiskTrouble,
    atomic_write_text,
    disk_trouble,
    make_folder,
    os_errors_as,
    words_of,
)
from app.core.base.errors import CoreError, StyleError
from app.core.base.imaging.image_input import clear_error, open_image, read_start
from app.core.base.imaging.images import write_image
from app.core.painting.canvas import (
    MAX_SIZE,
    MIN_SIZE,
    Canvas,
    canvas_size,
    make_canvas,
    resized,
    weights_of,
)
from app.core.solver.relighting_cache import LightTable, light_table
from app.core.solver.solve import solve_on_table
from app.core.solver.style_result import StyleResult
from app.core.solver.transport import Transport, render, to_image
from app.core.solver.turn_choice import LIMITS, Limits, Objective
from app.core.solver.weights import PaintedWeights
from app.core.storage.item_library import one_line
from app.core.styles.painted_style_file import PAINTED_FORMAT, read_painted
from app.core.styles.style import Side, Style
from app.core.styles.styles import NAMES
from app.core.text import tr

if TYPE_CHECKING:
    from OpenImageIO import ImageInput


MAX_BYTES: Final = 12_000_000
"""Maximum size of a file that is read, in bytes. The largest canvas takes 8.4 MB unpacked."""

_CHANNELS: Final = ("weights", "ignore")
_EXR: Final = b"\x76\x2f\x31\x01"


def write_layers(path: Path, weights: Float32, ignore: Float32) -> None:
    """Write painted weights losslessly.

    Args:
        weights, ignore: (S, S) float32. Layers of a canvas.
    """
    pixels = np.ascontiguousarray(np.stack([weights, ignore], axis=-1), np.float32)
    write_image(path, pixels, "float", {"compression": "zip"}, _CHANNELS)


def read_layers(path: Path) -> tuple[Float32, Float32]:
    """Read painted weights from an untrusted file.

    Returns:
        The weights, (S, S) float32 in [-1, 1], and the ignore layer, (S, S) float32 in [0, 1]. Both
        are read-only.
    """
    _check_file(path)
    source = open_image(path)
    if source is None:
        raise _damaged(path)
    try:
        layers = _layers(source, path)
    except UnicodeError:
        raise _damaged(path) from None
    finally:
        source.close()
    return layers


def _check_file(path: Path) -> None:
    """Check the file's size and first bytes before any decoder reads it."""
    with os_errors_as(StyleError, tr("{name} cannot be read: {reason}."), name=path.name):
        if not path.is_file():
            raise StyleError(tr("The weights file {name} is missing.", name=path.name))
        if path.stat().st_size > MAX_BYTES:
            raise StyleError(tr("{name} is too large to contain painted weights.", name=path.name))
        head = read_start(path, len(_EXR))
    if head != _EXR:
        raise _damaged(path)


def _layers(source: ImageInput, path: Path) -> tuple[Float32, Float32]:
    spec = source.spec()
    names = [str(name) for name in spec.channelnames]
    square = spec.width == spec.height and MIN_SIZE <= spec.width <= MAX_SIZE
    if sorted(names) != sorted(_CHANNELS) or not square or spec.deep or spec.depth != 1:
        raise StyleError(tr("{name} does not contain painted weights.", name=path.name))
    size = int(spec.width)
    pixels = source.read_image(0, 0, 0, len(_CHANNELS), "float")
    if pixels is None:
        clear_error(source)
        raise _damaged(path)
    values = np.asarray(pixels, np.float32).reshape(size, size, len(_CHANNELS))
    weights, ignore = (np.ascontiguousarray(values[:, :, names.index(n)]) for n in _CHANNELS)
    if not (_within(weights, -1.0) and _within(ignore, 0.0)):
        raise StyleError(
            tr("{name} contains numbers that are not painted weights.", name=path.name)
        )
    weights.setflags(write=False)
    ignore.setflags(write=False)
    return weights, ignore


def _within(layer: Float32, low: float) -> bool:
    return bool(np.isfinite(layer).all() and layer.min() >= low and layer.max() <= 1.0)


def _damaged(path: Path) -> StyleError:
    return StyleError(tr("{name} is damaged or incomplete.", name=path.name))


MAX_TITLE: Final = 80
"""Maximum length of a title, in characters."""

_LONGEST: Final = {"place": 40, "note": 400, "head": 80, "origin": 80}


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
    # weights, ignore: (S, S), read-only canvas layers (see `app.core.painting.canvas.Canvas`)
    weights: Float32 = field(repr=False)
    ignore: Float32 = field(repr=False)
    # whether the style is a copy of the built-in style `origin` without any strokes
    untouched: bool = False

    @property
    def copy_of(self) -> str:
        """Name of the built-in style that this style copies, or "" once it has been painted on."""
        return self.origin if self.untouched and self.origin in NAMES else ""

    @property
    def style(self) -> Style:
        """The style as a `Style` without weights or lamps, for code that handles both kinds."""
        return Style(self.name, self.title, self.side, self.place, self.note, lamps=())


def from_user_style(style: UserStyle, transport: Transport) -> Canvas:
    """Return the canvas of a user's style that was painted on this or another head.

    If necessary, the layers of the style are resized to this head's canvas.
    """
    size = canvas_size(transport)
    return make_canvas(resized(style.weights, size), resized(style.ignore, size))


def clean_text(text: str, key: str) -> str:
    """Clean up a text to fit on one line, both on screen and in a file.

    Raises:
        StyleError: If the text is too long.
    """
    value = one_line(text)
    if len(value) > _LONGEST[key]:
        raise StyleError(
            {
                "place": tr("The place name is longer than {most} characters.", most=_LONGEST[key]),
                "note": tr("The note is longer than {most} characters.", most=_LONGEST[key]),
                "head": tr("The head name is longer than {most} characters.", most=_LONGEST[key]),
                "origin": tr("The origin is longer than {most} characters.", most=_LONGEST[key]),
            }[key],
            tr("Shorten it."),
        )
    return value


def checksum(style: UserStyle) -> str:
    """Return the SHA-256 checksum of a style's weights."""
    return digest({"weights": style.weights, "ignore": style.ignore})


def text_path(folder: Path, name: str) -> Path:
    """Return the path of a style's text file."""
    return folder / f"{name}.toml"


def layers_path(folder: Path, name: str, sha256: str) -> Path:
    """Return the path of a style's weights file."""
    return folder / f"{name}-{sha256[:12]}.exr"


def style_text(style: UserStyle) -> str:
    """Format a style as TOML, without its weights."""
    head = {"title": style.title, "side": style.side, "place": style.place, "note": style.note}
    painted = {
        "format": PAINTED_FORMAT,
        "from": style.origin,
        "head": style.head,
        "size": len(style.weights),
        "sha256": checksum(style),
    }
    if style.copy_of:
        painted["untouched"] = True
    return f"{_lines(head)}\n[painted]\n{_lines(painted)}"


def write_user_style(folder: Path, style: UserStyle) -> None:
    """Write the two files of a style. The text, which makes the style valid, is written last."""
    try:
        make_folder(folder)
        target = layers_path(folder, style.name, checksum(style))
        write_layers(target, style.weights, style.ignore)
        atomic_write_text(text_path(folder, style.name), style_text(style))
    except (OSError, CoreError) as error:
        raise not_saved(error) from error


def not_saved(error: OSError | CoreError) -> StyleError:
    """Return the error for a style that could not be saved."""
    trouble = disk_trouble(error)
    if trouble is DiskTrouble.FULL:
        return StyleError(
            tr("Not saved: the disk is full."),
            tr("Your strokes are safe. Free some space, then save again."),
        )
    if trouble is DiskTrouble.LOCKED:
        return StyleError(
            tr("Not saved: Turnlight cannot write to your styles folder."),
            tr("Your strokes are safe. Make the folder writable, then save again."),
        )
    if isinstance(error, CoreError):
        return StyleError(
            tr("Not saved. {message}", message=error.message), tr("Your strokes are safe.")
        )
    return StyleError(
        tr("Not saved: {reason}.", reason=words_of(error)), tr("Your strokes are safe.")
    )


def read_user_style(path: Path) -> UserStyle:
    """Read a painted style."""
    values = read_painted(path)
    weights, ignore = read_layers(layers_path(path.parent, values.name, values.sha256))
    facts = values._asdict()
    size, sha256 = facts.pop("size"), facts.pop("sha256")
    style = UserStyle(**facts, weights=weights, ignore=ignore)
    if checksum(style) != sha256 or len(weights) != size:
        raise StyleError(
            tr("The weights of {name} are damaged: their checksum does not match.", name=path.name)
        )
    return style


def _lines(values: Mapping[str, object]) -> str:
    # A JSON string is also a TOML string, with the same escapes and plain UTF-8. The same is true
    # of numbers and booleans.
    return "".join(f"{key} = {json.dumps(v, ensure_ascii=False)}\n" for key, v in values.items())


_SIDE_DEG: Final = 20.0  # closer to the front or the back, light has no side
_HIGH_DEG: Final = 25.0
_STEEP_DEG: Final = 70.0
_BESIDE: Final = 0.7  # mean sine of the angle to the middle plane for light on both sides
_EVENLY: Final = 0.2
_ALIKE: Final = 0.5  # correlation with the start of the painting
# fraction of the light that its centre must keep to have a direction
_LEAST_DIRECTION: Final = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class Asking:
    """A user's style, prepared for a head."""

    style: UserStyle
    weights: PaintedWeights = field(repr=False)  # on the head's pixels
    target: Float32 = field(repr=False)  # (N, N, 3), from `target_picture`


def prepare_user_style(transport: Transport, style: UserStyle) -> Asking:
    """Prepare a user's style for a head, for use in every place."""
    weights = weights_of(make_canvas(style.weights, style.ignore), transport)
    return Asking(style, weights, target_picture(transport, weights))


def target_picture(transport: Transport, weights: PaintedWeights) -> Float32:
    """Return the picture of the head in the light that painted weights favour.

    Returns:
        (N, N, 3) float32. The picture in the environment max(F, 0), linear Rec. 709 on black, with
        a maximum of 1. It is all black if nothing is painted.
    """
    glow = np.maximum(weights.preintegrated(transport), 0.0)
    light = np.maximum(render(transport, np.repeat(glow[..., None], 3, axis=2)), 0.0)
    picture = to_image(transport, light)
    return picture / np.float32(max(float(picture.max()), 1e-30))


def light_side(transport: Transport, weights: PaintedWeights) -> tuple[Side, str]:
    """Return the side from which the light of painted weights comes.

    Returns:
        The sitter's own side on which the centre of max(F, 0) lies. If the centre lies on neither
        side, its position is also returned, in the words used in style files.
    """
    glow = np.maximum(weights.preintegrated(transport).astype(np.float64), 0.0)
    height, width = glow.shape
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    energy = glow * np.cos(elevation)
    energy /= max(float(energy.sum()), 1e-30)
    level = energy * np.cos(elevation)
    # Azimuth grows clockwise, towards the right of a sitter who faces azimuth 0.
    left = -float((level * np.sin(azimuth)).sum())
    front = float((level * np.cos(azimuth)).sum())
    up = float((energy * np.sin(elevation)).sum())
    across = float(np.hypot(left, front))
    if float((level * np.abs(np.sin(azimuth))).sum()) > _BESIDE and abs(left) < _EVENLY:
        return "none", "from both sides"
    if float(np.hypot(across, up)) <= _LEAST_DIRECTION:
        return "none", "from several sides"
    toward = float(np.degrees(np.arctan2(abs(left), front)))
    height_deg = float(np.degrees(np.arctan2(up, across)))
    if abs(height_deg) < _STEEP_DEG and _SIDE_DEG < toward < 180 - _SIDE_DEG:
        return ("left" if left > 0 else "right"), ""
    return "none", _place(front, height_deg)


def suggested_side(
    canvas: Canvas, transport: Transport, weights: PaintedWeights, origin: Style | None = None
) -> tuple[Side, str]:
    """Suggest a side for a painted style: that of the style it still resembles or of its light."""
    if origin is not None:
        start = weights_of(make_canvas(canvas.start_weights), transport)
        one, other = weights.weights, start.weights
        alike = float(one @ other) > _ALIKE * float(np.linalg.norm(one) * np.linalg.norm(other))
        if alike:
            return origin.side, origin.place
    return light_side(transport, weights)


def results_of_copies(
    styles: Sequence[UserStyle], built_in: Sequence[StyleResult]
) -> dict[str, StyleResult]:
    """Return the results of unpainted copies, which equal those of the built-in styles.

    Returns:
        Results, by the name of the copy. Styles with strokes are left out, and so are copies of
        styles that have no result.
    """
    answers = {one.name: one for one in built_in}
    return {
        style.name: replace(answers[style.copy_of], name=style.name, title=style.title)
        for style in styles
        if style.copy_of in answers
    }


def solve_user_styles(
    transport: Transport,
    styles: Sequence[UserStyle | Asking],
    light: Floats,
    objective: Objective = "picture",
    *,
    limits: Limits = LIMITS,
    front_deg: float = 0.0,
    table: LightTable | None = None,
) -> tuple[StyleResult, ...]:
    """Find the best turn for every painted style in a place.

    Args:
        light: (H, W, 3) or (H, W) float. Environment at turn 0 in the transport's size, at any
            exposure: linear Rec. 709 radiance, or the luminance of grey light.

    Returns:
        Results in the order of `styles`.
    """
    if not styles:
        return ()
    light_values = light_table(transport, light) if table is None else table
    results = []
    for entry in styles:
        style = entry.style if isinstance(entry, Asking) else entry
        weights = (
            entry.weights
            if isinstance(entry, Asking)
            else weights_of(make_canvas(style.weights, style.ignore), transport)
        )
        result = solve_on_table(light_values, weights, objective, limits=limits)
        result_named = replace(result, name=style.name, title=style.title, side=style.side)
        results.append(result_named.seen_from(front_deg) if front_deg else result_named)
    return tuple(results)


def _place(front: float, elevation_deg: float) -> str:
    if elevation_deg >= _STEEP_DEG:
        return "from overhead"
    if elevation_deg <= -_STEEP_DEG:
        return "from beneath"
    if front < 0:
        return "from behind"
    if elevation_deg > _HIGH_DEG:
        return "in front, from above"
    return "in front, from beneath" if elevation_deg < -_HIGH_DEG else "in front, at eye level"
