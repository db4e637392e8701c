"""Pictures with known headings, and pictures of no place at all, for `heading.py`.

Every picture is drawn from one stream of random numbers: the same seed gives the same pictures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.colour import srgb_encode, to_bytes
from app.core.base.paths import resources
from app.core.environment.environment import read_environment
from app.core.localization.features import HeadingIndex, build_index
from app.core.localization.heading_conversion import ASSUMED_DEG
from app.core.localization.views import Lens
from app.core.measure.finish.display import display_gain, display_panorama
from benchmarks.heading.scripted_turn.phone import Disturbance, disturbed, random_disturbance
from benchmarks.heading.scripted_turn.scene_files import probe_environment
from benchmarks.heading.scripted_turn.scene_views import SceneViews, Stand

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

ROOT = Path(__file__).resolve().parents[2]


Bytes = NDArray[np.uint8]
Float32 = NDArray[np.float32]

SIZE: Final = (640, 480)
LOCATION: Final = "location"
SHARED: Final = ROOT.parent / "shared" / "data" / "hdri"


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A picture and the truth: its place, heading, field of view, the sitter's angle."""

    picture: Bytes
    place: str
    heading_deg: float
    fov_deg: float
    sitter_deg: float = 0.0

    @property
    def assumed_sitter_deg(self) -> float:
        """Return the sitter's angle for an assumed usual field of view."""
        columns, rows = self.picture.shape[1], self.picture.shape[0]
        usual = math.tan(math.radians(ASSUMED_DEG / 2.0)) * columns / max(columns, rows)
        scale = usual / math.tan(math.radians(self.fov_deg / 2.0))
        return math.degrees(math.atan(math.tan(math.radians(self.sitter_deg)) * scale))


def scenes(folder: Path | None = SHARED) -> dict[str, Float32]:
    """Return the radiance of the bundled panoramas and, if available, of the twelve others."""
    files = sorted((resources() / "demo" / "scenes").glob("*.exr"))
    if folder is not None and folder.is_dir():
        files += sorted(folder.glob("*.hdr"))
    return {file.stem: read_environment(file).radiance for file in files}


def location() -> Float32:
    """Return the probe's panorama at the demo location, cd/m2."""
    return probe_environment(resources() / "demo" / "location").radiance


def demo_spots() -> dict[str, Float32]:
    """Return the panoramas of three spots of one building, 5 to 13 m apart, all facing one way."""
    folder = resources() / "demo" / "location"
    names = {1: LOCATION, 2: "hall", 3: "court"}
    return {n: read_environment(folder / f"probe-{k}.exr").radiance for k, n in names.items()}


def learnt(places: dict[str, Float32]) -> dict[str, HeadingIndex]:
    """Build the indices of panoramas as the program displays them."""
    return {name: build_index(display_panorama(light)) for name, light in places.items()}


def demo_views(light: Float32) -> SceneViews:
    """Return views of the demo location from anywhere around the sitter."""
    return SceneViews(resources() / "demo" / "location" / "views", light)


def disturbance(chance: np.random.Generator, harder: float) -> Disturbance:
    """Return the disturbance by a phone; with more blur, noise and exposure error if `harder`."""
    usual = random_disturbance(chance)
    if harder == 1.0:
        return usual
    return replace(
        usual,
        ev=usual.ev * min(harder, 2.0),
        blur_px=usual.blur_px * harder,
        noise=usual.noise * harder,
    )


def location_cases(
    views: SceneViews, chance: np.random.Generator, count: int, harder: float = 1.0
) -> Iterator[Case]:
    """Yield the demo location: parallax, the sitter in front, the camera aimed beside them."""
    for number in range(count):
        fov, aim = chance.uniform(40.0, 80.0), float(number % 3 - 1) * chance.uniform(0.0, 15.0)
        stand = Stand(
            turn_deg=chance.uniform(-180.0, 180.0),
            distance_m=chance.uniform(1.2, 2.5),
            aim_deg=float(np.clip(aim, -0.4 * fov, 0.4 * fov)),
            pitch_deg=chance.uniform(-6.0, 6.0),
            roll_deg=chance.uniform(-5.0, 5.0),
        )
        seen = views.view(stand, Lens(fov, SIZE))
        picture = disturbed(seen.picture, disturbance(chance, harder), chance)
        if harder > 1.0:
            picture = covered(picture, chance)
        yield Case(picture, LOCATION, seen.heading_deg, fov, seen.sitter_deg)


def crop_cases(
    places: dict[str, Float32], chance: np.random.Generator, count: int, harder: float = 1.0
) -> Iterator[Case]:
    """Yield views of panoramas from the probe's position; every fourth is upright."""
    names = list(places)
    for number in range(count):
        name = names[number % len(names)]
        upright = number // len(names) % 4 == 3
        fov = chance.uniform(40.0, 80.0) if not upright else chance.uniform(40.0, 62.0)
        lens = Lens(fov, (SIZE[1], SIZE[0]) if upright else SIZE)
        heading = chance.uniform(-180.0, 180.0)
        tilt = (chance.uniform(-10.0, 10.0), chance.uniform(-5.0, 5.0))
        shown = crop(places[name], (heading, *tilt), lens)
        picture = disturbed(shown, disturbance(chance, harder), chance)
        if harder > 1.0:
            picture = covered(picture, chance)
        yield Case(picture, name, heading, fov)


def crop(light: Float32, angles_deg: tuple[float, float, float], lens: Lens) -> Bytes:
    """Cut a view out of a panorama: heading, pitch, roll; sRGB without the program's own tones."""
    columns, rows = lens.size
    x = (np.arange(columns) + 0.5 - columns / 2.0) / lens.focal_px
    y = (np.arange(rows)[:, None] + 0.5 - rows / 2.0) / lens.focal_px
    rays = np.stack([*np.broadcast_arrays(-x, -y), np.ones((rows, columns))], axis=-1)
    shape = (light.shape[0], light.shape[1])
    where = sphere.positions((rays @ sphere.rotation(*angles_deg).T).astype(np.float32), shape)
    seen = cv2.remap(light, *where, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return to_bytes(srgb_encode(np.clip(np.asarray(seen) * display_gain(light), 0.0, 1.0)))


def covered(picture: Bytes, chance: np.random.Generator) -> Bytes:
    """Cover a part of a picture with a plain object."""
    rows, columns = picture.shape[:2]
    tall, wide = (round(n * chance.uniform(0.2, 0.95)) for n in (rows, columns))
    top, left = chance.integers(0, rows - tall + 1), chance.integers(0, columns - wide + 1)
    result = picture.copy()
    result[top : top + tall, left : left + wide] = chance.integers(0, 256, 3)
    return result


def cut_out(index: HeadingIndex, case: Case) -> HeadingIndex:
    """Remove the picture's part from a panorama: the rest is a similar place."""
    keep = np.abs((index.azimuths - case.heading_deg + 180.0) % 360.0 - 180.0)
    keep = np.flatnonzero(keep > case.fov_deg / 2.0 + 12.0)
    return HeadingIndex(index.descriptors[keep], index.bearings[keep], index.azimuths[keep])


def nothing_cases(chance: np.random.Generator, count: int) -> Iterator[Case]:
    """Yield pictures of no place: walls, skies, hands, tiles, bricks, rough plaster."""
    kinds: list[Callable[[np.random.Generator], Float32]] = [
        _wall, _sky, _hand, _tiles, _bricks, _plaster
    ]  # fmt: skip
    for number in range(count):
        light = kinds[number % len(kinds)](chance)
        shown = to_bytes(srgb_encode(np.clip(light, 0.0, 1.0)))
        picture = disturbed(shown, random_disturbance(chance), chance)
        yield Case(picture, "", 0.0, chance.uniform(40.0, 80.0))


def _clouds(chance: np.random.Generator, scales: tuple[int, ...]) -> Float32:
    """Return smooth noise, (rows, columns), of several sizes in pixels; the larger the stronger."""
    total = np.zeros((SIZE[1], SIZE[0]), np.float32)
    for scale in scales:
        few = chance.standard_normal((SIZE[1] // scale + 2, SIZE[0] // scale + 2), np.float32)
        total += cv2.resize(few, SIZE, interpolation=cv2.INTER_CUBIC) * np.float32(scale)
    return total / np.float32(sum(scales))


def _coloured(light: Float32, colour: tuple[float, float, float]) -> Float32:
    return np.asarray(light[..., None] * np.asarray(colour, np.float32), np.float32)


def _wall(chance: np.random.Generator) -> Float32:
    slope = np.linspace(-1, 1, SIZE[0], dtype=np.float32) * np.float32(chance.uniform(-0.3, 0.3))
    return _coloured(np.tile(1.0 + slope, (SIZE[1], 1)), (0.45, 0.42, 0.38))


def _sky(chance: np.random.Generator) -> Float32:
    return _coloured(1.0 + np.clip(_clouds(chance, (160, 60, 20)), -0.3, 0.7), (0.3, 0.42, 0.7))


def _hand(chance: np.random.Generator) -> Float32:
    return _coloured(1.0 + np.float32(0.4) * _clouds(chance, (200, 90)), (0.5, 0.24, 0.17))


def _grid(chance: np.random.Generator, row_shift: float) -> tuple[Float32, NDArray[np.int64]]:
    """Return the distance to the next joint in pixels, and a number for each stone."""
    angle, wide = chance.uniform(-0.1, 0.1), chance.uniform(30.0, 90.0)
    tall = wide * (0.4 if row_shift else 1.0)
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]].astype(np.float32)
    along, down = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    row = np.floor(down / tall)
    along = along + row * np.float32(row_shift * wide)
    joint = np.minimum(along % wide, down % tall).astype(np.float32)
    stone = (np.floor(along / wide) * 31 + row * 17).astype(np.int64) % 97
    return joint, np.asarray(stone, np.int64)


def _tiles(chance: np.random.Generator) -> Float32:
    joint, _ = _grid(chance, 0.0)
    return _coloured(np.where(joint < 3.0, 0.15, 0.6).astype(np.float32), (1.0, 0.97, 0.9))


def _bricks(chance: np.random.Generator) -> Float32:
    joint, stone = _grid(chance, 0.5)
    shade = chance.uniform(0.2, 0.6, 97).astype(np.float32)[stone]
    return _coloured(np.where(joint < 3.0, np.float32(0.7), shade), (1.0, 0.6, 0.45))


def _plaster(chance: np.random.Generator) -> Float32:
    light = 0.4 + 0.5 * _clouds(chance, (64, 32, 16, 8, 4))
    return _coloured(np.clip(light, 0.0, 1.0).astype(np.float32), (1.0, 0.95, 0.85))
