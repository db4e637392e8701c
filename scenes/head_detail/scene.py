"""The detailed head as Mitsuba shapes, and test scenes for viewing it.

The skin here is a cheap stand-in (`principled`): it serves to judge hair, colours and pores, not
the light under the skin.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from app.core.baking.scene import HeadMesh, Mesh, frame_head, load_head
from app.core.baking.scene import mitsuba_mesh as plain_mesh
from scenes.head_detail.bump import skin_bump
from scenes.head_detail.colours import relative_albedo
from scenes.head_detail.curves import curves
from scenes.head_detail.heads import HEADS, load
from scenes.head_detail.strands import Strands, taper
from scenes.head_detail.surface import refine

BROWN = {"eumelanin": 0.85, "pheomelanin": 0.25}
"""Concentrations of pigment in the hair of the head: medium brown."""
_PROBE = HEADS.parent / "demo" / "cafe" / "probe.exr"
_SKIN = (0.60, 0.36, 0.25)
_ROOM_ABOVE = 0.075


def write_curves(strands: Strands, path: Path) -> None:
    """Write strands as text for ``bsplinecurve``: lines ``x y z r``, with a blank line after each.

    A B-spline does not reach its first and last points, so both are repeated by reflection.
    """
    points = strands.points.astype(np.float64)
    first = 2.0 * points[:, :1] - points[:, 1:2]
    last = 2.0 * points[:, -1:] - points[:, -2:-1]
    points = np.concatenate([first, points, last], axis=1)
    shape = taper(strands.points.shape[1])
    shape = np.concatenate([shape[:1], shape, shape[-1:]])
    rows = np.concatenate(
        [points, (strands.radii[:, None] * shape).astype(np.float64)[:, :, None]], axis=2
    )
    line = "%.5f %.5f %.5f %.6f\n"
    pattern = line * rows.shape[1] + "\n"
    with path.open("w", encoding="ascii") as stream:
        stream.writelines(pattern % tuple(strand) for strand in rows.reshape(len(rows), -1))


def hair_bsdf(colour: dict[str, float] | tuple[float, float, float]) -> dict[str, Any]:
    """Return Mitsuba's `hair` material, by melanin or by absorption per hair radius (RGB)."""
    bsdf: dict[str, Any] = {
        "type": "hair",
        "longitudinal_roughness": 0.2,
        "azimuthal_roughness": 0.3,
        "scale_tilt": 2.5,
    }
    if isinstance(colour, dict):
        return {**bsdf, **colour}
    return {**bsdf, "sigma_a": {"type": "rgb", "value": list(colour)}}


def mitsuba_shapes(
    name: str,
    hair: str | None = "hair-short",
    hair_colour: dict[str, float] | tuple[float, float, float] | None = None,
    folder: Path | None = None,
) -> dict[str, Any]:
    """Return shapes of a head's details, to add to a scene's description.

    Args:
        hair: ``hair-short``, ``hair-long`` or None for a bald head.
        hair_colour: Melanin as for Mitsuba's `hair` material, or its `sigma_a`; by default brown.
        folder: Folder of the files for Mitsuba; by default a temporary one.
    """
    colour = BROWN if hair_colour is None else hair_colour
    darker = {"brows": {"eumelanin": 1.5, "pheomelanin": 0.2}, "lashes": {"eumelanin": 4.0}}
    shapes: dict[str, Any] = {}
    with_files = Path(tempfile.mkdtemp(prefix="head-detail-")) if folder is None else folder
    for what in ("brows", "lashes", *([hair] if hair else [])):
        file = with_files / f"{name}-{what}.txt"
        write_curves(curves(name, what), file)
        shapes[what.replace("-", "_")] = {
            "type": "bsplinecurve",
            "filename": str(file),
            "bsdf": hair_bsdf(darker.get(what, colour)),
        }
    shapes["collar"] = _collar_shape(name)
    return shapes


def _collar_shape(name: str) -> Any:
    import mitsuba as mi

    from scenes.head_detail.collar import collar

    cloth = {
        "type": "twosided",
        "cloth": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.09, 0.095, 0.105]}},
    }
    vertices, normals, faces = collar(name)
    mesh = Mesh(vertices.astype(np.float32), normals.astype(np.float32), faces.astype(np.uint32))
    return plain_mesh("collar", mesh, {"bsdf": mi.load_dict(cloth)})


def detailed_skin(name: str, levels: int = 2, *, beard: bool = False, scalp: bool = True) -> Mesh:
    """Return the skin mesh with its colours, divided until vertices are 0.8 mm apart."""
    points, normals, faces = refine(load(name), levels)
    colours = relative_albedo(name, points, normals, beard=beard, scalp=scalp)
    bent = skin_bump(points, normals, name)
    return Mesh(points.astype(np.float32), bent, faces.astype(np.uint32), colours)


def portrait_sensor(head: HeadMesh, height: int, samples: int, turn: float = 0.0) -> dict[str, Any]:
    """Return the program's camera with an upright 4:5 picture and room for hair.

    Args:
        turn: Angle of the camera around the head, to its left, degrees.
    """
    import mitsuba as mi

    camera = frame_head(head, height)
    extent = 2.0 * math.tan(math.radians(camera.fov_deg / 2.0))
    low = -(0.5 + camera.shift) * extent
    high = low + extent * (1.0 + _ROOM_ABOVE)
    tall = high - low
    _, y, z = camera.origin
    middle, angle = 0.55, math.radians(turn)
    spot = [(z - middle) * math.sin(angle), y, middle + (z - middle) * math.cos(angle)]
    ahead = [0.0, y, middle]
    return {
        "type": "perspective",
        "fov": math.degrees(2.0 * math.atan(tall / 2.0)),
        "fov_axis": "y",
        "principal_point_offset_y": -(low + high) / 2.0 / tall,
        "near_clip": 1.0,
        "far_clip": 100.0,
        "to_world": mi.ScalarTransform4f().look_at(spot, ahead, [0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": round(0.8 * height),
            "height": height,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "gaussian"},
        },
        "sampler": {"type": "independent", "sample_count": samples},
    }


def lights(kind: str, name: str) -> dict[str, Any]:
    """Return a softbox 45 degrees to the sitter's right and above, or the café all around."""
    import mitsuba as mi

    if kind == "cafe":
        return {"around": {"type": "envmap", "filename": str(_PROBE), "scale": 0.55}}
    eye = load(name).eye
    spot = [-9.0, float(eye[1]) + 7.5, 10.0]
    box = mi.ScalarTransform4f().look_at(spot, [0.0, float(eye[1]) - 0.3, 0.8], [0, 1, 0])
    return {
        "key": {
            "type": "rectangle",
            "to_world": box @ mi.ScalarTransform4f().scale([3.5, 3.5, 1.0]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 11.0}},
        },
        "fill": {"type": "constant", "radiance": {"type": "rgb", "value": 0.16}},
    }


def portrait_scene(
    name: str = "generic",
    hair: str | None = "hair-short",
    light: str = "softbox",
    height: int = 640,
    samples: int = 64,
    *,
    beard: bool = False,
    turn: float = 0.0,
) -> Any:
    """Return a Mitsuba scene of the head with all its details, ready to render."""
    import mitsuba as mi

    head = load_head(name, HEADS / f"{name}.ply", HEADS / f"{name}-eyes.ply")
    skin = detailed_skin(name, beard=beard, scalp=hair is not None)
    assert skin.colours is not None
    coloured = Mesh(
        skin.vertices, skin.normals, skin.faces, skin.colours * np.array(_SKIN, np.float32)
    )
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    wax = {"type": "principled", "base_color": colour, "roughness": 0.42, "specular": 0.45}
    eye = {"type": "principled", "base_color": colour, "roughness": 0.1, "eta": 1.376}
    assert head.eyes is not None
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": portrait_sensor(head, height, samples, turn),
            "integrator": {"type": "path", "max_depth": 12, "hide_emitters": light == "softbox"},
            "skin": plain_mesh("skin", coloured, {"bsdf": mi.load_dict(wax)}),
            "eyes": plain_mesh("eyes", head.eyes, {"bsdf": mi.load_dict(eye)}),
            **mitsuba_shapes(name, hair),
            **lights(light, name),
        }
    )
