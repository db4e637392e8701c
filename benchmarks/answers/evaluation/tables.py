"""The tables of the evaluation: pre-integrated targets of sizes and heads that do not ship.

A table is F of eq. 3 and nothing else, so that 200 x 200 pixels and 128 x 64 texels take kilobytes
where the transport would take gigabytes. `turnlight evaluate --bake` makes them again.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import read_sealed, write_sealed
from app.core.base.errors import TransportError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from app.core.styles.style import Style

Float32: TypeAlias = NDArray[np.float32]

TABLES_VERSION: Final = 1
_AGAIN: Final = "Restore it with git, or make the tables again with 'turnlight evaluate --bake'."
_MOST_BYTES: Final = 1 << 26
_MOST_HEADS: Final = 64


@dataclass(frozen=True, slots=True)
class TableNote:
    """Origin of a table."""

    head: str
    skin: str
    head_sha256: str
    settings: str
    noise: float


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """Pre-integrated targets, panorama coordinates at turn 0, for luminance.

    Attributes:
        pictures: Sides of the Z pictures, pixels.
        sizes: (Z, S, H, W) float32. F of the generic head for each picture, for the largest
            environment.
        heads: dict of str to (S, H, W) float32. F of other heads in the app's own sizes.
    """

    styles: tuple[str, ...]
    styles_sha256: str
    pictures: tuple[int, ...]
    sizes: Float32 = field(repr=False)
    sizes_note: TableNote
    heads: dict[str, Float32] = field(repr=False)
    head_notes: dict[str, TableNote]

    def picture(self, size: int) -> Float32:
        """Return F for a picture of `size` pixels, (S, H, W) float32."""
        table: Float32 = self.sizes[self.pictures.index(size)]
        return table


def styles_digest(styles: Sequence[Style]) -> str:
    """Return the SHA-256 of the data that determine the targets of styles: names and lamps."""
    facts = [[style.name, [asdict(lamp) for lamp in style.lamps]] for style in styles]
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def tables_path(folder: Path | None = None) -> Path:
    """Return the path of the tables: in `folder`, otherwise beside this module."""
    return (folder or Path(__file__).parent) / "tables.npz"


def save_tables(path: Path, tables: Tables) -> str:
    """Store tables, atomically, and return their SHA-256."""
    arrays = {"sizes": np.ascontiguousarray(tables.sizes, np.float32)}
    arrays |= {f"head:{name}": np.ascontiguousarray(f) for name, f in tables.heads.items()}
    header = {
        "format_version": TABLES_VERSION,
        "styles": tables.styles,
        "styles_sha256": tables.styles_sha256,
        "pictures": tables.pictures,
        "sizes_note": _plain(tables.sizes_note),
        "head_notes": {name: _plain(note) for name, note in tables.head_notes.items()},
    }
    return write_sealed(path, arrays, header)


def load_tables(path: Path) -> Tables:
    """Load the tables of evaluation.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version, or something else.
    """
    header, arrays = read_sealed(
        path, "table of evaluation", _AGAIN, TABLES_VERSION, most=_MOST_BYTES
    )
    try:
        tables = _parsed(header, arrays)
        fits = _fits(tables)
    except (KeyError, ValueError, TypeError, AttributeError, OverflowError) as error:
        raise TransportError(f"{path.name} is not a table of evaluation.", _AGAIN) from error
    if not fits:
        raise TransportError(f"{path.name} contradicts itself.", _AGAIN)
    return tables


def _parsed(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Tables:
    notes = {str(name): _note(note) for name, note in header["head_notes"].items()}
    return Tables(
        styles=tuple(str(name) for name in header["styles"]),
        styles_sha256=str(header["styles_sha256"]),
        pictures=tuple(int(size) for size in header["pictures"]),
        sizes=arrays["sizes"],
        sizes_note=_note(header["sizes_note"]),
        heads={name: arrays[f"head:{name}"] for name in notes},
        head_notes=notes,
    )


def _plain(note: TableNote) -> dict[str, Any]:
    # JSON has no NaN.
    facts = asdict(note)
    return {**facts, "noise": note.noise if np.isfinite(note.noise) else None}


def _note(facts: Mapping[str, Any]) -> TableNote:
    noise = facts["noise"]
    return TableNote(
        head=str(facts["head"]),
        skin=str(facts["skin"]),
        head_sha256=str(facts["head_sha256"]),
        settings=str(facts["settings"]),
        noise=float("nan") if noise is None else float(noise),
    )


def _fits(tables: Tables) -> bool:
    """Return whether all arrays have their types and shapes, and contain numbers."""
    count = len(tables.styles)
    every = [(tables.sizes, 4), *((f, 3) for f in tables.heads.values())]
    fits = count > 0 and len(tables.heads) <= _MOST_HEADS
    fits = fits and len(tables.sizes) == len(tables.pictures)
    for array, axes in every:
        fits = fits and array.dtype == np.float32 and array.ndim == axes
        fits = fits and array.shape[-3] == count and array.shape[-1] == 2 * array.shape[-2]
        fits = fits and bool(np.isfinite(array).all())
    return fits
