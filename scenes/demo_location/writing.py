"""The finished files: panoramas, views, depth maps and their descriptions."""

from __future__ import annotations

import hashlib
import importlib
import json
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.atomic_files import atomic_write, atomic_write_bytes, atomic_write_text
from scenes.demo_location.frame import (
    EYE_HEIGHT,
    STANDS,
    SUN_AZIMUTH,
    SUN_ELEVATION,
    TURNS,
    VIEW_FOV,
    VIEW_SIZE,
    Spot,
    Stand,
    to_world,
    view_pose,
)
from scenes.demo_location.render import DEPTH_SIZE, Panorama, View

__all__ = [
    "ENCODING",
    "NEAR",
    "source_digest",
    "view_name",
    "write_location",
    "write_panorama",
    "write_view",
]

Floats = NDArray[np.float32]
NEAR: Final = 0.4  # metres for the code 65535 of a depth map
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722], np.float32)
_UNITS: Final = (200.0, 1_000.0, 5_000.0, 25_000.0)  # cd/m2 for 1.0 in a panorama's file
_HALF_LIMIT: Final = 60_000.0
ENCODING: Final = "WebP quality 78; inverse depth in steps of 8"
_QUALITY: Final = 78
_STEP: Final = 8  # of the depth's code: 1 cm at 6 m, and a third less to store
_LOSSES: Final = (12, 25, 45, 70, 100, 140, 200, 280, 400, 600)  # levels of DWAB
_LARGEST: Final = {"probe-1": 14.2e6, "probe-2": 4.3e6, "probe-3": 2.5e6, "cafe": 4.3e6}  # bytes
_WHITE: Final = 5.0
_WORLD: Final = (
    "World: metres, +Y up, origin on the floor under the first spot. Panoramas: azimuth = 360 deg "
    "(u - 0.5), 0 at the centre column and at +Z, growing to the right, which is clockwise seen "
    "from above; elevation = 90 deg - 180 deg v. All panoramas share the world's azimuth."
)
_VIEWS_WORDS: Final = (
    "The sitter and the place behind, from where the photographer would stand. The sitter faces "
    "the camera in every view and has turned with the photographer."
)
_VIEWS_FRAME: Final = (
    "World: metres, +Y up, origin on the floor under the first spot. Azimuth 0 is +Z, azimuth "
    "90 deg is -X (clockwise seen from above). rotation takes world directions to camera "
    "directions: its rows are image right, image down and the optical axis; camera point = "
    "rotation @ (world point - position_m). Pixel (column i, row j) is centred at "
    "(i + 0.5, j + 0.5)."
)


def source_digest() -> str:
    """Return the SHA-256 of the scene's source files."""
    folder = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


def unit_of(picture: Floats) -> float:
    """Return cd/m2 for 1.0 in the file: the smallest unit that fits the brightest texel.

    The file stores half floats.
    """
    return next(unit for unit in _UNITS if float(picture.max()) / unit < _HALF_LIMIT)


def write_panorama(file: Path, spot: Spot, kept: Panorama, smooth: bool = False) -> dict[str, Any]:
    """Write a panorama as half-float EXR and return its description; `smooth` denoises it."""
    picture = kept.picture
    if smooth:
        # Wrap around the seam as well; the zenith is averaged over its whole row anyway.
        wide = np.ascontiguousarray(np.pad(picture, ((0, 0), (64, 64), (0, 0)), mode="wrap"))
        denoise = importlib.import_module("mitsuba_oidn").denoise
        picture = np.maximum(np.asarray(denoise(wide, hdr=True), np.float32)[:, 64:-64], 0)
    unit = unit_of(picture)
    atomic_write(
        file,
        lambda path: _write_exr(path, picture / np.float32(unit), unit, _LARGEST[spot.name]),
    )
    x, y, z = to_world(spot.building[0], EYE_HEIGHT, spot.building[1])
    luminance = picture @ _LUMINANCE
    return {
        "file": file.name,
        "words": spot.words,
        "position_m": [round(float(v), 6) for v in (x, y, z)],
        "height_m": EYE_HEIGHT,
        "cd_per_m2_of_one": unit,
        "brightest_cd_per_m2": round(float(luminance.max()), 1),
        "median_cd_per_m2": round(float(np.median(luminance)), 1),
        "samples_at_horizon": int(kept.counts.max()),
        "samples_at_poles": int(kept.counts.min()),
        "seconds": round(kept.seconds),
    }


def _write_exr(path: Path, picture: Floats, unit: float, limit: float) -> None:
    """Write with the least loss that fits the size limit of this panorama."""
    level = _LOSSES[-1]
    for candidate in _LOSSES:
        _write_half(path, picture, unit, candidate)
        if path.stat().st_size <= limit:
            level = candidate
            break
    _lift_negatives(path, picture, unit, level)


def _lift_negatives(path: Path, picture: Floats, unit: float, level: int) -> None:
    """Lift the few dark texels that lossy packing pushes below 0 beside bright ones."""
    draft = picture.copy()
    around = cv2.blur(picture, (5, 5))
    for lift in (0.1, 0.3, 0.6, 1.0, 1.0):
        below = _read(path) < 0
        if not below.any():
            return
        wider = cv2.dilate(below.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        draft = np.where(wider, np.maximum(draft, lift * around), draft)
        _write_half(path, draft, unit, level)


def _write_half(path: Path, picture: Floats, unit: float, level: int) -> None:
    import OpenImageIO as oiio

    spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "half")
    spec.attribute("compression", f"dwab:{level}")
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    spec.attribute("whiteLuminance", unit)
    target = oiio.ImageOutput.create(str(path))
    if target is None or not target.open(str(path), spec):
        raise OSError(oiio.geterror())
    written = target.write_image(np.ascontiguousarray(picture, np.float32))
    if not (target.close() and written):
        raise OSError(target.geterror())


def _read(path: Path) -> Floats:
    import OpenImageIO as oiio

    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise OSError(oiio.geterror())
    try:
        return np.asarray(source.read_image("float"), np.float32)
    finally:
        source.close()


def view_name(turn: int, distance: float) -> str:
    """Return the name of a view's files without their suffix."""
    return f"view-{turn:03d}-{round(distance * 100):03d}"


def tone_mapped(picture: Floats, exposure: float) -> NDArray[np.uint8]:
    """Develop radiance like a webcam, (H, W, 3) RGB bytes."""
    x = np.maximum(picture * np.float32(exposure), 0)
    x = x * (1 + x / _WHITE**2) / (1 + x)
    x = np.clip(x, 0, 1)
    code = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(code * 255), np.uint8)


def exposure_of(picture: Floats) -> float:
    """Return the exposure from cd/m2 that a webcam would choose, centre-weighted."""
    height, width = picture.shape[:2]
    y, x = np.meshgrid(np.linspace(-1, 1, height), np.linspace(-1, 1, width), indexing="ij")
    weight = 0.25 + np.exp(-((x / 0.35) ** 2) - ((y / 0.6) ** 2))
    log = np.log(picture @ _LUMINANCE + 0.5)
    return float(0.2 / np.exp((weight * log).sum() / weight.sum()))


def denoised(view: View) -> Floats:
    """Denoise a view's mean radiance, guided by its albedo and normals."""
    denoise = importlib.import_module("mitsuba_oidn").denoise
    guides = max(view.guides, 1)
    albedo = np.clip(view.albedo / guides, 0, 1).astype(np.float32)
    normal = (view.normal / guides).astype(np.float32)
    mean = np.ascontiguousarray(view.total / max(view.spp, 1), np.float32)
    return np.asarray(denoise(mean, albedo=albedo, normal=normal, hdr=True), np.float32)


def write_view(out: Path, stand: Stand, turn: int, distance: float, view: View) -> dict[str, Any]:
    """Write a view and its depth map and return their description."""
    picture = denoised(view)
    exposure = exposure_of(picture)
    name = view_name(turn, distance)
    code = np.ascontiguousarray(tone_mapped(picture, exposure)[..., ::-1])
    _encode(out / stand.folder / f"{name}.webp", code, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    far = np.where(view.depth > 0, 65535 * NEAR / np.maximum(view.depth, NEAR), 0)
    far = np.minimum(_STEP * np.round(far / _STEP), 65535)
    _encode(
        out / stand.folder / f"{name}.png",
        np.round(far).astype(np.uint16),
        [cv2.IMWRITE_PNG_COMPRESSION, 9],
    )
    position, rotation = view_pose(stand, turn, distance)
    return {
        "image": f"{name}.webp",
        "depth": f"{name}.png",
        "turn_deg": turn,
        "distance_m": distance,
        "position_m": [round(float(v), 9) + 0.0 for v in position],
        "rotation": [[round(float(v), 12) + 0.0 for v in row] for row in rotation],
        "exposure": float(f"{exposure:.6g}"),
        "samples": view.spp,
    }


def _encode(path: Path, picture: NDArray[Any], options: list[int]) -> None:
    good, data = cv2.imencode(path.suffix, picture, options)
    if not good:
        raise OSError(f"{path.name} could not be encoded")
    atomic_write_bytes(path, data.tobytes())


def write_views_json(out: Path, stand: Stand, views: list[dict[str, Any]]) -> None:
    """Write the description of all views of a stand."""
    width, height = VIEW_SIZE
    focal = width / 2 / float(np.tan(np.radians(VIEW_FOV / 2)))
    text = {
        "what": _VIEWS_WORDS,
        "frame": _VIEWS_FRAME,
        "size": [width, height],
        "horizontal_fov_deg": VIEW_FOV,
        "focal_px": focal,
        "centre_px": [width / 2, height / 2],
        "depth": {
            "size": list(DEPTH_SIZE),
            "metres": f"depth along the optical axis = {NEAR} * 65535 / code; code 0 is the sky",
            "near_m": NEAR,
        },
        "tone": "linear = exposure * radiance in cd/m2; "
        "x = linear (1 + linear / 25) / (1 + linear); code = sRGB(x)",
        "encoding": ENCODING,
        "turns_deg": list(TURNS),
        "distances_m": list(stand.distances),
        "eye_height_m": EYE_HEIGHT,
        "views": views,
    }
    atomic_write_text(out / stand.folder / "views.json", json.dumps(text, indent=1) + "\n")


def write_location(
    out: Path,
    panoramas: list[dict[str, Any]],
    demo: dict[str, Any],
    views: dict[str, dict[str, Any]],
) -> None:
    """Write ``location.json``.

    Args:
        demo: The panorama of the spot where the demo takes place.
        views: Their count and seconds, by folder.
    """
    text = {
        "name": "Gallery café at the court",
        "words": "A café with pictures and books in a former coach house, open to a sunlit court.",
        "frame": _WORLD,
        "front": "At probe-1 the centre column is where the photographer stands first (turn 0).",
        "radiance": "Linear Rec. 709; value * cd_per_m2_of_one = radiance whose luminance is in "
        "cd/m2. Half floats, DWAB. Path traced, never denoised.",
        "spots": panoramas,
        "demo": demo,
        "views": [
            {"folder": s.folder, "spot": s.spot.name, **views[s.folder]}
            for s in STANDS
            if s.folder in views
        ],
        "sun": {"azimuth_deg": SUN_AZIMUTH, "elevation_deg": SUN_ELEVATION, "diameter_deg": 0.533},
        "ways": {
            "paths": "up to 8 bounces, sun, sky and lamps sampled, openings sampled indoors",
            "views": "denoised with Open Image Denoise, single samples limited to 60,000 cd/m2",
        },
        "source": "scripts/build_demo_location.py and scenes/demo_location/",
        "source_sha256": source_digest(),
        "licence": "CC0-1.0; own work of the Turnlight contributors",
    }
    atomic_write_text(out / "location.json", json.dumps(text, indent=1) + "\n")
