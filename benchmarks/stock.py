"""Reference pictures by Mitsuba's own ``volpathmis``, lit by exactly the texels T knows."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from app.core.baking.scene import Camera, HeadMesh, build_scene, frame_head, load_head  # noqa: E402
from app.core.baking.skin import find_skin  # noqa: E402
from app.core.environment import enlarge, read_environment, reduce  # noqa: E402

Float32 = NDArray[np.float32]

# Mitsuba places row i of an envmap at i / (H - 1) and interpolates; on a grid this fine that is
# less than a thirtieth of a texel of T.
FINE = (512, 1024)
INDOORS = (
    "brown_photostudio_02_1k.hdr",
    "empty_warehouse_01_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "leadenhall_market_1k.hdr",
    "drachenfels_cellar_1k.hdr",
)


def generic_head() -> tuple[HeadMesh, Camera]:
    """The default head and its camera at 100 x 100 pixels."""
    heads = ROOT / "resources" / "heads"
    head = load_head("generic", heads / "generic.ply", heads / "generic-eyes.ply")
    return head, frame_head(head, 100)


def stock_picture(
    head: HeadMesh, camera: Camera, skin: str, light: Float32, paths: int, seed: int
) -> Float32:
    """Render a head with stock Mitsuba.

    Parameters
    ----------
    light : (32, 64, 3) float32
        Linear radiance at turn 0.
    paths : int
        Samples per pixel.

    Returns
    -------
    (N, N, 3) float32
        Linear; what shows behind the head is the environment.
    """
    import mitsuba as mi

    bitmap = mi.Bitmap(np.ascontiguousarray(enlarge(light, FINE)))
    envmap: dict[str, Any] = {"type": "envmap", "bitmap": bitmap}
    scene = build_scene(head, find_skin(skin), camera, {"light": envmap})
    return np.array(mi.render(scene, spp=paths, seed=seed), np.float32)


def read_light(path: Path) -> Float32:
    """A panorama reduced to 64 x 32 texels, scaled to mean radiance 1."""
    light = reduce(read_environment(path))
    scaled: Float32 = (light / light.mean()).astype(np.float32)
    return scaled
