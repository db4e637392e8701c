"""Build the scene to bake, with its head, eyes, skin and camera, in Mitsuba or as exported files.

Units: 1 scene unit is 10 cm. Frame: +Y points up, +Z out of the face and +X to the sitter's left.
"""

from __future__ import annotations

import errno
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.baking.skin import EYE_COAT, Skin, eye_bsdf, skin_bsdf
from app.core.base.arrays import Float32, Float64
from app.core.base.atomic_files import atomic_write, atomic_write_text, os_errors_as
from app.core.base.errors import BakeError, HeadError
from app.core.base.native import native_path
from app.core.base.paths import resources
from app.core.text import tr

MILLIMETRES_PER_UNIT = 100.0
CAMERA_DISTANCE_M = 1.8
_MAX_FIELD_DEG = 9.0
_CROWN_MARGIN = 0.03
_CUT_MARGIN = 0.03
_EYES_BELOW_CROWN = 1.05
_SYMMETRY = 1e-4
_EXPORT = tr("Export the head again as .ply or .obj, with normals.")
_MOST_UNIT_MM = 1e6
_MAX_VERTICES = 2_000_000
_MAX_MESH_BYTES = 300_000_000  # enough for an .obj file with the largest number of vertices
_MAX_PLY_HEAD = 1 << 14
_MAX_PLY_ELEMENTS = 16
# Mitsuba accepts RGB spectra only up to 1, so the medium's scale carries the rest (per millimetre).
_DENSEST = 4.0
# Mitsuba 3.9.1's volpathmis starts Russian roulette after 5 events, and from then on weights paths
# that meet a light as if none had ended. Where light is sampled too, the two weights no longer add
# up to 1 and the picture gets darker, by 1.4% under a lamp of 15 degrees radius. So roulette has
# to wait until hardly any light is left. After 128 events, 0.02% is left in medium skin and 0.3%
# in light skin.
_ROULETTE_DEPTH = 128


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh with smooth normals.

    Attributes:
        vertices, normals: (V, 3) float32. Positions in scene units (10 cm) and unit normals, in
            the head's frame.
        faces: (F, 3) uint32. Vertex indices, counter-clockwise as seen from outside.
        colours: (V, 3) float32 or None. Linear Rec. 709 albedo.
    """

    vertices: Float32
    normals: Float32
    faces: NDArray[np.uint32]
    colours: Float32 | None = None


@dataclass(frozen=True, slots=True)
class HeadMesh:
    """A head to bake: its skin and, if it has open eyes, both eyes in one mesh."""

    name: str
    skin: Mesh
    eyes: Mesh | None
    symmetric: bool

    @property
    def eye_point(self) -> tuple[float, float, float]:
        """Point midway between the fronts of the corneas, in scene units."""
        if self.eyes is not None:
            v = self.eyes.vertices
            middle = (float(v[:, 1].min()) + float(v[:, 1].max())) / 2
            return 0.0, middle, float(v[:, 2].max())
        v = self.skin.vertices
        height = float(v[:, 1].max()) - _EYES_BELOW_CROWN
        bridge = v[(np.abs(v[:, 0]) < 0.15) & (np.abs(v[:, 1] - height) < 0.15)]
        return 0.0, height, float((bridge if len(bridge) else v)[:, 2].max()) - 0.1


@dataclass(frozen=True, slots=True)
class Camera:
    """The portrait camera, which is level and at eye height, with a shifted lens.

    Attributes:
        origin: Position, in scene units.
        shift: Vertical shift of the picture.
        size: Side of the square picture, in pixels.
        yaw_deg: Turn of the head towards its own left, away from the camera, in degrees.
    """

    origin: tuple[float, float, float]
    fov_deg: float
    shift: float
    size: int
    yaw_deg: float = 0.0

    @property
    def ahead(self) -> tuple[float, float, float]:
        """A point straight in front of the camera, in scene units."""
        x, y, z = self.origin
        yaw = math.radians(self.yaw_deg)
        return x + math.sin(yaw), y, z - math.cos(yaw)


_EARS_UNITS = 0.7  # ears are searched for within this distance of eye height
_EAR_SHARE = 0.03  # fraction of the vertices in that range that counts as outermost


def head_middle(head: HeadMesh) -> Float64:
    """Return the point midway between the ears, (3,) float64, in scene units.

    The ears are the outermost points at eye height.
    """
    vertices = head.skin.vertices.astype(np.float64)
    beside = vertices[np.abs(vertices[:, 1] - head.eye_point[1]) < _EARS_UNITS]
    out = np.abs(beside[:, 0])
    ears = beside[out >= np.quantile(out, 1.0 - _EAR_SHARE)]
    return np.array([0.0, ears[:, 1].mean(), ears[:, 2].mean()])


def frame_head(head: HeadMesh, size: int, yaw_deg: float = 0.0) -> Camera:
    """Place the camera 1.8 m from the eyes and crop the picture from above the crown to the neck.

    The lower edge stays above the cut through the neck even at the back, so no pixel shows the cut.
    A head turns about the vertical axis midway between its ears. Here, the camera moves around that
    axis instead.

    Args:
        size: Side of the square picture, in pixels.
        yaw_deg: Turn of the head towards its own left, in degrees.
    """
    x, y, z = head.eye_point
    far = z + CAMERA_DISTANCE_M * 1000 / MILLIMETRES_PER_UNIT
    v = head.skin.vertices
    slopes = (v[:, 1] - y) / (far - v[:, 2])
    top = float(slopes.max()) * (1 + _CROWN_MARGIN)
    bottom = -(y - (float(v[:, 1].min()) + _CUT_MARGIN)) / (far - float(v[:, 2].min()))
    extent = min(top - bottom, 2 * math.tan(math.radians(_MAX_FIELD_DEG / 2)))
    bottom = top - extent
    middle, yaw = (float(head_middle(head)[2]), math.radians(yaw_deg)) if yaw_deg else (far, 0.0)
    return Camera(
        origin=(x - math.sin(yaw) * (far - middle), y, middle + math.cos(yaw) * (far - middle)),
        fov_deg=math.degrees(2 * math.atan(extent / 2)),
        shift=-(top + bottom) / 2 / extent,
        size=size,
        yaw_deg=yaw_deg,
    )


def load_head(
    name: str, skin_file: Path, eyes_file: Path | None, *, unit_mm: float = MILLIMETRES_PER_UNIT
) -> HeadMesh:
    """Read a head and its eyes (PLY or OBJ) and check that they can be baked.

    Args:
        eyes_file: Closed eyeballs with vertex colours, or None for a head with closed lids.
        unit_mm: Millimetres per unit in the files.

    Raises:
        HeadError: If a file is missing or is not a mesh, if the skin is not closed, or if the size
            is impossible for a head.
    """
    skin = _load_mesh(skin_file, unit_mm)
    height = float(np.ptp(skin.vertices[:, 1])) * MILLIMETRES_PER_UNIT
    if not 150.0 <= height <= 700.0:
        raise HeadError(
            tr(
                "The head in {name} would be {height:.0f} mm tall.",
                name=skin_file.name,
                height=height,
            ),
            hint=tr("Use --unit to set the size of one unit in millimetres."),
        )
    open_edges = count_open_edges(skin)
    if open_edges:
        raise HeadError(
            tr(
                "The head in {name} is not closed: {open_edges} edges belong to only one face.",
                name=skin_file.name,
                open_edges=open_edges,
            ),
            hint=tr("Close the mesh, so that no light leaks into the skin."),
        )
    eyes = None if eyes_file is None else _load_mesh(eyes_file, unit_mm)
    parts = [skin] if eyes is None else [skin, eyes]
    return HeadMesh(name, skin, eyes, all(_is_symmetric(part) for part in parts))


def count_open_edges(mesh: Mesh) -> int:
    """Count the edges that belong to an odd number of faces, merging vertices that coincide."""
    _, where = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    faces = where.reshape(-1)[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.sort(edges[edges[:, 0] != edges[:, 1]], axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    return int((counts % 2 != 0).sum())


def _is_symmetric(mesh: Mesh) -> bool:
    def key(v: Float32) -> Float64:
        grid = np.round(v.astype(np.float64) / (2 * _SYMMETRY)) + 0.0
        return grid[np.lexsort(grid.T)]

    mirrored = mesh.vertices * np.array([-1, 1, 1], np.float32)
    same = key(mesh.vertices), key(mirrored)
    # A vertex near a cell's border may round either way, so allow a neighbouring cell.
    return bool(np.mean(np.abs(same[0] - same[1]).max(axis=1) <= 1) > 0.99)


def _load_mesh(path: Path, unit_mm: float) -> Mesh:
    kind = _check_mesh_file(path)
    if not 0.0 < unit_mm <= _MOST_UNIT_MM:
        raise HeadError(
            tr("A unit of {unit_mm:g} mm is not possible.", unit_mm=unit_mm),
            tr("For metres, use 1000."),
        )
    # Load the mesh first without normals, since Mitsuba then computes them from the faces.
    plain = _load({"type": kind, "filename": str(path), "face_normals": True})
    count, corners = len(plain["vertex_positions"]) // 3, np.array(plain["faces"], np.uint32)
    if corners.size and int(corners.max()) >= count:
        raise HeadError(tr("{name} has faces with missing vertices.", name=path.name), _EXPORT)
    mesh = _load({"type": kind, "filename": str(path)})
    vertices = np.array(mesh["vertex_positions"], np.float32).reshape(-1, 3)
    faces = np.array(mesh["faces"], np.uint32).reshape(-1, 3)
    if not 0 < len(vertices) <= _MAX_VERTICES or len(faces) == 0:
        raise HeadError(tr("{name} has no usable mesh.", name=path.name), _EXPORT)
    if not np.isfinite(vertices).all():
        raise HeadError(tr("{name} has coordinates that are not numbers.", name=path.name), _EXPORT)
    vertices = vertices * np.float32(unit_mm / MILLIMETRES_PER_UNIT)
    normals = np.array(mesh["vertex_normals"], np.float32).reshape(-1, 3)
    if normals.shape != vertices.shape or not np.isfinite(normals).all():
        raise HeadError(tr("{name} has no usable normals.", name=path.name), _EXPORT)
    colours = None
    if "vertex_color" in mesh:
        colours = np.array(mesh["vertex_color"], np.float32).reshape(-1, 3)
    if _volume(vertices, faces) < 0:
        faces, normals = np.ascontiguousarray(faces[:, ::-1]), -normals
    return Mesh(vertices, normals, faces, colours)


def _check_mesh_file(path: Path) -> str:
    if not path.is_file():
        raise HeadError(
            tr("There is no head file {path}.", path=path), tr("Check the name and the folder.")
        )
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("ply", "obj"):
        raise HeadError(tr("{name} is not a PLY or OBJ mesh.", name=path.name), _EXPORT)
    if path.stat().st_size > _MAX_MESH_BYTES:
        most = f"{_MAX_MESH_BYTES // 10**6} MB"
        raise HeadError(
            tr("{name} is too large. A head may have at most {most}.", name=path.name, most=most),
            _EXPORT,
        )
    if kind == "ply" and not _is_plain(path):
        raise HeadError(tr("{name} is damaged or not a readable mesh.", name=path.name), _EXPORT)
    return kind


def _is_plain(path: Path) -> bool:
    """Return whether a PLY header is short, since Mitsuba takes minutes to read a very long one."""
    with path.open("rb") as stream:
        head, end, _ = stream.read(_MAX_PLY_HEAD).partition(b"end_header")
    return bool(end) and head.count(b"\nelement ") <= _MAX_PLY_ELEMENTS


def _load(description: dict[str, Any]) -> Any:
    import mitsuba as mi

    try:
        return mi.traverse(mi.load_dict(description))
    except (RuntimeError, ValueError, TypeError) as error:  # TypeError: the name is not text.
        name = Path(description["filename"]).name
        raise HeadError(
            tr("{name} is damaged or not a readable mesh.", name=name), _EXPORT
        ) from error


def _volume(v: Float32, faces: NDArray[np.uint32]) -> float:
    a, b, c = (v[faces[:, i]].astype(np.float64) for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6


def mitsuba_mesh(name: str, mesh: Mesh, properties: dict[str, Any]) -> Any:
    """Create a Mitsuba mesh with a BSDF and, if `properties` contains one, a medium inside."""
    import mitsuba as mi

    props = mi.Properties()
    for key, value in properties.items():
        props[key] = value
    mi_mesh = mi.Mesh(name, len(mesh.vertices), len(mesh.faces), props, True, False)
    if mesh.colours is not None:
        mi_mesh.add_attribute("vertex_color", 3, mesh.colours.ravel().tolist())
    params = mi.traverse(mi_mesh)
    params["vertex_positions"] = mesh.vertices.ravel()
    params["vertex_normals"] = mesh.normals.ravel()
    params["faces"] = mesh.faces.ravel()
    params.update()
    return mi_mesh


def medium(skin: Skin) -> dict[str, Any]:
    """Return the Mitsuba description of the medium under the skin's surface, in scene units."""
    return {
        "type": "homogeneous",
        "albedo": {"type": "rgb", "value": list(skin.albedo)},
        "sigma_t": {"type": "rgb", "value": [t / _DENSEST for t in skin.extinction]},
        "scale": _DENSEST * MILLIMETRES_PER_UNIT,
        "phase": {"type": "isotropic"},
    }


def build_scene(
    head: HeadMesh, skin: Skin, camera: Camera, extra: dict[str, Any] | None = None
) -> Any:
    """Build the Mitsuba scene of a head: the skin, then the eyes, and only the lights in `extra`.

    Raises:
        BakeError: If Mitsuba cannot build the scene.
    """
    import mitsuba as mi

    try:
        description: dict[str, Any] = {
            "type": "scene",
            "sensor": sensor(camera),
            "integrator": {"type": "volpathmis", "rr_depth": _ROULETTE_DEPTH},
            "skin": mitsuba_mesh(
                "skin",
                head.skin,
                {
                    "bsdf": mi.load_dict(skin_bsdf(skin)),
                    "interior": mi.load_dict(medium(skin)),
                },
            ),
        }
        if head.eyes is not None:
            bsdf = mi.load_dict(eye_bsdf(EYE_COAT))
            description["eyes"] = mitsuba_mesh("eyes", head.eyes, {"bsdf": bsdf})
        return mi.load_dict({**description, **(extra or {})})
    except RuntimeError as error:
        raise BakeError(tr("Mitsuba could not build the scene of this head.")) from error


def sensor(camera: Camera) -> dict[str, Any]:
    """Return the Mitsuba description of a camera."""
    import mitsuba as mi

    return {
        "type": "perspective",
        "fov": camera.fov_deg,
        "principal_point_offset_y": camera.shift,
        "near_clip": 1.0,
        "far_clip": 100.0,
        "to_world": mi.ScalarTransform4f().look_at(camera.origin, camera.ahead, [0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": camera.size,
            "height": camera.size,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent", "sample_count": 64},
    }


def _template(name: str) -> str:
    return (resources() / "mitsuba" / name).read_text(encoding="utf-8")


def export_scene(folder: Path, head: HeadMesh, skin: Skin, camera: Camera) -> Path:
    """Write the scene to bake as ``scene.xml`` and meshes that an unmodified Mitsuba can load.

    Raises:
        BakeError: If the folder cannot be written.
    """
    text = _template("scene.xml").format(
        head=head.name,
        skin=skin.name,
        roulette=_ROULETTE_DEPTH,
        fov=camera.fov_deg,
        offset=camera.shift,
        origin=", ".join(map(repr, camera.origin)),
        ahead=", ".join(map(repr, camera.ahead)),
        size=camera.size,
        roughness=skin.roughness,
        index=skin.index,
        albedo=", ".join(repr(a) for a in skin.albedo),
        sigma_t=", ".join(repr(t / _DENSEST) for t in skin.extinction),
        scale=_DENSEST * MILLIMETRES_PER_UNIT,
        eyes=""
        if head.eyes is None
        else _template("eyes.xml").format(roughness=EYE_COAT.roughness, index=EYE_COAT.index),
    )
    scene, skin_file, eyes_file = scene_files(folder)
    try:
        _write_mesh(skin_file, mitsuba_mesh("skin", head.skin, {}))
        if head.eyes is not None:
            _write_mesh(eyes_file, mitsuba_mesh("eyes", head.eyes, {}))
        atomic_write_text(scene, text)
    except (OSError, RuntimeError) as error:
        raise BakeError(tr("The scene could not be written to {folder}.", folder=folder)) from error
    return scene


def scene_files(folder: Path) -> tuple[Path, Path, Path]:
    """Return the paths of a scene's files in a folder, creating the folder if it is missing.

    Raises:
        BakeError: If the folder cannot be created.
    """
    meshes = folder / "meshes"
    sentence = tr("The folder {folder} cannot be created: {reason}.")
    with os_errors_as(BakeError, sentence, tr("Choose another folder."), folder=folder):
        meshes.mkdir(parents=True, exist_ok=True)
    return folder / "scene.xml", meshes / "skin.ply", meshes / "eyes.ply"


def _write_mesh(path: Path, mesh: Any) -> None:
    """Write a mesh atomically and read the file back, since Mitsuba does not notice a full disk."""
    import mitsuba as mi

    def write(temporary: Path) -> None:
        name = native_path(temporary)
        mesh.write_ply(name)
        again = mi.load_dict({"type": "ply", "filename": name})
        if again.face_count() != mesh.face_count():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    atomic_write(path, write)
