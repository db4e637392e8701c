"""Heads, skins and hair for portraits, as `scripts/portraits/files.py` packs them; checked."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import CONTRADICTIONS, read_sealed
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.portrait.head import SKY, Hair, PortraitHead, PortraitSkin, SeenNodes, SkinNodes
from app.core.portrait.light import grid
from app.core.text import tr

VERSION: Final = 1
_AGAIN: Final = tr("Reinstall Turnlight.")
_MOST_BYTES: Final = 1 << 27
_MOST_NODES: Final = 1 << 15
_MOST_SIDE: Final = 2048
UNIT_ARRAYS: Final = ("normals", "view", "way", "glass_way")
"""Unit vectors, stored as 16 bits of each part."""
HALF_ARRAYS: Final = ("gain", "glass_gain")
COARSE_ARRAYS: Final = ("albedo", "detail")
"""Stored in steps of 1/128."""
NODE_ARRAYS: Final = ("normals", "horizon", "eye", "profile", "patches")
SEEN_ARRAYS: Final = ("view", "gain", "way")
HEAD_ARRAYS: Final = (
    *("inside", "edge", "three", "weights", "albedo", "detail"),
    *("glass", "glass_gain", "glass_way"),
)
HAIRS: Final = ("short", "long")
PLAIN: Final = "plain"
ROOT_STEPS: Final = 63  # steps of the root of a basis function, either way
HAIR_HALVES: Final = ("cells", "gain", "glass_gain")
HAIR_ARRAYS: Final = ("pixel", "cover", "colour", "basis", "shade", *HAIR_HALVES)


def _file(*parts: str) -> Path:
    return resources() / "portraits" / ("-".join(parts) + ".npz")


@lru_cache(maxsize=2)
def load_portrait(
    head: str, skin: str, hair: str = PLAIN
) -> tuple[PortraitHead, PortraitSkin] | None:
    """Load the portrait of a head that ships; the two last used stay in memory.

    Args:
        hair: One of `HAIRS`, or `PLAIN`.

    Returns:
        None if no portrait of this head and skin ships.

    Raises:
        TransportError: If a file is damaged, made by a newer version, or something else.
    """
    shape_path, skin_path, hair_path = _file(head), _file(head, skin), _file(head, "hair", hair)
    if not (shape_path.exists() and skin_path.exists()):
        return None
    shape = _load_head(shape_path)
    tone = _load_skin(skin_path, shape)
    dressed = hair != PLAIN and hair_path.exists()
    return shape.dressed(_load_hair(hair_path, shape)) if dressed else shape.plain(), tone


def _load_head(path: Path) -> PortraitHead:
    facts, arrays = _read(path)
    try:
        count, half = len(arrays["normals"]), int(facts["half"])
        values: dict[str, Any] = {
            name: arrays[name] for name in (*NODE_ARRAYS, *SEEN_ARRAYS, *HEAD_ARRAYS)
        }
        values |= {
            name: arrays[name].astype(np.float32) / np.float32(32767) for name in UNIT_ARRAYS
        }
        values |= {name: arrays[name].astype(np.float32) for name in HALF_ARRAYS}
        for name, size in (("inside", half), ("edge", half), ("eye", count)):
            values[name] = np.unpackbits(arrays[name], axis=-1, count=size).astype(bool)
        values["horizon"] = np.ascontiguousarray(arrays["horizon"].transpose(1, 2, 0))
        values["patches"] = arrays["patches"].astype(np.intp)
        # Differences may wrap around; their sum is right again in 16 bits.
        three = np.cumsum(arrays["three"], axis=0, dtype=np.int16)
        values["three"] = three.view(np.uint16).astype(np.intp)
        values["weights"] = arrays["weights"].astype(np.float32) / np.float32(255)
        values |= {name: arrays[name] / np.float32(128) for name in COARSE_ARRAYS}
        values["glass"] = arrays["glass"].astype(np.intp)
        nodes = SkinNodes(**{name: values.pop(name) for name in NODE_ARRAYS})
        head = PortraitHead(nodes, _seen(nodes, values), **values)
        if not _fits(head):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} contradicts itself.", name=path.name), _AGAIN) from error
    return head


def _seen(nodes: SkinNodes, values: dict[str, Any]) -> SeenNodes:
    """The first of all nodes; takes what it needs out of `values`."""
    view, gain, way = (values.pop(name) for name in SEEN_ARRAYS)
    first = slice(len(view))
    return SeenNodes(np.arange(len(view)), nodes.normals[first], view, gain, way, nodes.eye[first])


def _fits(head: PortraitHead) -> bool:
    nodes, glass = head.nodes, len(head.glass)
    count, shown, samples = len(nodes.normals), len(head.seen.index), len(head.three)
    known = {name: getattr(nodes, name) for name in NODE_ARRAYS}
    known |= {name: getattr(head.seen, name) for name in SEEN_ARRAYS}
    known |= {name: getattr(head, name) for name in HEAD_ARRAYS}
    wanted = {
        "normals": (count, 3),
        "horizon": (*SKY, count),
        "profile": (3,),
        "patches": (count, 2),
        "view": (shown, 3),
        "gain": (shown,),
        "way": (shown, 3),
        "edge": head.inside.shape,
        "three": (samples, 3),
        "weights": (samples, 3),
        "albedo": (samples, 3),
        "detail": (samples,),
        "glass_gain": (glass,),
        "glass_way": (glass, 3),
    }
    return (
        0 < shown <= count <= _MOST_NODES
        and all(known[name].shape == shape for name, shape in wanted.items())
        and nodes.horizon.dtype == np.int8
        and max(head.inside.shape) <= _MOST_SIDE
        and samples == int(head.inside.sum()) + 4 * int(head.edge.sum())
        and int(head.three.max()) < shown
        and 0 <= int(head.glass.min(initial=0)) <= int(head.glass.max(initial=0)) < samples
    )


def _load_skin(path: Path, head: PortraitHead) -> PortraitSkin:
    _, arrays = _read(path)
    try:
        source = arrays["source"].astype(np.intp)
        share = np.square(arrays["share"].astype(np.float32) / np.float32(255)) * arrays["largest"]
        sources = 2 * (
            len(head.nodes.normals) + sum(len(starts) for _, starts, _ in head.nodes.patch_shares)
        )
        if not (
            source.shape == share.shape[:2]
            and share.shape[2:] == (3,)
            and source.shape[1] == len(head.seen.index)
            and int(source.max()) < sources
        ):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} contradicts itself.", name=path.name), _AGAIN) from error
    return PortraitSkin(source, share)


def _load_hair(path: Path, head: PortraitHead) -> Hair:
    _, arrays = _read(path)
    try:
        values: dict[str, Any] = {name: arrays[name] for name in HAIR_ARRAYS}
        steps = np.cumsum(arrays["basis"], axis=1, dtype=np.int8).T
        root = steps.astype(np.float32) / np.float32(ROOT_STEPS)
        values["basis"] = np.ascontiguousarray(root * np.abs(root))
        values["pixel"] = np.cumsum(arrays["pixel"]).astype(np.intp)
        values["cover"] = arrays["cover"].astype(np.float32) / np.float32(255)
        values["colour"] = arrays["colour"].astype(np.float32) / np.float32(64)
        values["shade"] = np.ascontiguousarray(arrays["shade"].transpose(1, 2, 0))
        values |= {name: arrays[name].astype(np.float32) for name in HAIR_HALVES}
        hair = Hair(**values)
        count, rank = len(hair.pixel), hair.basis.shape[1]
        if not (
            hair.cover.shape == (count,)
            and hair.colour.shape == (count, 3)
            and hair.basis.shape == (count, rank)
            and hair.cells.shape == (rank, len(grid()[0]), 3)
            and hair.shade.shape == head.nodes.horizon.shape
            and hair.gain.shape == head.seen.gain.shape
            and hair.glass_gain.shape == head.glass_gain.shape
            and int(hair.pixel.min()) >= 0
            and int(hair.pixel.max()) < head.inside.size
        ):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} contradicts itself.", name=path.name), _AGAIN) from error
    return hair


def _read(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    return read_sealed(path, tr("portrait"), _AGAIN, VERSION, most=_MOST_BYTES)
