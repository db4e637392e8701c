"""Realistic heads, turned in front of the lens in places, rendered by stock Mitsuba.

Shapes, hair, brows and colours are those of the program's portraits. The skin is a principled
surface, not the scattering one of the bake: faster, and another difference from the model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from app.core.base.colour import face_exposure, luminance, srgb_encode
from app.core.environment.environment import read_environment
from app.core.faces.finder import face_mesh, find_faces
from benchmarks.truth.stock import ROOT

Bytes: TypeAlias = NDArray[np.uint8]
Float32: TypeAlias = NDArray[np.float32]
Floats: TypeAlias = NDArray[np.float64]
Pose: TypeAlias = tuple[float, float]
Box: TypeAlias = tuple[float, float, float, float]

HEADS: Final = {
    "female": ("hair-long", (0.62, 0.40, 0.30)),
    "male": ("hair-short", (0.30, 0.16, 0.10)),
    "generic": ("hair-short", (0.60, 0.36, 0.25)),
}
"""Hair, and colour of the skin."""
ROOM: Final = 1.6
"""Side of a picture over the size of the face in it."""
LARGE_PX, PHOTO_PX = 320, 160
SAMPLES: Final = {LARGE_PX: 16, PHOTO_PX: 24}
DISTANCE: Final = 15.0
"""From the face to the lens, 10 cm."""
NOISE: Final = (0.001, 0.006)
"""Of black, and of white with the root of light: that of a phone in a picture of this size."""
WORK: Final = Path("/tmp/turned-faces")
"""Folder of pictures that are kept for the next run."""


def held(pose: Pose) -> Floats:
    """Return the rotation from the head's frame to x right, y up, z towards the lens, (3, 3)."""
    yaw, pitch = np.radians(pose)
    across = [[math.cos(yaw), 0, math.sin(yaw)], [0, 1, 0], [-math.sin(yaw), 0, math.cos(yaw)]]
    up = [[1, 0, 0], [0, math.cos(pitch), math.sin(pitch)], [0, -math.sin(pitch), math.cos(pitch)]]
    return np.asarray(np.array(across) @ np.array(up))


class Stage:
    """A head in front of Mitsuba, for any place, pose and turn.

    Attributes:
        middle: Middle of the face, at which the lens points.
        marks: (468, 3) float64. Landmarks, head frame.
    """

    def __init__(self, name: str) -> None:
        from app.core.baking.kernel_lanes import select_variant

        self.mi = select_variant("llvm")
        import drjit as dr

        # A run on two threads crashed; on one, none has.
        dr.set_thread_count(1)
        self.parts, (x, y, z) = self._parts(name)
        self.middle = np.array([x, y - 0.25, z - 0.5])
        self.lit: Path | None = None
        self._light(np.ones((32, 64, 3), np.float32))
        self.marks = self._marks()

    def _parts(self, name: str) -> tuple[dict[str, Any], tuple[float, float, float]]:
        """Return skin, eyes, hair, brows, lashes and collar, and the point between the eyes."""
        from app.core.baking.scene import Mesh, load_head, mitsuba_mesh
        from scenes.head_detail.scene import detailed_skin, mitsuba_shapes

        folder, (hair, tone) = ROOT / "resources" / "heads", HEADS[name]
        head = load_head(name, folder / f"{name}.ply", folder / f"{name}-eyes.ply")
        skin = detailed_skin(name, 1)
        assert head.eyes is not None
        assert skin.colours is not None
        dyed = Mesh(
            skin.vertices, skin.normals, skin.faces, skin.colours * np.array(tone, np.float32)
        )
        colour = {"type": "mesh_attribute", "name": "vertex_color"}
        wax = {"type": "principled", "base_color": colour, "roughness": 0.42, "specular": 0.45}
        eye = {"type": "principled", "base_color": colour, "roughness": 0.1, "eta": 1.376}
        load, strands = self.mi.load_dict, WORK / "strands"
        strands.mkdir(parents=True, exist_ok=True)
        details = mitsuba_shapes(name, hair, folder=strands)
        parts = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 5, "hide_emitters": True},
            "skin": mitsuba_mesh("skin", dyed, {"bsdf": load(wax)}),
            "eyes": mitsuba_mesh("eyes", head.eyes, {"bsdf": load(eye)}),
            **{n: load(one) if isinstance(one, dict) else one for n, one in details.items()},
        }
        return parts, head.eye_point

    def enter(self, file: Path) -> None:
        """Put the head into a place, if it is not there already."""
        if self.lit != file:
            self._light(place(file))
            self.lit = file

    def _light(self, radiance: Float32) -> None:
        light = {"type": "envmap", "bitmap": self.mi.Bitmap(np.array(radiance, np.float32))}
        self.scene = self.mi.load_dict({**self.parts, "light": light})
        self.params = self.mi.traverse(self.scene)

    def focal(self, size: int) -> float:
        """Return the focal length, pixels, for a face of this size from the front."""
        return size * DISTANCE / float(np.ptp(self.marks[:, 1]))

    def render(self, pose: Pose, turn: float, focal: float, side: int, samples: int) -> Float32:
        """Return the linear picture, and the share that the head covers, (side, side, 4)."""
        back, mi = held(pose).T, self.mi
        around = np.eye(4)
        around[:3, :3] = back @ held((turn, 0))
        self.params["light.to_world"] = mi.Transform4f(around)
        self.params.update()
        spot, up = self.middle + DISTANCE * back[:, 2], back[:, 1]
        way = mi.ScalarTransform4f().look_at(spot.tolist(), self.middle.tolist(), up.tolist())
        film = {"type": "hdrfilm", "width": side, "height": side, "pixel_format": "rgba"}
        sensor = mi.load_dict(
            {
                "type": "perspective",
                "fov": 2 * math.degrees(math.atan(side / 2 / focal)),
                "to_world": way,
                "film": {**film, "component_format": "float32"},
            }
        )
        return np.array(mi.render(self.scene, sensor=sensor, spp=samples), np.float32)

    def _marks(self) -> Floats:
        """Return the landmark mesh, fitted to the landmarks detected on the head from the front."""
        focal, side = 3000.0, 600
        (face,) = find_faces(developed(self.render((0, 0), 0.0, focal, side, 16)[..., :3], 0.7))
        x, y = (face.landmarks[:, :2].T - side / 2) / focal
        ways = np.stack([x, -y, np.full_like(x, -1)]).astype(np.float32)
        spot = self.middle + np.array([0, 0, DISTANCE])
        met = self.scene.ray_intersect(self.mi.Ray3f(spot.tolist(), ways))
        valid = np.array(met.is_valid())
        places = np.array(met.p).T[valid].astype(np.float64)
        mesh = face_mesh().points.astype(np.float64)
        points = mesh[valid]
        one, other = points - points.mean(axis=0), places - places.mean(axis=0)
        u, d, v = np.linalg.svd(other.T @ one)
        scale = float(d.sum() / np.square(one).sum())
        return np.asarray(scale * (mesh - points.mean(axis=0)) @ (u @ v).T + places.mean(axis=0))

    def box(self, pose: Pose, focal: float, side: int) -> Box:
        """Return left, top, right, bottom of the landmarks in a picture of `render`."""
        x, y, z = held(pose) @ (self.marks - self.middle).T
        across, down = side / 2 + focal * np.stack([x, -y]) / (DISTANCE - z)
        return float(across.min()), float(down.min()), float(across.max()), float(down.max())


@dataclass(frozen=True, slots=True, eq=False)
class Pictured:
    """A linear picture with the share that the head covers, (N, N, 4), and the face's box."""

    picture: Float32
    box: Box
    focal: float

    @property
    def gain(self) -> float:
        """Gain that exposes the face."""
        left, top, right, bottom = (round(edge) for edge in self.box)
        part = self.picture[top:bottom, left:right]
        return face_exposure(luminance(part[..., :3])[part[..., 3] > 0.5])


def developed(picture: Float32, gain: float, chance: np.random.Generator | None = None) -> Bytes:
    """Develop like a camera: noise, sRGB, a mild S-curve, JPEG; (H, W, 3) uint8."""
    light = np.clip(picture * gain, 0, 4)
    if chance is not None:
        light = light + chance.normal(size=light.shape) * (NOISE[0] + NOISE[1] * np.sqrt(light))
    value = srgb_encode(np.clip(light, 0, 1))
    value = value + 0.25 * (value * value * (3 - 2 * value) - value)
    shown = np.round(255 * np.clip(value, 0, 1)).astype(np.uint8)
    coded = cv2.imencode(".jpg", shown[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 80])[1]
    back = np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
    return np.ascontiguousarray(back[..., ::-1])


@cache
def stage(name: str) -> Stage:
    """Return the only stage of a head."""
    return Stage(name)


@cache
def place(file: Path) -> Float32:
    """Return a place's radiance; for an azimuth as path, a lamp in the dark, 20 degrees up."""
    if file.suffix:
        return read_environment(file).radiance
    radiance = np.full((512, 1024, 3), 0.02, np.float32)
    column = round((float(file.name) / 360 + 0.5) * 1024)
    radiance[190:210, column - 10 : column + 10] = 60.0
    return radiance


def pictured(name: str, file: Path, pose: Pose, turn: float, size: int) -> Pictured:
    """Return a head in a place, in a pose at a turn; kept for the next run."""
    kept = WORK / f"{name}-{file.stem}-{pose[0]:g}-{pose[1]:g}-{turn:g}-{size}.npz"
    if not kept.exists():
        one, side = stage(name), round(ROOM * size)
        one.enter(file)
        focal = one.focal(size)
        raw = one.render(pose, turn, focal, side, SAMPLES[size])
        raw[..., :3] /= max(float(np.percentile(raw[..., :3], 99)), 1e-9)
        small = np.clip(raw, 0, 100).astype(np.float16)
        np.savez(kept, picture=small, box=one.box(pose, focal, side), focal=focal)
    with np.load(kept) as known:
        picture, focal = known["picture"].astype(np.float32), float(known["focal"])
        left, top, right, bottom = known["box"].tolist()
    # A firefly would not be in a photo.
    planes = [
        cv2.medianBlur(np.ascontiguousarray(plane), 3) for plane in np.moveaxis(picture, 2, 0)
    ]
    return Pictured(np.stack(planes, axis=2), (left, top, right, bottom), focal)
