"""Find, save and load style packs.

A pack is stored without rows that are exact mirror images of others. The bytes of its floats are
grouped by significance, which improves compression.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import CONTRADICTIONS, read_sealed, write_sealed
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.solver.face import AREAS, AROUND, mirror_area
from app.core.solver.head_shape import shape_path
from app.core.solver.place_light import Expose
from app.core.solver.shortfall import Aspect
from app.core.solver.style_signature import Relation, Signature
from app.core.solver.transport import Transport, load_named
from app.core.styles.style import Style, StyleLamp
from app.core.styles.style_pack import PACK_VERSION, PackHeader, StylePack
from app.core.styles.styles import mirror_name
from app.core.text import tr

_ENDING: Final = ".styles.npz"
_MAX_STYLES: Final = 512
_AGAIN: Final = tr("Reinstall Turnlight, or bake the head again with 'turnlight bake'.")


def pack_names() -> tuple[str, ...]:
    """Return the names of the heads whose style packs ship with the app."""
    files = (resources() / "transport").glob(f"*{_ENDING}")
    return tuple(sorted(f.name.removesuffix(_ENDING) for f in files))


def own_heads(folder: Path) -> tuple[Path, ...]:
    """Return the complete heads in a folder, which are transports that have a pack and a shape."""
    files = sorted(folder.glob("*.npz"))
    return tuple(
        file
        for file in files
        if not file.name.endswith((_ENDING, ".shape.npz", ".views.npz"))
        and pack_path(file) in files
        and shape_path(file) in files
    )


def load_named_pack(head: str) -> StylePack:
    """Load the style pack of a shipped head, or the pack next to one of the user's own transports.

    Args:
        head: Name of a shipped head, such as ``generic`` or ``generic-dark``, or the path of a
            transport ``T.npz`` (whose pack is ``T.styles.npz``).

    Raises:
        TransportError: If there is no such head or its pack cannot be read (see `load_pack`).
    """
    if head.endswith(".npz"):
        return load_pack(pack_path(Path(head)))
    if head not in pack_names():
        names = ", ".join(pack_names())
        raise TransportError(
            tr("There is no head {head!r}.", head=head),
            tr("Available heads: {names}.", names=names)
            if names
            else tr("No heads are installed. Reinstall Turnlight."),
        )
    path = resources() / "transport" / f"{head}{_ENDING}"
    return _shipped_pack(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=1)
def _shipped_pack(path: Path, _changed_ns: int) -> StylePack:
    """Load a shipped pack once, since measuring and solving a place need it several times."""
    return load_pack(path)


def load_transport_of(pack: StylePack, head: str) -> Transport:
    """Load the transport that belongs to a pack.

    Raises:
        TransportError: If the transport cannot be read or does not belong to the pack.
    """
    if head.endswith(".npz"):
        name = Path(head).name.removesuffix(_ENDING).removesuffix(".npz")
        head = str(Path(head).with_name(f"{name}.npz"))
    transport = load_named(head)
    if transport.digest != pack.header.transport_sha256:
        raise TransportError(
            tr("The style pack of {head!r} was made for a different transport.", head=head), _AGAIN
        )
    return transport


def pack_path(transport: Path) -> Path:
    """Return the path of the style pack next to a transport.

    Examples:
        >>> pack_path(Path("heads/anna.npz")).name, pack_path(Path("anna.styles.npz")).name
        ('anna.styles.npz', 'anna.styles.npz')
    """
    if transport.name.endswith(_ENDING):
        return transport
    return transport.with_name(transport.name.removesuffix(".npz") + _ENDING)


def save_pack(path: Path, pack: StylePack) -> str:
    """Save a pack atomically and return the SHA-256 checksum of the file."""
    arrays = {name: np.ascontiguousarray(getattr(pack, name)) for name in _SHAPES}
    twins = _twins(pack)
    header = {**asdict(pack.header), "styles": [asdict(style) for style in pack.styles]}

    def store(whole: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        for name, kind in _MIRRORED.items():
            whole[name] = np.delete(whole[name], [row for row, _ in twins[kind]], axis=0)
        for name in _ROWS:  # Bytes of equal significance side by side compress better.
            whole[name] = np.moveaxis(whole[name][..., None].view(np.uint8), -1, 0)
        return whole

    return write_sealed(path, arrays, {**header, "twins": twins}, store=store)


def restore(facts: Mapping[str, Any], contents: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Undo the packing done by `save_pack`, as the `restore` function of `read_sealed`."""
    for name in _ROWS:
        together = np.ascontiguousarray(np.moveaxis(contents[name], 0, -1))
        contents[name] = together.view(np.float32)[..., 0]
    for name, kind in _MIRRORED.items():
        whole: list[NDArray[Any]] = list(contents[name])
        for row, twin in sorted((int(row), int(twin)) for row, twin in facts["twins"][kind]):
            if not 0 <= twin < row <= len(whole):
                raise ValueError("a row is the mirror image of a missing row")
            whole.insert(row, whole[twin][:, ::-1])
        contents[name] = np.stack(whole)
    return contents


def _twins(pack: StylePack) -> dict[str, list[tuple[int, int]]]:
    """Return pairs (row, earlier row) in which the row exactly mirrors the earlier one."""
    styles = [style.name for style in pack.styles]
    return {
        "style": _pairs(pack, "style", styles, [mirror_name(name) for name in styles]),
        "area": _pairs(pack, "area", AREAS, [mirror_area(name) for name in AREAS]),
    }


def _pairs(
    pack: StylePack, kind: str, names: Sequence[str], mirrored: Sequence[str]
) -> list[tuple[int, int]]:
    pairs = [(row, names.index(m)) for row, m in enumerate(mirrored) if m in names[:row]]
    arrays = [getattr(pack, name) for name, of in _MIRRORED.items() if of == kind]
    return [
        (row, twin)
        for row, twin in pairs
        if all(np.array_equal(each[row], each[twin][:, ::-1]) for each in arrays)
    ]


def load_pack(path: Path) -> StylePack:
    """Load a style pack.

    Raises:
        TransportError: If the file is missing, damaged, made by a newer version or not a style
            pack.
    """
    facts, arrays = read_sealed(
        path,
        tr("style pack"),
        _AGAIN,
        PACK_VERSION,
        oldest=PACK_VERSION,
        names=_SHAPES,
        restore=restore,
    )
    try:
        header, styles = _header(facts), tuple(_style(entry) for entry in facts["styles"])
        _check(arrays, header, len(styles), path)
        # Earlier versions stored rows for the areas around the head.
        arrays["area_rows"][AROUND] = 0.0
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is not a style pack.", name=path.name), _AGAIN) from error
    return StylePack(header=header, styles=styles, studios=(), **arrays)


# Arrays of styles or areas, whose mirror images are flipped along the third axis.
_MIRRORED: Final = {
    "targets": "style",
    "target_rows": "style",
    "face_rows": "style",
    "area_rows": "area",
}
_ROWS: Final = ("target_rows", "face_rows", "area_rows", "basis_even", "basis_odd")

# Array names with their types and shapes: S styles, N picture, H and W environment, C rows for the
# environment's colours, Q both, A areas, h half of W, * any.
_SHAPES: Final[Mapping[str, tuple[str, str]]] = {
    "targets": ("f2", "SNN3"),
    "coverage": ("f2", "NN"),
    "region": ("f2", "NN"),
    "areas": ("f2", "ANN"),
    "mixing": ("f8", "23"),
    "mixtures": ("f8", "CH"),
    "target_rows": ("f4", "SQW"),
    "face_rows": ("f4", "SQW"),
    "area_rows": ("f4", "AQW"),
    "weight_norm": ("f8", "S"),
    "mean_rows": ("f4", "QW"),
    "basis_even": ("f4", "*Qh"),
    "basis_odd": ("f4", "*Qh"),
    "studio_ratio": ("f8", "S"),
}


def _check(arrays: Mapping[str, NDArray[Any]], header: PackHeader, styles: int, path: Path) -> None:
    """Reject arrays that contradict the header or are not finite."""
    height, width = header.environment
    sizes = {
        "S": styles,
        "N": header.picture,
        "H": height,
        "W": width,
        "h": width // 2,
        "2": 2,
        "3": 3,
    }
    sizes |= {"A": len(AREAS), "C": len(arrays["mixtures"])}
    sizes["Q"] = height + sizes["C"]
    fits = 0 < styles <= _MAX_STYLES and height > 0 and width == 2 * height
    for name, (kind, letters) in _SHAPES.items():
        array = arrays[name]
        fits = fits and array.dtype == np.dtype(kind) and array.ndim == len(letters)
        fits = fits and all(
            letter == "*" or size == sizes[letter]
            for letter, size in zip(letters, array.shape, strict=True)
        )
        fits = fits and array.size > 0 and bool(np.isfinite(array).all())
    if header.paired:
        fits = fits and len(arrays["basis_even"]) == len(arrays["basis_odd"])
    if not fits or not (arrays["studio_ratio"] > 0).all():
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN)


def _header(facts: Mapping[str, Any]) -> PackHeader:
    height, width = facts["environment"]
    return PackHeader(
        head=str(facts["head"]),
        skin=str(facts["skin"]),
        environment=(int(height), int(width)),
        picture=int(facts["picture"]),
        transport_sha256=str(facts["transport_sha256"]),
        basis_error=float(facts["basis_error"]),
        paired=bool(facts["paired"]),
        format_version=int(facts["format_version"]),
    )


def _relation(row: Mapping[str, Any]) -> Relation:
    # The packs of heads baked earlier say "nearly".
    values = {"soft" if key == "nearly" else key: value for key, value in row.items()}
    return Relation(**{**values, "aspect": Aspect(row["aspect"])})


def _style(entry: Mapping[str, Any]) -> Style:
    lamps = tuple(StyleLamp(**lamp) for lamp in entry["lamps"])
    if not all(math.isfinite(v) for lamp in entry["lamps"] for v in lamp.values()):
        raise ValueError("a lamp is not finite")
    facts = entry["signature"]
    relations = tuple(_relation(row) for row in facts["relations"])
    yes, soft = facts["match"]
    flags = (bool(facts[name]) for name in ("even", "areas"))
    signature = Signature(relations, (float(yes), float(soft)), *flags)
    if not all(r.bright in AREAS and r.dark in AREAS for r in relations):
        raise ValueError("a relation has an unknown area")
    keys = {
        name: entry[name] and (float(entry[name][0]), float(entry[name][1]))
        for name in ("key_elevation_deg", "key_azimuth_deg", "key_diameter_deg")
    }
    expose = entry.get("expose", "face")  # missing in the packs of heads baked earlier
    if expose not in get_args(Expose):
        raise ValueError("an exposure is unknown")
    return Style(**{**entry, "expose": expose, "lamps": lamps, "signature": signature, **keys})
