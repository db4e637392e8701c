"""Comparison between the light on a photographed face and the light that a style promises."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from app.core.base.angles import arc_width, lies_on_arc, wrap
from app.core.base.arrays import Bools, Bytes, Float32, Float64
from app.core.base.colour import luminance
from app.core.faces.face_on_head import head_map, on_head
from app.core.faces.facing import WIDE_DEG, FacingEstimate, Standing, find_facing, standing
from app.core.faces.finder import Face
from app.core.faces.light_from_face import FRONTAL_DEG, FaceLight, light_on_head, usual_pose
from app.core.faces.pose import head_pose
from app.core.portrait.ratio_and_glare import lighting_ratio
from app.core.solver.place_light import PlaceLight, turned
from app.core.solver.search import luminance_of
from app.core.solver.style_signature import Grade
from app.core.solver.style_verdict import judge, measure_picture
from app.core.solver.transport import Transport, render
from app.core.solver.turn_choice import LIMITS
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_file import load_named_pack


@dataclass(frozen=True, eq=False)
class Promise:
    """The light that a style promises, at the turn offered for a place or in the studio.

    Attributes:
        pack, name: Pack of the generic head that grades the style, and the style's name. `pack` is
            None for a style without grades.
        place: The light at the place, or None for the studio.
        goal_deg: Panorama azimuth that the face should look towards, in degrees.
        arc_deg: Clockwise range of panorama azimuths (from, to), in degrees, within which the face
            is in the promised light.
        transport: Transport of the head on screen, or None for the generic head.
    """

    pack: StylePack | None = field(repr=False)
    name: str
    place: PlaceLight | None = field(default=None, repr=False)
    goal_deg: float = 0.0
    arc_deg: tuple[float, float] = (0.0, 0.0)
    transport: Transport | None = field(default=None, repr=False)

    @cached_property
    def ratio_stops(self) -> float | None:
        """The lighting ratio as displayed, in stops, or None if it is not visible on a face."""
        if self.light.ratio_stops is None:
            return None
        if self.place is None:
            pixels = self.luminance_at(0.0)
            return lighting_ratio(head_map().transport, pixels).stops
        transport = self.transport or head_map().transport
        light = turned(self.place, self.goal_deg, transport.environment_shape)
        return lighting_ratio(transport, render(transport, light)).stops

    def on_its_scale(self, stops: float | None) -> float | None:
        """Convert a ratio measured in a photo to the scale of `ratio_stops`.

        On this scale, a photo in exactly the promised light has exactly the promised ratio.
        """
        if stops is None or self.ratio_stops is None or self.light.ratio_stops is None:
            return stops
        return max(stops + self.ratio_stops - self.light.ratio_stops, 0.0)

    @cached_property
    def light(self) -> FaceLight:
        """The light on the generic head when it faces the goal."""
        head = head_map()
        grey = np.zeros(head.side**2, np.float32)
        grey[head.transport.pixels] = self.luminance_at(self.goal_deg)
        return light_on_head(grey, np.ones(grey.size, bool), usual_pose())

    def luminance_at(self, facing_deg: float) -> Float32:
        """Return the luminance, (P,), of the head at an azimuth of the place, or in the studio."""
        transport = head_map().transport
        if self.place is not None:
            light = turned(self.place, facing_deg, transport.environment_shape)
            return render(transport, luminance_of(light))
        assert self.pack is not None, "a studio needs a style with lamps"
        return luminance(self.pack.target(self.name)).ravel()[transport.pixels].astype(np.float32)

    @property
    def faceless(self) -> bool:
        """Whether the style cannot be recognised from a face, as with a silhouette."""
        pack = self.pack
        return pack is not None and pack.styles[pack.index(self.name)].signature.areas


def promise_of_place(
    place: PlaceLight,
    goal_deg: float,
    arc_deg: tuple[float, float] | None,
    pack: StylePack | None,
    name: str,
    transport: Transport | None = None,
) -> Promise:
    """Return the promise for a place. If no arc is given, only the goal itself counts.

    Args:
        transport: Transport of the head on screen. By default, that of the generic head is used.
    """
    return Promise(pack, name, place, goal_deg, arc_deg or (goal_deg, goal_deg), transport)


def graded_by(head: str, pack: StylePack, name: str) -> StylePack | None:
    """Return the pack that grades a style on a photographed face, or None for a painted style.

    Args:
        head, pack: The head chosen by the user, and the pack of its styles.
    """
    pack = pack if head == "generic" else _generic_pack()
    return pack if any(style.name == name for style in pack.styles) else None


@lru_cache(maxsize=1)
def _generic_pack() -> StylePack:
    return load_named_pack("generic")


@dataclass(frozen=True, slots=True)
class Check:
    """A face compared with a promise.

    Attributes:
        light: The light on the face, estimated without regard to the place.
        facing_deg: Panorama azimuth that the face looks towards, in degrees, or None if unknown.
        turn_error_deg: Angle from `facing_deg` to the goal, in degrees, positive clockwise, or None
            if it is unreliable.
        key_difference_deg: Azimuth of the key light minus that of the promised key light, in
            degrees.
        match: Similarity between the visible skin and the style's target, 0 to 100.
    """

    light: FaceLight
    facing_deg: float | None = None
    standing: Standing = "unsure"
    turn_error_deg: float | None = None
    key_difference_deg: float | None = None
    grade: Grade | None = None
    match: float | None = None


def check_face(
    picture: Bytes,
    face: Face,
    promise: Promise,
    focal_px: float | None = None,
    lens_deg: float | None = None,
    *,
    key: bool = True,
) -> Check:
    """Estimate the light on a face and compare it with a promise.

    Args:
        picture: (H, W, 3) uint8. Upright sRGB picture, not mirrored.
        focal_px: Focal length, in pixels, or None if unknown.
        lens_deg: Panorama azimuth of the lens as seen from the sitter, in degrees, or None if the
            background does not reveal it.
        key: Whether to estimate the key light and the ratio in addition to the pose and the grade.
    """
    pose = head_pose(face, (picture.shape[0], picture.shape[1]), focal_px)
    grey, visible = on_head(picture, face)
    light = light_on_head(grey, visible, pose) if key else FaceLight(pose)
    result = Check(replace(light, ratio_stops=promise.on_its_scale(light.ratio_stops)))
    if result.light.azimuth_deg is not None and promise.light.azimuth_deg is not None:
        difference = wrap(result.light.azimuth_deg - promise.light.azimuth_deg)
        result = replace(result, key_difference_deg=difference)
    if promise.place is None:
        return _graded(result, grey, visible, promise)
    if lens_deg is not None:
        aside = pose.yaw_deg if abs(pose.yaw_deg) >= FRONTAL_DEG else 0.0
        result = _from_heading(result, wrap(lens_deg - aside), promise)
    else:
        facing = find_facing(grey, visible, pose, promise.place.searched)
        if facing is not None and not promise.faceless:
            result = _from_light(result, facing, promise)
    return result if result.facing_deg is None else _graded(result, grey, visible, promise)


def _from_heading(result: Check, facing_deg: float, promise: Promise) -> Check:
    where: Standing = "inside" if lies_on_arc(facing_deg, promise.arc_deg) else "outside"
    error = wrap(promise.goal_deg - facing_deg)
    return replace(result, facing_deg=facing_deg, standing=where, turn_error_deg=error)


def _from_light(result: Check, facing: FacingEstimate, promise: Promise) -> Check:
    where = standing(facing, promise.arc_deg)
    if where == "unsure":
        return result
    is_certain = arc_width(promise.arc_deg) <= WIDE_DEG and facing.sure
    error = wrap(promise.goal_deg - facing.azimuth_deg) if is_certain else None
    return replace(result, facing_deg=facing.azimuth_deg, standing=where, turn_error_deg=error)


def _graded(result: Check, grey: Float32, visible: Bools, promise: Promise) -> Check:
    pack = promise.pack
    if pack is None:
        return result
    target = promise.luminance_at(result.facing_deg or 0.0)
    row = pack.index(promise.name)
    picture = measure_picture(pack, head_map().transport, _completed(grey, visible, target))
    grade = judge(pack, row, picture, LIMITS).grade
    return replace(result, grade=grade, match=float(picture.match[row]))


def _completed(grey: Float32, visible: Bools, target: Float32) -> Float64:
    """Return the skin, (P,), with hair, eyes and hidden areas replaced by those of the head."""
    head = head_map()
    skin = (head.whole & visible)[head.transport.pixels]
    values = grey[head.transport.pixels].astype(np.float64)
    scale = values[skin].sum() / max(float(target[skin].sum()), 1e-12)
    return np.where(skin, values, scale * target)
