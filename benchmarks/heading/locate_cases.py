"""Photos as taken by phones and cameras, at a place and beside it, for `locate_photos.py`.

One lens model (Brown and Conrady's distortion, rows read one after another while the hand turns)
samples light along its rays in three kinds of worlds: the demo location, traced; a panorama from
its own middle; and a panorama as the walls of a box, in which cameras can be elsewhere. Every photo
is drawn from its own random numbers, and saved as a JPEG with EXIF.
"""

from __future__ import annotations

import math
import struct
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base import sphere
from app.core.base.angles import difference, wrap
from app.core.base.colour import srgb_decode, srgb_encode, to_bytes
from app.core.base.paths import resources
from app.core.localization.views import Lens
from benchmarks.heading.heading_cases import LOCATION, demo_spots, demo_views, scenes
from benchmarks.heading.scripted_turn.phone import disturbed, random_disturbance, tone_mapped
from benchmarks.heading.scripted_turn.scene_files import EYE_M, SceneFiles, shown
from benchmarks.heading.scripted_turn.scene_views import Stand

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["LENSES", "SPOTS_M", "Shot", "Views", "boxes", "drawn_shots", "filed", "traced"]

Bytes = NDArray[np.uint8]
Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]

LENSES: Final = (  # focal length for 35 mm, columns to rows, frequency
    (26, (4, 3), 4), (24, (4, 3), 4), (23, (4, 3), 2), (25, (4, 3), 2), (27, (4, 3), 2),
    (28, (16, 9), 2), (31, (4, 3), 1), (35, (3, 2), 2), (48, (4, 3), 2), (52, (4, 3), 2),
    (50, (3, 2), 2), (13, (4, 3), 1), (77, (4, 3), 1),
)  # fmt: skip
PIXELS: Final = 320_000
READOUT_S: Final = 0.020
TURNING_DEG_S: Final = 30.0
SPOTS_M: Final = {
    "location": (0.0, 0.0), "hall": (-1.372652, 4.391563), "court": (-0.794915, -8.566686)
}  # fmt: skip
BESIDE_DEG: Final = (
    10.0  # a camera that looks closer to the probe's position, or away from it, is right
)
_AXES: Final = np.diag([-1.0, -1.0, 1.0])  # camera axes (right, down, front) from a panorama's
_FRAME_MM: Final = math.hypot(36.0, 24.0)
_VIEWS_FOCAL_MM: Final = 60.0  # a longer lens sees more finely than they do
_VIEWS_FOV_DEG: Final = 85.0  # a wider lens sees areas that no view shows
_VIEWS_WIDER: Final = 1.1  # than the lens, so that distortion samples inside it
_CUT_PX: Final = 10.0  # softened rim of a cut-out person


@dataclass(frozen=True, slots=True)
class Shot:
    """One photo: its truth, and all random values."""

    seed: int
    world: str  # traced, box, crop
    place: str
    kind: str  # at, beside, elsewhere
    position_m: tuple[float, float, float]  # from the probe; panorama's axes
    heading_deg: float
    pitch_deg: float
    roll_deg: float
    sitter_m: tuple[float, float, float] | None
    focal_mm: float  # true, for 35 mm
    size: tuple[int, int]
    bends: tuple[float, float, float, float]  # k1, k2, p1, p2
    sweep_deg: tuple[float, float]  # right and up during the readout
    kept: float = 1.0  # share of width and height that a crop leaves; EXIF does not state it
    passer: bool = False

    @property
    def full_fov_deg(self) -> float:
        """Horizontal field of view before cropping, deg."""
        return 2.0 * math.degrees(math.atan(self.size[0] / 2.0 / self.focal_px))

    @property
    def fov_deg(self) -> float:
        """Horizontal field of view of the photo, deg."""
        return 2.0 * math.degrees(math.atan(self.kept * self.size[0] / 2.0 / self.focal_px))

    @property
    def focal_px(self) -> float:
        return self.focal_mm * math.hypot(*self.size) / _FRAME_MM

    @property
    def rotation(self) -> Float64:
        """Return the rotation from the camera's axes to the panorama's, mid-exposure."""
        turned = sphere.rotation(self.heading_deg, self.pitch_deg, self.roll_deg)
        return np.asarray(turned @ _AXES)

    @property
    def probe_deg(self) -> float:
        """Angle between the probe's position and the axis, or its other end; deg."""
        x, _, z = (-p for p in self.position_m)
        if math.hypot(x, z) < 1e-6:
            return 0.0
        aside = abs(difference(math.degrees(math.atan2(-x, z)), self.heading_deg))
        return min(aside, 180.0 - aside)

    def told(self) -> dict[str, Any]:
        """Return the values for a table."""
        return asdict(self) | {"fov_deg": self.fov_deg, "probe_deg": self.probe_deg}

    def rays(self, places: Float64) -> Float64:
        """Return unit vectors in the panorama's axes for positions in the picture, (N, 2) px."""
        middle = np.array(self.size) / 2.0
        bent = (places - middle) / self.focal_px
        flat = _straight(bent, self.bends)
        late = places[:, 1] / self.size[1] - 0.5
        right, up = (math.radians(s) * late for s in self.sweep_deg)
        full = np.concatenate([flat, np.ones((len(flat), 1))], axis=1)
        full = full / np.linalg.norm(full, axis=1, keepdims=True)
        # A small turn of the camera: the scene as a later row sees it.
        full += np.stack([right * full[:, 2], -up * full[:, 2], -right * full[:, 0]], axis=1)
        full /= np.linalg.norm(full, axis=1, keepdims=True)
        return np.asarray(full @ self.rotation.T)


def _straight(bent: Float64, bends: tuple[float, float, float, float]) -> Float64:
    """Invert Brown and Conrady's distortion, in the picture plane, iteratively."""
    k1, k2, p1, p2 = bends
    flat = bent.copy()
    for _ in range(8):
        x, y = flat.T
        r2 = x * x + y * y
        radial = 1.0 + k1 * r2 + k2 * r2 * r2
        aside = np.stack(
            [2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], axis=1
        )
        flat = (bent - aside) / radial[:, None]
    return flat


# -- what is drawn ---------------------------------------------------------------------------------


def drawn_shots(
    world: str, rooms: dict[str, World], kind: str, count: int, seed: int
) -> Iterator[Shot]:
    """Draw photos of places in turn, where there is room for the camera."""
    places = list(rooms)
    for number in range(count):
        chance = np.random.default_rng([seed, number])
        place = places[number % len(places)]
        for _ in range(200):
            shot = _drawn(chance, world, place, kind, seed * 100_000 + number)
            away = math.hypot(shot.position_m[0], shot.position_m[2])
            if kind == "beside" and not (shot.probe_deg > BESIDE_DEG and 1.0 <= away <= 3.0):
                continue
            if world == "crop" or rooms[place].holds(shot):
                yield shot
                break


def _drawn(chance: np.random.Generator, world: str, place: str, kind: str, seed: int) -> Shot:
    weights = np.array([w for _, _, w in LENSES], float)
    focal, (wide, tall), _ = LENSES[int(chance.choice(len(LENSES), p=weights / weights.sum()))]
    scale = math.sqrt(PIXELS / (wide * tall))
    columns, rows = (2 * round(side * scale / 2) for side in (wide, tall))
    size = (rows, columns) if chance.random() < 0.45 else (columns, rows)
    turn, metres = chance.uniform(-180.0, 180.0), chance.uniform(1.2, 2.5)
    height = chance.uniform(-0.2, 0.15)
    sitter = np.array([0.0, chance.uniform(-0.1, 0.05), 0.0])
    if kind == "beside":
        # Half of them with a person in the picture who is not at the probe's position.
        way, off = chance.uniform(-180.0, 180.0), chance.uniform(1.0, 3.0)
        moved = sphere.direction(way, 0.0) * off
        with_sitter = bool(chance.random() < 0.5)
        camera = moved + np.array([0.0, height, 0.0])
        heading = chance.uniform(-180.0, 180.0)
        sitter = camera + sphere.direction(heading, 0.0) * metres - np.array([0.0, height, 0.0])
    else:
        camera = sphere.direction(turn, 0.0) * metres + (0.0, height, 0.0)
        with_sitter = bool(chance.random() < 0.8)
        if world == "crop":
            camera, with_sitter = np.zeros(3), False
        if world == "views":
            camera, sitter, with_sitter = camera * (1.0, 0.0, 1.0), np.zeros(3), True
        heading = wrap(turn + 180.0)
    reach = math.degrees(math.atan(size[0] / size[1])) * 0.35
    aim = float(np.clip(chance.normal(0.0, 5.0), -reach, reach))
    bend = 0.05 if focal > 15 else 0.03
    turning = math.copysign(TURNING_DEG_S, chance.uniform(-1, 1)) * chance.uniform(0.0, 1.0)
    return Shot(
        seed, world, place, kind,
        tuple(float(c) for c in camera),  # type: ignore[arg-type]
        float(wrap(heading + aim)), float(chance.normal(0.0, 4.0)), float(chance.normal(0.0, 2.5)),
        tuple(float(c) for c in sitter) if with_sitter else None,  # type: ignore[arg-type]
        float(focal * (1.0 + chance.uniform(-0.015, 0.015))),
        size,
        (*(float(b) for b in chance.uniform(-bend, bend, 2) * (1.0, 0.5)),
         *(float(b) for b in chance.uniform(-5e-4, 5e-4, 2))),  # type: ignore[arg-type]
        (turning * READOUT_S, float(chance.uniform(-10.0, 10.0)) * READOUT_S),
        passer=bool(chance.random() < 0.2),
    )  # fmt: skip


def filed(shot: Shot, picture: Bytes, path: Path, *, told: bool = True) -> None:
    """Save a photo as a JPEG, with the camera's focal length for 35 mm."""
    if shot.kept < 1.0:
        rows, columns = picture.shape[:2]
        tall, wide = round(rows * shot.kept), round(columns * shot.kept)
        top, left = (rows - tall) // 2, (columns - wide) // 2
        picture = np.ascontiguousarray(picture[top : top + tall, left : left + wide])
    quality = 70 + shot.seed % 26
    _, code = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    data = code.tobytes()
    if told:
        data = data[:2] + _exif(round(shot.focal_mm)) + data[2:]
    path.write_bytes(data)


def _exif(focal_mm: int) -> bytes:
    """Return EXIF with only FocalLengthIn35mmFilm (EXIF 2.32, tag 0xA405)."""
    main = struct.pack(">HHHII", 1, 0x8769, 4, 1, 26) + b"\0\0\0\0"
    camera = struct.pack(">HHHIHH", 1, 0xA405, 3, 1, focal_mm, 0) + b"\0\0\0\0"
    body = b"Exif\0\0MM\0*\0\0\0\x08" + main + camera
    return b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body


# -- what the phone makes of light -----------------------------------------------------------------


def developed(light: Float32, shot: Shot, people: People) -> Bytes:
    """Expose, add people in front, and finish, (H, W, 3) uint8."""
    chance = np.random.default_rng([shot.seed, 7])
    if shot.world not in ("traced", "views") and shot.sitter_m is not None:
        light = people.placed(light, shot, np.array(shot.sitter_m), chance)
    if shot.passer:
        across = float(np.clip(chance.normal(0.0, 0.35), -0.7, 0.7)) * shot.size[0] / 2.0
        way = sphere.direction(
            shot.heading_deg + math.degrees(math.atan(across / shot.focal_px)), 0.0
        )
        spot = np.array(shot.position_m) + way * chance.uniform(1.0, 3.0)
        spot[1] = chance.uniform(-0.15, 0.1)
        light = people.placed(light, shot, spot, chance)
    grey = light @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    middle = float(np.exp(np.mean(np.log(np.clip(grey, np.quantile(grey, 0.02) + 1e-6, None)))))
    tone = shown(np.maximum(light * np.float32(0.32 / middle), np.float32(0.0)))
    picture = to_bytes(srgb_encode(np.clip(tone, 0.0, 1.0)))
    if chance.random() < 0.6:
        picture = tone_mapped(picture, float(chance.uniform(0.1, 0.6)))
    usual = random_disturbance(chance)
    ev, noise = usual.ev * 0.5, usual.noise * 0.5
    picture = disturbed(
        picture, replace(usual, ev=ev, noise=noise, blur_px=usual.blur_px * 0.7, jpeg=0), chance
    )
    soft = cv2.GaussianBlur(picture, (0, 0), 1.2)
    crisp = float(chance.uniform(0.0, 0.9))
    return np.asarray(cv2.addWeighted(picture, 1.0 + crisp, soft, -crisp, 0.0), np.uint8)


class People:
    """The demo location's sitter, cut out of its views, for use in other pictures."""

    def __init__(self) -> None:
        self.files = SceneFiles(resources() / "demo" / "location" / "views")

    def placed(
        self, light: Float32, shot: Shot, spot_m: Float64, chance: np.random.Generator
    ) -> Float32:
        """Add a person at a position to the light of a photo."""
        turn = float(chance.choice(self.files.turns))
        source = self.files.shot(turn, float(chance.choice(self.files.distances)))
        at = (spot_m - np.array(shot.position_m)) @ shot.rotation
        if at[2] < 0.4:
            return light
        scale = shot.focal_px * source.distance_m / (self.files.focal_px * at[2])
        rows, columns = source.share.shape
        place = at[:2] / at[2] * shot.focal_px + np.array(shot.size) / 2.0
        move = np.array(
            [[scale, 0, place[0] - scale * columns / 2], [0, scale, place[1] - scale * rows / 2]]
        )
        share = source.share.copy()
        layer = np.dstack([source.light * share[..., None], share])
        # Below the view's edge the clothes continue.
        layer = cv2.copyMakeBorder(layer, 0, 4 * rows, 0, 0, cv2.BORDER_REPLICATE)
        put = cv2.warpAffine(layer, move, shot.size, flags=cv2.INTER_AREA)
        alpha = put[..., 3:]
        gain = np.float32(np.median(light) / max(float(np.median(source.light)), 1e-6))
        return np.asarray(light * (1.0 - alpha) + put[..., :3] * gain, np.float32)


# -- worlds ----------------------------------------------------------------------------------------


class World(Protocol):
    """Light along rays."""

    def holds(self, shot: Shot) -> bool:
        """Return whether there is room for the camera."""
        ...

    def light(self, shot: Shot) -> Float32:
        """Return the radiance in a photo, (H, W, 3)."""
        ...


def _pixels(size: tuple[int, int], offset: Float64 | float = 0.5) -> Float64:
    columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    return np.asarray(np.stack([columns.ravel(), rows.ravel()], axis=1) + offset, np.float64)


class Box:
    """A panorama on the walls, floor and ceiling of a room: cameras can be anywhere in it.

    The nearest wall is 2 to 4 m away, as are the others; a panorama seen from its middle (`crop`)
    has no walls.
    """

    def __init__(self, name: str, light: Float32) -> None:
        chance = np.random.default_rng([*name.encode()])
        self.radiance = light
        self.turn = sphere.rotation(float(chance.uniform(0.0, 90.0)))
        self.most = np.array([*chance.uniform(2.0, 4.0, 1), 1.3, *chance.uniform(2.0, 4.0, 1)])
        self.least = -np.array([*chance.uniform(2.0, 4.0, 1), 1.55, *chance.uniform(2.0, 4.0, 1)])

    def holds(self, shot: Shot) -> bool:
        """Return whether camera and sitter are inside, 30 cm from the walls."""
        spots = [shot.position_m, *([shot.sitter_m] if shot.sitter_m else [])]
        inside = np.array(spots) @ self.turn
        return bool((inside > self.least + 0.3).all() and (inside < self.most - 0.3).all())

    def light(self, shot: Shot) -> Float32:
        """Return the radiance in a photo, four samples a pixel, (H, W, 3)."""
        total = np.zeros((shot.size[1], shot.size[0], 3), np.float32)
        for step in ((0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)):
            rays = shot.rays(_pixels(shot.size, np.array(step)))
            if shot.world == "box":
                rays = self._seen_from_probe(rays @ self.turn, np.array(shot.position_m))
            grid = np.asarray(rays.reshape(shot.size[1], shot.size[0], 3), np.float32)
            where = sphere.positions(grid, (self.radiance.shape[0], self.radiance.shape[1]))
            total += cv2.remap(self.radiance, *where, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        return total / np.float32(4.0)

    def _seen_from_probe(self, rays: Float64, position: Float64) -> Float64:
        start = position @ self.turn
        with np.errstate(divide="ignore"):
            far = np.where(rays > 0, self.most - start, self.least - start) / rays
        met = start + rays * far.min(axis=1, keepdims=True)
        met /= np.linalg.norm(met, axis=1, keepdims=True)
        return np.asarray(met @ self.turn.T)


class Views:
    """The demo location through its shipped views, only from the line to the sitter."""

    def __init__(self) -> None:
        self._views = demo_views(demo_spots()[LOCATION])

    def holds(self, shot: Shot) -> bool:
        """Return whether the views show enough of the lens's field."""
        return shot.full_fov_deg < _VIEWS_FOV_DEG and shot.focal_mm < _VIEWS_FOCAL_MM

    def light(self, shot: Shot) -> Float32:
        """Return the linear display light in a photo, (H, W, 3)."""
        x, _, z = shot.position_m
        turn = math.degrees(math.atan2(-x, z))
        aim = wrap(shot.heading_deg - turn - 180.0)
        stand = Stand(turn, math.hypot(x, z), aim, shot.pitch_deg, shot.roll_deg)
        lens = Lens(
            2.0 * math.degrees(math.atan(_VIEWS_WIDER * shot.size[0] / 2.0 / shot.focal_px)),
            shot.size,
        )
        seen = self._views.view(stand, lens).picture
        rays = shot.rays(_pixels(shot.size)) @ shot.rotation
        places = rays[:, :2] / rays[:, 2:] * lens.focal_px + np.array(lens.size) / 2.0
        x_map, y_map = (p.reshape(shot.size[::-1]).astype(np.float32) - 0.5 for p in places.T)
        bent = cv2.remap(seen, x_map, y_map, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return _unshown(np.asarray(srgb_decode(bent.astype(np.float32) / 255.0), np.float32))


def _unshown(tone: Float32) -> Float32:
    """Invert `benchmarks.heading.scripted_turn.scene_files.shown`."""
    less = np.float32(1.0) - tone
    light = 12.5 * (np.sqrt(less**2 + 0.16 * tone) - less)
    return np.asarray(light, np.float32)


def boxes() -> dict[str, Box]:
    """Return every available panorama as a room."""
    return {name: Box(name, light) for name, light in (scenes() | demo_spots()).items()}


class Traced:
    """The demo location, path traced from anywhere in it; needs mitsuba-oidn for denoising."""

    def __init__(self, samples: int = 1) -> None:
        from app.core.baking.kernel_lanes import select_variant

        select_variant("llvm")
        import mitsuba as mi
        import mitsuba_oidn  # type: ignore[import-not-found]

        from scenes.demo_location.assemble import World as Traceable
        from scenes.demo_location.assemble import build_place, sitter_parts

        self._denoise = mitsuba_oidn.denoise
        self._samples = samples
        place = build_place()
        self._worlds = {
            False: Traceable(place),
            True: Traceable(place, sitter_parts(resources() / "heads")),
        }
        self._sampler = mi.load_dict({"type": "independent"})

    def _ray(self, shot: Shot, jitter: Float64 | float, every: int = 1) -> Any:
        import mitsuba as mi

        x, z = SPOTS_M[shot.place]
        start = np.array(shot.position_m) + np.array([x, EYE_M, z])
        rays = shot.rays((_pixels(shot.size, jitter))[::every]).T.astype(np.float32)
        # Plain numbers would be compiled in, and force a compilation for every photo.
        starts = np.repeat(start.astype(np.float32)[:, None], rays.shape[1], axis=1)
        return mi.Ray3f(mi.Point3f(starts), mi.Vector3f(rays))

    def _world(self, shot: Shot) -> Any:
        world = self._worlds[shot.sitter_m is not None]
        if shot.sitter_m is not None:
            x, z = SPOTS_M[shot.place]
            way = np.array(shot.position_m) - shot.sitter_m
            facing = math.degrees(math.atan2(-way[0], way[2])) + (shot.seed % 61 - 30)
            world.turn(facing, (shot.sitter_m[0] + x, shot.sitter_m[2] + z))
        return world

    def holds(self, shot: Shot) -> bool:
        """Return whether the camera is not in or right in front of an object."""
        from scenes.demo_location.tracer import first_hit

        far, _, _ = first_hit(self._worlds[False].surfaces, self._ray(shot, 0.5, 101))
        metres = np.array(far)
        return bool(np.quantile(metres[metres > 0], 0.05) > 0.45)

    def light(self, shot: Shot) -> Float32:
        """Return the radiance in a photo, denoised, (H, W, 3)."""
        from scenes.demo_location.tracer import first_hit, radiance

        world, chance = self._world(shot), np.random.default_rng([shot.seed, 3])
        columns, rows = shot.size
        total = np.zeros((3, rows, columns, 3), np.float32)
        for step in range(self._samples):
            self._sampler.seed(shot.seed % 1_000_003 * 64 + step, columns * rows)
            ray = self._ray(shot, chance.random((columns * rows, 2)))
            light = radiance(world.tables, self._sampler, ray)
            _, albedo, normal = first_hit(world.surfaces, ray)
            for into, part in zip(total, (light, albedo, normal), strict=True):
                into += np.minimum(np.array(part, np.float32).T, 60_000.0).reshape(rows, columns, 3)
        total /= np.float32(self._samples)
        mean, albedo, normal = (np.ascontiguousarray(part) for part in total)
        albedo = np.clip(albedo, 0.0, 1.0)
        return np.asarray(self._denoise(mean, albedo=albedo, normal=normal, hdr=True), np.float32)


def traced(samples: int = 1) -> Traced:
    """Build the demo location."""
    return Traced(samples)
