"""Reference pictures by Mitsuba's own ``volpathmis``, lit by exactly T's texels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.scene import Camera, HeadMesh, build_scene, frame_head, load_head, sensor
from app.core.baking.skin import find_skin
from app.core.environment.environment import enlarge, read_environment, reduce

if TYPE_CHECKING:
    from app.core.base.colour import FloatImage

ROOT = Path(__file__).resolve().parents[2]


Float32 = NDArray[np.float32]

# Mitsuba places row i of an envmap at i / (H - 1) and interpolates; on 1024 x 512 that made light
# from the zenith 1.2 % dimmer in a market hall. On a grid this fine it is less than a hundredth of
# a texel of T.
FINE = (2048, 4096)
INDOORS = (
    "brown_photostudio_02_1k.hdr",
    "empty_warehouse_01_1k.hdr",
    "st_fagans_interior_1k.hdr",
    "leadenhall_market_1k.hdr",
    "drachenfels_cellar_1k.hdr",
)


def generic_head() -> tuple[HeadMesh, Camera]:
    """Return the default head and its camera at 100 x 100 pixels."""
    heads = ROOT / "resources" / "heads"
    head = load_head("generic", heads / "generic.ply", heads / "generic-eyes.ply")
    return head, frame_head(head, 100)


def as_placed(light: Float32, rows: int) -> Float32:
    """Return an environment as Mitsuba sees it when its rows are repeated.

    Row i is at elevation 90 - 180 i / (rows - 1) there, and light between rows is interpolated.

    Args:
        light: (H, W, 3) float32. Linear radiance.
        rows: Rows of the repeated environment, a multiple of H.

    Returns:
        (H, W, 3) float32. Mean over each texel, by solid angle.
    """
    height, count = light.shape[0], 400
    mixing = np.zeros((height, height))
    for row in range(height):
        polar = (row + (np.arange(count) + 0.5) / count) / height * np.pi
        share = np.sin(polar) / np.sin(polar).sum()
        place = polar / np.pi * (rows - 1)
        first = np.clip(place.astype(int), 0, rows - 2)
        np.add.at(mixing[row], first * height // rows, share * (first + 1 - place))
        np.add.at(mixing[row], (first + 1) * height // rows, share * (place - first))
    return np.asarray(np.einsum("rs,scx->rcx", mixing, light), np.float32)


def stock_picture(
    head: HeadMesh,
    camera: Camera,
    skin: str,
    light: Float32,
    paths: int,
    seed: int,
    fine: tuple[int, int] = FINE,
    *,
    sample_light: bool = True,
    part: tuple[slice, slice] | None = None,
) -> Float32:
    """Render a head with stock Mitsuba.

    Args:
        light: (32, 64, 3) float32. Linear radiance at turn 0.
        paths: Samples per pixel.
        fine: Rows and columns to which the environment is repeated.
        sample_light: Whether the integrator also samples lights explicitly, its default. Otherwise,
            paths hit light only by chance. They may then end early (the roulette that `build_scene`
            delays does no harm), so that the same noise takes a third of the time.
        part: Rows and columns to render; None for all.

    Returns:
        (N, N, 3) float32. Linear; the background is the environment.
    """
    import mitsuba as mi

    bitmap = mi.Bitmap(np.ascontiguousarray(enlarge(light, fine)))
    envmap: dict[str, Any] = {"type": "envmap", "bitmap": bitmap}
    extra, integrator = {"light": envmap}, None
    if not sample_light:
        # Mitsuba has no switch for this: use a light that is never chosen, and a dark one.
        envmap["sampling_weight"] = 0.0
        dark = {"type": "rgb", "value": 0.0}
        extra["dark"] = {"type": "point", "position": [0, 0, 50], "intensity": dark}
        integrator = mi.load_dict({"type": "volpathmis"})
    if part is not None:
        extra["sensor"] = _cropped(camera, *part)
    scene = build_scene(head, find_skin(skin), camera, extra)
    made = np.array(mi.render(scene, integrator=integrator, spp=paths, seed=seed), np.float32)
    if part is None:
        return made
    whole = np.zeros((camera.size, camera.size, 3), np.float32)
    whole[part] = made
    return whole


def _cropped(camera: Camera, rows: slice, columns: slice) -> dict[str, Any]:
    """Return a camera for a part of its picture."""
    found = sensor(camera)
    found["film"] |= {
        "crop_offset_x": columns.start,
        "crop_offset_y": rows.start,
        "crop_width": columns.stop - columns.start,
        "crop_height": rows.stop - rows.start,
    }
    return found


def read_light(path: Path) -> Float32:
    """Read a panorama reduced to 64 x 32 texels, scaled to mean radiance 1."""
    light = reduce(read_environment(path))
    scaled: Float32 = (light / light.mean()).astype(np.float32)
    return scaled


def rotate(radiance: FloatImage, columns: int) -> FloatImage:
    """Rotate an environment by whole texels, clockwise from above.

    Args:
        radiance: (H, W, ...) float32. Environment at turn 0.

    Returns:
        (H, W, ...) float32. The sitter's view at turn 360 columns / W degrees: column j shows
        column
        (j + columns) mod W.
    """
    return np.roll(radiance, -columns, axis=1)
