"""Packs heads, skins and hair small, as `app.core.portrait.head_file` reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.core.base.archive import write_sealed
from app.core.portrait.head import Hair, PortraitHead, PortraitSkin
from app.core.portrait.head_file import (
    COARSE_ARRAYS,
    HAIR_ARRAYS,
    HAIR_HALVES,
    HALF_ARRAYS,
    HEAD_ARRAYS,
    NODE_ARRAYS,
    ROOT_STEPS,
    SEEN_ARRAYS,
    UNIT_ARRAYS,
    VERSION,
)


def save_head(path: Path, head: PortraitHead) -> None:
    """Store a head, atomically."""
    arrays = {name: getattr(head, name) for name in HEAD_ARRAYS}
    arrays |= {name: getattr(head.nodes, name) for name in NODE_ARRAYS}
    arrays |= {name: getattr(head.seen, name) for name in SEEN_ARRAYS}
    arrays |= {name: np.round(arrays[name] * 32767).astype(np.int16) for name in UNIT_ARRAYS}
    arrays |= {name: arrays[name].astype(np.float16) for name in HALF_ARRAYS}
    arrays |= {name: np.packbits(arrays[name], axis=-1) for name in ("inside", "edge", "eye")}
    # By node: what one sees of the sky repeats.
    arrays["horizon"] = np.ascontiguousarray(arrays["horizon"].transpose(2, 0, 1))
    arrays["patches"] = arrays["patches"].astype(np.uint16)
    # Neighbours in the picture have neighbours on the skin: differences pack better.
    arrays["three"] = np.diff(arrays["three"].astype(np.int32), axis=0, prepend=0).astype(np.int16)
    arrays["weights"] = np.round(arrays["weights"] * 255).astype(np.uint8)
    for name in COARSE_ARRAYS:
        arrays[name] = np.clip(np.round(arrays[name] * 128), 0, 255).astype(np.uint8)
    arrays["glass"] = arrays["glass"].astype(np.int32)
    facts = {"format_version": VERSION, "half": head.inside.shape[1]}
    write_sealed(path, arrays, facts)


def save_skin(path: Path, skin: PortraitSkin) -> None:
    """Store a skin, atomically."""
    largest = np.maximum(skin.share.max(axis=0), 1e-9)
    share = np.round(np.sqrt(skin.share / largest) * 255).astype(np.uint8)
    arrays = {
        "source": skin.source.astype(np.uint16),
        "share": share,
        "largest": largest.astype(np.float32),
    }
    write_sealed(path, arrays, {"format_version": VERSION})


def save_hair(path: Path, hair: Hair) -> None:
    """Store hair, atomically."""
    arrays = {name: getattr(hair, name) for name in HAIR_ARRAYS}
    scale = np.abs(hair.basis).max(axis=0) + np.float32(1e-9)
    # Small values matter most: hair in the shade is seen beside the face, too.
    root = np.sign(hair.basis) * np.sqrt(np.abs(hair.basis) / scale)
    steps = np.round(root.T * ROOT_STEPS).astype(np.int8)
    arrays["basis"] = np.diff(steps, axis=1, prepend=np.int8(0))
    arrays["cells"] = hair.cells * scale[:, None, None]
    arrays["pixel"] = np.diff(hair.pixel.astype(np.int32), prepend=0)
    arrays["cover"] = np.round(hair.cover * 255).astype(np.uint8)
    arrays["colour"] = np.clip(np.round(hair.colour * 64), 0, 255).astype(np.uint8)
    arrays["shade"] = np.ascontiguousarray(hair.shade.transpose(2, 0, 1))
    arrays |= {name: arrays[name].astype(np.float16) for name in HAIR_HALVES}
    # Six of the ten bits are enough, and pack to two thirds.
    steps = arrays["cells"].view(np.uint16).astype(np.uint32) + 16
    arrays["cells"] = (steps & 0xFFE0).astype(np.uint16).view(np.float16)
    write_sealed(path, arrays, {"format_version": VERSION})
