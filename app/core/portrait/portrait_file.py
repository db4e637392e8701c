"""Load and check the heads, skins and hair for portraits, packed by `scenes/portraits/files.py`."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import CONTRADICTIONS, read_sealed
from app.core.base.errors import TransportError
from app.core.base.paths import resources
from app.core.portrait.light import grid
from app.core.portrait.portrait_head import (
    SKY,
    Hair,
    PortraitHead,
    PortraitSkin,
    SeenNodes,
    SkinNodes,
)
from app.core.portrait.turned_portrait import seen_from, with_aside
from app.core.text import tr

VERSION: Final = 1
_AGAIN: Final = tr("Reinstall Turnlight.")
_MOST_BYTES: Final = 1 << 27
_MOST_NODES: Final = 1 << 15
_MOST_SIDE: Final = 2048
UNIT_ARRAYS: Final = ("normals", "view", "way", "glass_way")
"""Arrays of unit vectors, stored with 16 bits per component."""
HALF_ARRAYS: Final = ("gain", "glass_gain")
COARSE_ARRAYS: Final = ("albedo", "detail")
"""Arrays stored in steps of 1/128."""
NODE_ARRAYS: Final = ("normals", "horizon", "eye", "profile", "patches")
SEEN_ARRAYS: Final = ("view", "gain", "way")
HEAD_ARRAYS: Final = (
    *("inside", "edge", "three", "weights", "albedo", "detail"),
    *("glass", "glass_gain", "glass_way"),
)
HAIRS: Final = ("short", "long")
PLAIN: Final = "plain"
ROOT_STEPS: Final = 63  # steps of the square root of a basis function, for either sign
HAIR_ARRAYS: Final = ("pixel", "cover", "colour", "basis", "cells", "gain", "glass_gain", "shade")


def _file(*parts: str) -> Path:
    return resources() / "portraits" / ("-".join(parts) + ".npz")


def load_portrait(
    head: str, skin: str, hair: str = PLAIN, yaw_deg: float = 0.0
) -> tuple[PortraitHead, PortraitSkin] | None:
    """Load the portrait of a shipped head. The last two portraits are cached.

    Args:
        hair: One of `HAIRS`, or `PLAIN`.
        yaw_deg: Turn of the face towards the sitter's left, in degrees. It must be one of the yaws
            of the baked views, with either sign.

    Returns:
        The head and its skin, or None if no portrait with this head and skin is shipped.

    Raises:
        TransportError: If a file is damaged, made by a newer version, or not a portrait file.
    """
    return _seen_aside(head, skin, hair, yaw_deg) if yaw_deg else _straight(head, skin, hair)


@lru_cache(maxsize=2)
def _straight(head: str, skin: str, hair: str) -> tuple[PortraitHead, PortraitSkin] | None:
    shape_path, skin_path, hair_path = _file(head), _file(head, skin), _file(head, "hair", hair)
    if not (shape_path.exists() and skin_path.exists()):
        return None
    shape = _load_head(shape_path)
    tone = _load_skin(skin_path, shape)
    dressed = hair != PLAIN and hair_path.exists()
    return shape.dressed(_load_hair(hair_path, shape)) if dressed else shape.plain(), tone


@lru_cache(maxsize=3)
def _seen_aside(
    head: str, skin: str, hair: str, yaw_deg: float
) -> tuple[PortraitHead, PortraitSkin] | None:
    path, front = _file(head, "aside"), _straight(head, skin, hair)
    if front is None or not path.exists():
        return None
    try:
        (nodes, tone, straight), frames, arrays = _aside(head, skin, hair)
        end = f"_{abs(yaw_deg):g}"
        own = {name.removesuffix(end): one for name, one in arrays.items() if name.endswith(end)}
        aside = seen_from(nodes, straight, arrays | own, frames[end], yaw_deg, skin)
        bald = front[0].hair is None
        return aside.plain() if bald else replace(aside, hair=_hair(arrays | own, aside)), tone
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN) from error


@lru_cache(maxsize=1)
def _aside(head: str, skin: str, hair: str) -> tuple[Any, Any, dict[str, NDArray[Any]]]:
    """Return the data shared by all views of a head: nodes and skin, cameras, and file contents."""
    front = _straight(head, skin, hair)
    assert front is not None
    facts, arrays = _read(_file(head, "aside"))
    more = _skin(_read(_file(head, skin, "aside"))[1])
    if front[0].hair is not None:
        arrays |= _read(_file(head, "hair", hair, "aside"))[1]
    return with_aside(*front, arrays, more), facts["frames"], arrays


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
        head = PortraitHead(nodes, _visible_nodes(nodes, values), **values)
        if not _fits(head):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN) from error
    return head


def _visible_nodes(nodes: SkinNodes, values: dict[str, Any]) -> SeenNodes:
    """Return the visible nodes, which come first in the data, and remove them from `values`."""
    view, gain, way = (values.pop(name) for name in SEEN_ARRAYS)
    count, even = len(view), np.ones((len(view), 3), np.float32)
    normals, eye = nodes.normals[:count], nodes.eye[:count]
    return SeenNodes(np.arange(count), normals, view, gain, way, eye, even)


def _fits(head: PortraitHead) -> bool:
    nodes, visible, glass = head.nodes, head.visible, len(head.glass)
    count, visible_count, samples = len(nodes.normals), len(visible.index), len(head.three)
    threes = [(nodes.normals, count), (visible.view, visible_count), (visible.way, visible_count)]
    threes += [(head.weights, samples), (head.albedo, samples), (head.glass_way, glass)]
    ones = [(visible.gain, visible_count), (head.detail, samples), (head.glass_gain, glass)]
    return (
        0 < visible_count <= count <= _MOST_NODES
        and all(values.shape == (number, 3) for values, number in threes)
        and all(values.shape == (number,) for values, number in ones)
        and nodes.horizon.shape == (*SKY, count)
        and nodes.horizon.dtype == np.int8
        and (nodes.profile.shape, nodes.patches.shape) == ((3,), (count, 2))
        and head.three.shape == (samples, 3)
        and head.edge.shape == head.inside.shape
        and max(head.inside.shape) <= _MOST_SIDE
        and samples == int(head.inside.sum()) + 4 * int(head.edge.sum())
        and int(head.three.max()) < visible_count
        and 0 <= int(head.glass.min(initial=0)) <= int(head.glass.max(initial=0)) < samples
    )


def _load_skin(path: Path, head: PortraitHead) -> PortraitSkin:
    _, arrays = _read(path)
    try:
        skin = _skin(arrays)
        if not skin.fits(head.nodes, len(head.visible.index)):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN) from error
    return skin


def _skin(arrays: dict[str, NDArray[Any]]) -> PortraitSkin:
    share = np.square(arrays["share"].astype(np.float32) / np.float32(255)) * arrays["largest"]
    return PortraitSkin(arrays["source"].astype(np.intp), share)


def _load_hair(path: Path, head: PortraitHead) -> Hair:
    _, arrays = _read(path)
    try:
        arrays["shade"] = np.ascontiguousarray(arrays["shade"].transpose(1, 2, 0))
        hair = _hair(arrays, head)
        if not (
            hair.shade.shape == head.nodes.horizon.shape
            and hair.gain.shape == head.visible.gain.shape
            and hair.glass_gain.shape == head.glass_gain.shape
        ):
            raise ValueError("sizes")
    except CONTRADICTIONS as error:
        raise TransportError(tr("{name} is inconsistent.", name=path.name), _AGAIN) from error
    return hair


def _hair(arrays: dict[str, NDArray[Any]], head: PortraitHead) -> Hair:
    """Return the stored hair for the picture of a head.

    Raises:
        ValueError: If the hair does not fit the picture.
    """
    names = [name for name in HAIR_ARRAYS if name in arrays]
    values: dict[str, Any] = {name: arrays[name].astype(np.float32) for name in names}
    values["shade"] = arrays["shade"]
    steps = np.cumsum(arrays["basis"], axis=1, dtype=np.int8).T
    root = steps.astype(np.float32) / np.float32(ROOT_STEPS)
    values["basis"] = np.ascontiguousarray(root * np.abs(root))
    values["pixel"] = np.cumsum(arrays["pixel"]).astype(np.intp)
    values["cover"] /= np.float32(255)
    values["colour"] /= np.float32(64)
    hair = Hair(**values)
    count, rank = len(hair.pixel), hair.basis.shape[1]
    if not (
        hair.cover.shape == (count,)
        and hair.colour.shape == (count, 3)
        and hair.basis.shape == (count, rank)
        and hair.cells.shape == (rank, len(grid()[0]), 3)
        and int(hair.pixel.min()) >= 0
        and int(hair.pixel.max()) < head.inside.size
    ):
        raise ValueError("sizes")
    return hair


def _read(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    return read_sealed(path, tr("portrait"), _AGAIN, VERSION, most=_MOST_BYTES)
