"""Pack heads, skins and hair for `app.core.portrait.portrait_file`."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.archive import write_sealed
from app.core.portrait.portrait_file import (
    COARSE_ARRAYS,
    HAIR_ARRAYS,
    HALF_ARRAYS,
    HEAD_ARRAYS,
    NODE_ARRAYS,
    ROOT_STEPS,
    SEEN_ARRAYS,
    UNIT_ARRAYS,
    VERSION,
)
from app.core.portrait.portrait_head import Hair, PortraitHead, PortraitSkin
from app.core.portrait.turned_portrait import COLOUR_STEPS


def _save(path: Path, arrays: Mapping[str, NDArray[Any]], facts: Mapping[str, Any]) -> None:
    write_sealed(path, arrays, facts, packing=zipfile.ZIP_LZMA)


def save_aside(
    path: Path, arrays: Mapping[str, NDArray[Any]], facts: Mapping[str, Any], quality: int
) -> None:
    """Store a head from the side, atomically.

    Args:
        arrays: Arrays for `turned_portrait`. Colours, (h, w, 3), and details, (h, w), are packed as
            pictures of this quality, and so are the three nodes around each sample, (S, 3).
    """
    stored = dict(arrays)
    for name, values in arrays.items():
        if name.startswith(("albedo_", "detail_")):
            steps = np.clip(np.round(values * COLOUR_STEPS), 0, 255).astype(np.uint8)
            steps = steps[..., ::-1] if steps.ndim == 3 else steps
            _, stored[name] = cv2.imencode(".webp", steps, [cv2.IMWRITE_WEBP_QUALITY, quality])
    # Views show the same triangles; the order of corners is irrelevant.
    names = [name for name in arrays if name.startswith("three_")]
    three = np.sort(np.concatenate([stored.pop(name) for name in names]), axis=1)
    triangles, place = np.unique(three, axis=0, return_inverse=True)
    ends = np.cumsum([len(arrays[name]) for name in names])
    for name, part in zip(names, np.split(place.ravel(), ends[:-1]), strict=True):
        stored[name.replace("three", "triangle")] = part.astype(np.uint16)
    apart = np.diff(triangles.astype(np.int32), axis=0, prepend=0)
    stored["triangles"] = apart.astype(np.int16)
    _save(path, stored, {"format_version": VERSION, **facts})


def save_head(path: Path, head: PortraitHead) -> None:
    """Store a head, atomically."""
    arrays = {name: getattr(head, name) for name in HEAD_ARRAYS}
    arrays |= {name: getattr(head.nodes, name) for name in NODE_ARRAYS}
    arrays |= {name: getattr(head.visible, name) for name in SEEN_ARRAYS}
    arrays |= {name: np.round(arrays[name] * 32767).astype(np.int16) for name in UNIT_ARRAYS}
    arrays |= {name: arrays[name].astype(np.float16) for name in HALF_ARRAYS}
    arrays |= {name: np.packbits(arrays[name], axis=-1) for name in ("inside", "edge", "eye")}
    # By node: the sky visible from one repeats.
    arrays["horizon"] = np.ascontiguousarray(arrays["horizon"].transpose(2, 0, 1))
    arrays["patches"] = arrays["patches"].astype(np.uint16)
    # Neighbours in the picture have neighbours on the skin: differences compress better.
    arrays["three"] = np.diff(arrays["three"].astype(np.int32), axis=0, prepend=0).astype(np.int16)
    arrays["weights"] = np.round(arrays["weights"] * 255).astype(np.uint8)
    for name in COARSE_ARRAYS:
        arrays[name] = np.clip(np.round(arrays[name] * 128), 0, 255).astype(np.uint8)
    arrays["glass"] = arrays["glass"].astype(np.int32)
    facts = {"format_version": VERSION, "half": head.inside.shape[1]}
    _save(path, arrays, facts)


def save_skin(path: Path, skin: PortraitSkin) -> None:
    """Store a skin, atomically."""
    largest = np.maximum(skin.share.max(axis=0), 1e-9)
    share = np.round(np.sqrt(skin.share / largest) * 255).astype(np.uint8)
    arrays = {
        "source": skin.source.astype(np.uint16),
        "share": share,
        "largest": largest.astype(np.float32),
    }
    _save(path, arrays, {"format_version": VERSION})


def save_hair(path: Path, hair: Hair) -> None:
    """Store hair, atomically."""
    arrays = {name: getattr(hair, name) for name in HAIR_ARRAYS}
    scale = _largest(hair.basis)
    stored = {
        **arrays,
        **_pixels(arrays, scale, ROOT_STEPS),
        "cells": _cells(hair.cells, scale),
        "gain": hair.gain.astype(np.float16),
        "glass_gain": hair.glass_gain.astype(np.float16),
        "shade": np.ascontiguousarray(hair.shade.transpose(2, 0, 1)),
    }
    _save(path, stored, {"format_version": VERSION})


def save_hair_aside(
    path: Path,
    shade: NDArray[np.int8],
    cells: NDArray[np.float32],
    views: Mapping[str, Mapping[str, NDArray[Any]]],
    steps: int,
) -> None:
    """Store hair from the side, atomically.

    Args:
        shade: (N, 32, 64) int8. As for `app.core.portrait.turned_portrait`.
        cells: (R, G, 3) float32. Of all views.
        views: "pixel", "cover", "colour" and "basis" of `Hair`, by the suffix of their names.
        steps: Steps of the square root of a basis function, for either sign.
    """
    scale = _largest(np.concatenate([view["basis"] for view in views.values()]))
    arrays: dict[str, NDArray[Any]] = {"shade": shade, "cells": _cells(cells, scale)}
    for end, view in views.items():
        stored = _pixels(view, scale, steps)
        arrays |= {name + end: values for name, values in stored.items()}
    _save(path, arrays, {"format_version": VERSION})


def _largest(basis: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(np.abs(basis).max(axis=0) + np.float32(1e-9))


def _pixels(
    arrays: Mapping[str, NDArray[Any]], scale: NDArray[np.float32], steps: int
) -> dict[str, NDArray[Any]]:
    """Return the stored data for each pixel of hair."""
    basis, coarse = arrays["basis"], ROOT_STEPS // steps
    # Small values matter most: hair in the shade is visible beside the face, too.
    root = np.sign(basis) * np.sqrt(np.abs(basis) / scale)
    rounded = (np.round(root.T * ROOT_STEPS / coarse) * coarse).astype(np.int8)
    return {
        "basis": np.diff(rounded, axis=1, prepend=np.int8(0)),
        "pixel": np.diff(arrays["pixel"].astype(np.int32), prepend=0),
        "cover": np.round(arrays["cover"] * 255).astype(np.uint8),
        "colour": np.clip(np.round(arrays["colour"] * 64), 0, 255).astype(np.uint8),
    }


def _cells(cells: NDArray[np.float32], scale: NDArray[np.float32]) -> NDArray[np.float16]:
    # Six of the ten bits are enough, and compress to two thirds.
    bits = (cells * scale[:, None, None]).astype(np.float16).view(np.uint16).astype(np.uint32) + 16
    return (bits & 0xFFE0).astype(np.uint16).view(np.float16)
