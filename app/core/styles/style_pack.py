"""Style packs: the pre-integrated styles of a head, for solving without its transport.

A pack holds the pre-integrated targets F of eq. 3, the search basis for match, and the target
pictures to show. It is made by `bake` beside the transport and loads in a few milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import CONTRADICTIONS, read_sealed, write_sealed
from app.core.base.arrays import Bools, Float32, Float64, Floats
from app.core.base.errors import StyleError, TransportError
from app.core.base.paths import resources
from app.core.solver.face import AREAS, mirror_area
from app.core.solver.head_shape import shape_path
from app.core.solver.search import SearchTables, build_tables, seen_light
from app.core.solver.shortfall import Aspect
from app.core.solver.style_signature import Relation, Signature, Signatures
from app.core.solver.transport import Transport, load_named
from app.core.solver.weights import region_weights
from app.core.styles.lamps import AS_PUBLISHED, Studio
from app.core.styles.styles import Style, StyleLamp, mirror_name
from app.core.text import tr

PACK_VERSION: Final = 5
_ENDING: Final = ".styles.npz"
_MAX_STYLES: Final = 512
_AGAIN: Final = tr("Reinstall Turnlight, or bake it again with 'turnlight bake'.")

Float16: TypeAlias = NDArray[np.float16]


@dataclass(frozen=True, slots=True)
class PackHeader:
    """Origin of a pack.

    Attributes:
        environment: (H, W) of the environments it takes.
        picture: Side of the target pictures, pixels.
    """

    head: str
    skin: str
    environment: tuple[int, int]
    picture: int
    transport_sha256: str
    basis_error: float
    paired: bool = False
    format_version: int = PACK_VERSION


@dataclass(frozen=True)
class StylePack:
    """Pre-integrated styles of one head.

    Attributes:
        targets: (S, N, N, 3) float16. Linear Rec. 709 target pictures under the styles' own lamps,
            largest value 1.
        coverage: (N, N) float16. Share of each pixel that the head covers.
        region: (N, N) float16. How much each pixel counts for match and strength: the face.
        areas: (A, N, N) float16. The areas of signatures, see `app.core.solver.face.AREAS`.
        mixing, mixtures: (2, 3), (K, H) float64. How the search takes colours, see
            `app.core.solver.search.SearchColours`.
        target_rows: (S, Q, W) float32. F of eq. 3 over the whole head, as in the paper; panorama
            coordinates at turn 0, for light as the search sees it.
        face_rows: (S, Q, W) float32. The same over the face region.
        area_rows: (A, Q, W) float32. Pre-integrated means of the areas.
        weight_norm: (S,) float64. Norm of the weights over the face region.
        mean_rows: (Q, W) float32. Pre-integrated mean luminance of the face region.
        basis_even, basis_odd: (E, Q, W / 2), (O, Q, W / 2) float32. Search basis for the face's
            contrast.
        studio_ratio: (S,) float64. C / mean over the face region in the target picture itself: the
            denominator of strength.
        studios: Which lamps the targets are lit by, one for each style; none at all where all are
            lit as in the paper.
    """

    header: PackHeader
    styles: tuple[Style, ...]
    targets: Float16
    coverage: Float16
    region: Float16
    areas: Float16
    mixing: Float64
    mixtures: Float64
    target_rows: Float32
    face_rows: Float32
    area_rows: Float32
    weight_norm: Float64
    mean_rows: Float32
    basis_even: Float32
    basis_odd: Float32
    studio_ratio: Float64
    studios: tuple[Studio, ...] = ()

    @cached_property
    def tables(self) -> SearchTables:
        """The pack's targets and basis, transformed for the search."""
        return build_tables(
            self.target_rows,
            self.mean_rows,
            self.basis_even,
            self.basis_odd,
            paired=self.header.paired,
            others=np.concatenate([self.area_rows, self.face_rows]),
        )

    @cached_property
    def signatures(self) -> Signatures:
        """Signatures of all styles."""
        return Signatures(tuple(style.signature for style in self.styles))

    @cached_property
    def rivals(self) -> tuple[tuple[list[int], list[int]], ...]:
        """Rivals that may explain each style's picture; then those without its mirror image.

        What hardly lights the face goes with any light on it.
        """
        every = list(enumerate(self.styles))
        groups = []
        for row, style in every:
            alike = [n for n, s in every if s.signature.areas == style.signature.areas and n != row]
            twin = mirror_name(style.name)
            groups.append((alike, [n for n in alike if self.styles[n].name != twin]))
        return tuple(groups)

    @cached_property
    def rivalry(self) -> Bools:
        """(S, S): whether the style of a column may explain the picture of a row's."""
        table = np.zeros((len(self.styles), len(self.styles)), bool)
        for row, (alike, _) in enumerate(self.rivals):
            table[row, alike] = True
        return table

    @property
    def preintegrated(self) -> Float32:
        """(S, H, W) float32: F of eq. 3, panorama coordinates at turn 0, for grey light."""
        return self.target_rows[:, : self.header.environment[0]]

    def project(self, light: Floats) -> Float64:
        """Convert an environment to the rows that the search uses.

        Args:
            light: (H, W, 3) or (H, W) float. Linear Rec. 709 radiance at turn 0, or the luminance
                of grey light.

        Returns:
            (Q, W) float64. For `app.core.solver.search.curves`, in the unit of `light`.
        """
        return seen_light(light, self.mixing, self.mixtures)

    def region_on(self, transport: Transport) -> Float64:
        """(P,) float64: how much each pixel of the head counts for match and strength."""
        return self.region.ravel()[transport.pixels].astype(np.float64)

    def weights_on(self, transport: Transport) -> Float64:
        """(S, P) weights of all styles over what they are judged by, from the target pictures."""
        flat = self.targets.reshape(len(self.styles), -1, 3)[:, transport.pixels]
        luminance = flat.astype(np.float64) @ np.asarray(transport.header.luminance_weights)
        region = self.region_on(transport)
        regions = (judged_region(style, transport, region) for style in self.styles)
        return np.stack([region_weights(*each) for each in zip(luminance, regions, strict=True)])

    def index(self, name: str) -> int:
        """Return the index of a style.

        Raises:
            StyleError: If the pack has no style of that name.
        """
        for position, style in enumerate(self.styles):
            if style.name == name:
                return position
        raise StyleError(
            tr(
                "The head {head!r} has no target for the style {name!r}.",
                head=self.header.head,
                name=name,
            )
        )

    def studio(self, name: str) -> Studio:
        """Return the lamps of a style's target."""
        return self.studios[self.index(name)] if self.studios else AS_PUBLISHED

    def target(self, name: str) -> Float32:
        """Return the (N, N, 3) float32 linear Rec. 709 target picture of a style, largest 1."""
        return np.asarray(self.targets[self.index(name)].astype(np.float32))


def judged_region(style: Style, transport: Transport, region: Float64) -> Float64:
    """Return pixel weights, (P,): the face region, or the whole head for styles judged by areas."""
    return transport.face.astype(np.float64) if style.signature.areas else region


def pack_names() -> tuple[str, ...]:
    """Return the names of the heads whose style packs ship with the app."""
    files = (resources() / "transport").glob(f"*{_ENDING}")
    return tuple(sorted(f.name.removesuffix(_ENDING) for f in files))


def own_heads(folder: Path) -> tuple[Path, ...]:
    """Return the complete heads in a folder: transports with pack and shape."""
    files = sorted(folder.glob("*.npz"))
    return tuple(
        file
        for file in files
        if not file.name.endswith((_ENDING, ".shape.npz", ".views.npz"))
        and pack_path(file) in files
        and shape_path(file) in files
    )


def load_named_pack(head: str) -> StylePack:
    """Load the style pack of a shipped head, or the one beside a transport of the user's own.

    Args:
        head: Name of a shipped head, e.g. ``generic`` or ``generic-dark``, or the path of a
            transport ``T.npz`` (whose pack is ``T.styles.npz``).

    Raises:
        TransportError: If there is no such head, or its pack cannot be read (see `load_pack`).
    """
    if head.endswith(".npz"):
        return load_pack(pack_path(Path(head)))
    if head not in pack_names():
        names = ", ".join(pack_names())
        raise TransportError(
            tr("There is no head called {head!r}.", head=head),
            tr("Known heads: {names}.", names=names)
            if names
            else tr("None is installed; reinstall Turnlight."),
        )
    return load_pack(resources() / "transport" / f"{head}{_ENDING}")


def load_transport_of(pack: StylePack, head: str) -> Transport:
    """Load the transport of a pack.

    Raises:
        TransportError: If the transport cannot be read, or is another one.
    """
    if head.endswith(".npz"):
        name = Path(head).name.removesuffix(_ENDING).removesuffix(".npz")
        head = str(Path(head).with_name(f"{name}.npz"))
    transport = load_named(head)
    if transport.digest != pack.header.transport_sha256:
        raise TransportError(
            tr("The style pack of {head!r} belongs to another transport.", head=head), _AGAIN
        )
    return transport


def pack_path(transport: Path) -> Path:
    """Return the path of the style pack beside a transport.

    Examples:
        >>> pack_path(Path("heads/anna.npz")).name, pack_path(Path("anna.styles.npz")).name
        ('anna.styles.npz', 'anna.styles.npz')
    """
    if transport.name.endswith(_ENDING):
        return transport
    return transport.with_name(transport.name.removesuffix(".npz") + _ENDING)


def save_pack(path: Path, pack: StylePack) -> str:
    """Save a pack atomically; return its SHA-256."""
    arrays = {name: np.ascontiguousarray(getattr(pack, name)) for name in _SHAPES}
    twins = _twins(pack)
    header = {**asdict(pack.header), "styles": [asdict(style) for style in pack.styles]}

    def store(whole: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        for name, kind in _MIRRORED.items():
            whole[name] = np.delete(whole[name], [row for row, _ in twins[kind]], axis=0)
        for name in _ROWS:  # Bytes of a kind side by side take less room in a zip file.
            whole[name] = np.moveaxis(whole[name][..., None].view(np.uint8), -1, 0)
        return whole

    return write_sealed(path, arrays, {**header, "twins": twins}, store=store)


def restore(facts: Mapping[str, Any], contents: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Undo what `save_pack` does to store a pack, for `read_sealed`."""
    for name in _ROWS:
        together = np.ascontiguousarray(np.moveaxis(contents[name], 0, -1))
        contents[name] = together.view(np.float32)[..., 0]
    for name, kind in _MIRRORED.items():
        whole: list[NDArray[Any]] = list(contents[name])
        for row, twin in sorted((int(row), int(twin)) for row, twin in facts["twins"][kind]):
            if not 0 <= twin < row <= len(whole):
                raise ValueError("something is the mirror image of what is not there")
            whole.insert(row, whole[twin][:, ::-1])
        contents[name] = np.stack(whole)
    return contents


def rounded(rows: Float32, digits: int = 17) -> Float32:
    """Round to a number of binary digits, so that files compress better."""
    last = 1 << (24 - digits)
    bits = np.ascontiguousarray(rows).view(np.uint32)
    return ((bits + np.uint32(last // 2)) & np.uint32(2**32 - last)).view(np.float32)


def _twins(pack: StylePack) -> dict[str, list[tuple[int, int]]]:
    """Rows that are exact mirror images of an earlier one, with it: they need not be stored."""
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
        TransportError: If the file is missing, damaged, made by a newer version, or not a style
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
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is not a style pack.", name=path.name), _AGAIN) from error
    return StylePack(header=header, styles=styles, studios=(), **arrays)


# Arrays of styles or areas whose mirror images are flipped along the next axis but one.
_MIRRORED: Final = {
    "targets": "style",
    "target_rows": "style",
    "face_rows": "style",
    "area_rows": "area",
}
_ROWS: Final = ("target_rows", "face_rows", "area_rows", "basis_even", "basis_odd")

# Array names with their types and shapes: S styles, N picture, H and W environment, C rows for
# its colours, Q both, A areas, h half of W, * any.
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
    """Refuse arrays that contradict the header, or hold numbers that are not finite."""
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
        raise TransportError(tr("{name} contradicts itself.", name=path.name), _AGAIN)


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


def _style(entry: Mapping[str, Any]) -> Style:
    lamps = tuple(StyleLamp(**lamp) for lamp in entry["lamps"])
    if not all(math.isfinite(v) for lamp in entry["lamps"] for v in lamp.values()):
        raise ValueError("a lamp is not finite")
    facts = entry["signature"]
    relations = tuple(
        Relation(**{**relation, "aspect": Aspect(relation["aspect"])})
        for relation in facts["relations"]
    )
    yes, nearly = facts["match"]
    flags = (bool(facts[name]) for name in ("even", "areas"))
    signature = Signature(relations, (float(yes), float(nearly)), *flags)
    if not all(r.bright in AREAS and r.dark in AREAS for r in relations):
        raise ValueError("a relation has an area that is not known")
    keys = {
        name: entry[name] and (float(entry[name][0]), float(entry[name][1]))
        for name in ("key_elevation_deg", "key_azimuth_deg", "key_diameter_deg")
    }
    return Style(**{**entry, "lamps": lamps, "signature": signature, **keys})
