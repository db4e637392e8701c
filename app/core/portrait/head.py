"""A head with its styles, as lit by the lamps of a studio, and its portraits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Final, TypeAlias

import cv2
import numpy as np

from app.core.base import colour
from app.core.base.arrays import Bytes, Float32
from app.core.base.colour import FloatImage
from app.core.base.errors import TransportError
from app.core.environment.environment import SHAPE
from app.core.measure.finish.findings import Findings
from app.core.painting.paint_on_turned_head import PaintedHead
from app.core.painting.user_style import UserStyle, prepare_user_style
from app.core.portrait.background import background, background_gain
from app.core.portrait.catchlights import Catchlight, catchlights
from app.core.portrait.display_pictures import WELL
from app.core.portrait.full_size_portrait import portrait_picture, portrait_pictures
from app.core.portrait.gallery_portraits import (
    Framing,
    LightSource,
    framing,
    large_portrait,
    light_exposures,
    portraits,
    rule_of,
    style_exposures,
)
from app.core.portrait.head_views import HeadViews, load_views_of
from app.core.portrait.light import PortraitLight, lamps_light, portrait_light
from app.core.portrait.portrait_file import PLAIN, load_portrait
from app.core.portrait.portrait_head import ROOM, PortraitHead, PortraitSkin
from app.core.solver.head_shape import load_shape_of
from app.core.solver.lens.view_tables import ViewTables, tables_of, targets_in, views_of
from app.core.solver.place_light import Expose, Facing, PlaceLight, picture_at
from app.core.solver.transport import Transport, render, to_image
from app.core.styles.lamps import AS_PUBLISHED, Studio, studio_lamps
from app.core.styles.style import Style
from app.core.styles.style_pack import StylePack
from app.core.styles.style_pack_build import StudioPacks
from app.core.styles.style_pack_file import (
    load_named_pack,
    load_transport_of,
    own_heads,
    pack_names,
)
from app.core.styles.styles import mirror_name
from app.core.text import tr

Size: TypeAlias = tuple[int, int]
Gains: TypeAlias = Sequence[float]
Pictures: TypeAlias = "Sequence[FloatImage] | FloatImage"
FULL_SIZE: Final = 64
"""Rows or columns from which a portrait is drawn from skin nodes instead of from T."""
SMALL_SIZE: Final = 320
"""Rows or columns up to which half the size is sufficient."""
_DARKEST: Final = 0.02  # of the brightest: darker values are not brightened much
_MOST_VIEWS: Final = 6  # views cached by a head, 30 MB each with its portrait
_MOST_STUDIOS: Final = 4  # heads in other lamps cached by a head, with their search data
_PACKS: Final = 16  # packs cached by a head for other lamps, 1.5 MB each, 6 MB once solved


@dataclass(frozen=True, eq=False)
class Head:
    """A head, its styles and the lamps that light it."""

    name: str
    pack: StylePack = field(repr=False)
    transport: Transport = field(repr=False)
    hair: str = PLAIN
    # whether the place is shown behind the head, out of focus
    in_place: bool = False
    # lamps of the pack's targets, as in `Place.studios`
    studios: Mapping[str, Studio] = field(default_factory=dict)
    # the same head under the styles' own lamps, if that is a different object
    published: Head | None = field(default=None, repr=False)
    # turn of the face towards its own left from the line to the lens: lights are counted from the
    # nose's direction
    yaw_deg: float = 0.0
    # the same head with its nose to the lens, if that is a different object
    front: Head | None = field(default=None, repr=False)

    @cached_property
    def _packs(self) -> Callable[[frozenset[tuple[str, Studio]]], StylePack]:
        packs = StudioPacks(self.pack, self.transport, load_shape_of(self.transport, self.name))

        @lru_cache(maxsize=_PACKS)
        def pack_for(choices: frozenset[tuple[str, Studio]]) -> StylePack:
            studios = dict(choices)
            return packs.pack_for(studios.get("", AS_PUBLISHED), studios)

        return pack_for

    def pack_in(self, studios: Mapping[str, Studio]) -> StylePack:
        """Return the pack with its targets under other lamps. The most recent packs are cached."""
        return (self.published or self)._packs(frozenset(studios.items()))

    def lit_by(self, studios: Mapping[str, Studio]) -> Head:
        """Return the head with targets under other lamps. The first call takes half a second."""
        if studios == self.studios:
            return self
        return (self.published or self)._in_studios(frozenset(studios.items()))

    @cached_property
    def _in_studios(self) -> Callable[[frozenset[tuple[str, Studio]]], Head]:
        @lru_cache(maxsize=_MOST_STUDIOS)
        def in_studios(choices: frozenset[tuple[str, Studio]]) -> Head:
            pack = self._packs(choices)
            # The next search needs these tables, and this is not the window's thread.
            _ = pack.tables
            return replace(self, pack=pack, studios=dict(choices), published=self)

        return in_studios

    @cached_property
    def views(self) -> list[ViewTables]:
        """The search tables for the side views, or an empty list if the head has no such views."""
        try:
            # With other lamps, reuse the views of the published head, which take 20 MB.
            if self.published is None:
                return views_of(self.pack, self.name)
            return tables_of(self.pack, self.published.aside)
        except TransportError:
            return []

    def turned(self, yaw_deg: float) -> Head:
        """Return the turned head, in the nearest baked view."""
        return self if not yaw_deg or self.yaw_deg else self._turned(yaw_deg)

    @cached_property
    def aside(self) -> HeadViews:
        """All side views of the head. They take up 20 MB and are read only once."""
        return load_views_of(self.pack, self.name)

    @cached_property
    def _turned(self) -> Callable[[float], Head]:
        @lru_cache(maxsize=_MOST_VIEWS)
        def turned(yaw_deg: float) -> Head:
            views, pack = self.aside, self.pack
            yaw = views.nearest(yaw_deg)
            if not yaw:
                return self
            view = views.at(yaw, pack.styles)
            view_transport, targets = view.transport, targets_in(pack, view)
            # Use the skin's colour, since in deep shadow a view's own colour is lost in its noise.
            tint = render(view_transport, np.ones((*view_transport.environment_shape, 3))).mean(
                axis=0
            )
            studio_pictures = [
                to_image(view_transport, one[:, np.newaxis] * tint / tint.max()) for one in targets
            ]
            coverage = to_image(view_transport, view_transport.coverage).astype(np.float16)
            there = replace(
                pack, targets=np.stack(studio_pictures).astype(np.float16), coverage=coverage
            )
            return replace(self, pack=there, transport=view_transport, yaw_deg=yaw, front=self)

        return turned

    def painted(self) -> PaintedHead:
        """Return the head with its turned views, for painted styles."""
        return PaintedHead(self.transport, self.aside, self.pack.styles)

    def target_of(self, style: UserStyle) -> FloatImage:
        """Return the target picture of a painted style, (N, N, 3), as seen by the lens."""
        if self.front is None:
            return prepare_user_style(self.transport, style).target
        return self.front.painted().target(style, self.yaw_deg)

    def expose_of(self, style: str) -> Expose:
        """Return the subject that a built-in style is exposed for, or "face" for any other name."""
        return next((one.expose for one in self.pack.styles if one.name == style), "face")

    def studio_wanted(self, style: str) -> Studio:
        """Return the lamps chosen for a style, as opposed to those in use (`StylePack.studio`)."""
        return self.studios.get(style, self.studios.get("", AS_PUBLISHED))

    def portrait(self, linear: FloatImage, size: Size, light: LightSource = None) -> Bytes:
        """Develop a linear picture of the head, (N, N, 3), as sRGB at a given size.

        The picture is exposed for its light, which is even light by default. A large picture in the
        light of a place or a style is drawn at full size.
        """
        return self.portraits([linear], size, [light])[0]

    def portraits(
        self,
        linear: Pictures,
        size: Size,
        lights: Sequence[LightSource],
        *,
        close: bool = False,
        quick: bool = False,
        draft: bool = False,
        gains: Gains = (),
    ) -> list[Bytes]:
        """Develop several pictures of the head.

        Args:
            linear: (n, N, N, 3). Linear Rec. 709.
            size: Number of rows and columns of each result.
            lights: The light in each picture.
            close: Whether to show the head alone, without neck and shoulders.
            quick: Whether to draw from the transport, whatever the size.
            draft: Whether to draw with half as many pixels across, for moving pictures.
            gains: Exposure gains. By default, those from `exposures` are used.

        Returns:
            One picture for each light, (rows, columns, 3) uint8 sRGB.
        """
        gains = gains or self.exposures(linear, lights)
        if not quick and self.full_at(size):
            return self._full(linear, size, lights, close, draft, gains)
        above = ROOM if self.may_be_full_at(size) else None
        frame = framing(self.transport.size, size, close, above=above)
        pictures = portraits(np.asarray(linear), self._coverage, frame, gains)
        for picture, light, gain in zip(pictures, lights, gains, strict=True):
            if (behind := self._behind(light, frame)) is not None:
                # A target has a scale of its own, unlike its light.
                own = self._background_exposure(light) if isinstance(light, Style) else None
                self._put_behind(picture, behind, frame, own or gain)
        return list(pictures)

    def exposures(self, linear: Pictures, lights: Sequence[LightSource]) -> tuple[float, ...]:
        """Return the gains for the transport's pictures, which also apply at full size."""
        gains = style_exposures(self.transport, np.asarray(linear), self._coverage, lights)
        each = zip(lights, gains, strict=True)
        return tuple(self._exposed_for_background(light, gain) for light, gain in each)

    def _exposed_for_background(self, light: LightSource, gain: float) -> float:
        """Replace a picture's gain if its background decides the exposure."""
        own = self._background_exposure(light)
        if own is None or not isinstance(light, Style):
            return own or gain
        # A target has a scale of its own, unlike its light.
        return own * gain / light_exposures(self.transport, [self._lit(light)])[0]

    def _background_exposure(self, light: LightSource) -> float | None:
        """Return the gain of a light exposed for its background, or None if there is none."""
        around = self._around(light) if rule_of(light) == "background" else None
        if around is None:
            return None
        return background_gain(*around, self._coverage, self.transport.header)

    def _lit(self, style: Style) -> Style:
        """Return a style with the lamps that the pack uses for it."""
        if style not in self.pack.styles:
            return style
        return replace(style, lamps=studio_lamps(style, self.pack.studio(style.name)))

    @cached_property
    def _coverage(self) -> Float32:
        return self.pack.coverage.astype(np.float32)

    def _behind(self, light: LightSource, frame: Framing) -> Float32 | None:
        """Return the view past the head, in the unit of the light, or None for neutral grey."""
        around = self._around(light)
        return None if around is None else background(*around, frame, self.transport.header)

    def _around(self, light: LightSource) -> tuple[FloatImage, float] | None:
        """Return the panorama behind the head and the azimuth faced, or None for neutral grey.

        A style that is exposed for its background needs a background in the studio as well.
        """
        bright = rule_of(light) == "background"
        if isinstance(light, Facing) and (self.in_place or bright):
            return light.light.environment.radiance, light.turn_deg + self.yaw_deg
        if isinstance(light, Style) and bright:
            return lamps_light(self._lit(light).lamps).panorama[:, 1:-1], self.yaw_deg
        return None

    def _put_behind(self, picture: Bytes, behind: Float32, frame: Framing, gain: float) -> None:
        """Replace the grey behind a quickly drawn picture with a background."""
        cover = np.clip(frame.of(self._coverage[np.newaxis])[0].T, 0, 1)
        backdrop = large_portrait(behind, np.zeros_like(behind), gain)
        mixed = picture + (1 - cover)[..., np.newaxis] * (backdrop.astype(np.float32) - WELL[0])
        picture[...] = np.clip(mixed + np.float32(0.5), 0, 255)

    @property
    def may_be_full(self) -> bool:
        """Whether the head is built in and may have a full-size portrait. No files are read."""
        return not self.name.endswith(".npz")

    def may_be_full_at(self, size: Size) -> bool:
        """Return whether pictures of a size may be drawn at full size, without reading any file."""
        return max(size) >= FULL_SIZE and self.may_be_full

    def full_at(self, size: Size) -> bool:
        """Return whether pictures of a size are drawn at full size."""
        return max(size) >= FULL_SIZE and self.full is not None

    @cached_property
    def full(self) -> tuple[PortraitHead, PortraitSkin] | None:
        """The data for full-size portraits, or None if the head has none."""
        header, key = self.transport.header, (self.hair, self.yaw_deg)
        portrait = load_portrait(header.head, header.skin, *key) if self.may_be_full else None
        if portrait is not None:
            # This takes half a second once, so it is never done in the window's thread.
            _ = portrait[0].nodes.soft
        return portrait

    def catchlights(self, light: Facing, findings: Findings) -> tuple[Catchlight, ...] | None:
        """Return the reflections in the eyes, or None if the head has no full-size portrait."""
        if self.full is None:
            return None
        fine_light, picture = _of_place(light.light), _draw(*self.full, light)
        return catchlights(self.full[0], fine_light, picture, light.turn_deg, findings)

    def _full(
        self,
        linear: Pictures,
        size: Size,
        lights: Sequence[LightSource],
        close: bool,
        draft: bool,
        gains: Gains,
    ) -> list[Bytes]:
        """Draw portraits at full size if their light is known."""
        assert self.full is not None
        head, skin = self.full
        alone = len(lights) == 1 and not draft
        if draft or (not alone and max(size) <= SMALL_SIZE):
            head = head.close if close else head.halved
        turns: dict[PlaceLight, list[float]] = {}
        for light in lights:
            if isinstance(light, Facing):
                turns.setdefault(light.light, []).append(light.turn_deg)
        renders = {
            place: portrait_pictures(head, skin, _of_place(place), some)
            for place, some in turns.items()
        }
        studio = self._studio(lights)
        frame = framing(head.shape[0], size, close, ROOM)
        away = _away(head, frame)
        pictures: list[Bytes] = []
        for picture, light, gain in zip(linear, lights, gains, strict=True):
            behind = self._behind(light, frame)
            if isinstance(light, Facing):
                picture = _draw(head, skin, light) if alone else next(renders[light.light])
            elif isinstance(light, Style) and light in studio:
                lit_style, gain = studio[light]
                picture = portrait_picture(head, skin, lamps_light(lit_style.lamps), 0.0)
            else:
                more = {"close": close, "quick": True}
                pictures += self.portraits([picture], size, [light], gains=[gain], **more)
                continue
            pictures.append(large_portrait(frame.cut(picture), away, gain, behind))
        return pictures

    def portrait_with(self, here: Facing, parts: Sequence[FloatImage], size: Size) -> Bytes:
        """Render the head in the light of a place and of a lamp.

        The transport's pictures, which are the first two parts, account for near light and
        occlusion. Shadows, eyes and hair come from the third part, (H, W, 3), the lamp's light as
        if from far away.
        """
        place, lamp, far = parts
        gains = self.exposures([place + lamp], [here])
        if not self.full_at(size):
            return self.portraits([place + lamp], size, [here], gains=gains)[0]
        assert self.full is not None
        (head, skin), transport = self.full, self.transport
        head = head.halved if max(size) <= SMALL_SIZE else head
        frame = framing(head.shape[0], size, False, ROOM)
        quick = picture_at(transport, here.light, here.turn_deg)
        near = portrait_picture(head, skin, portrait_light(far), 0.0)
        linear = _brought_to(_draw(head, skin, here), quick, place)
        linear += _brought_to(near, to_image(transport, render(transport, far)), lamp)
        behind = self._behind(here, frame)
        return large_portrait(frame.cut(linear), _away(head, frame), gains[0], behind)

    def _studio(self, lights: Sequence[LightSource]) -> dict[Style, tuple[Style, float]]:
        """Return the styles with the pack's lamps for each, and the exposure of their light."""
        styles = {one: self._lit(one) for one in lights if isinstance(one, Style) and one.lamps}
        gains = light_exposures(self.transport, [*styles.values()])
        return {
            style: (lit, self._background_exposure(style) or gain)
            for (style, lit), gain in zip(styles.items(), gains, strict=True)
        }


def _brought_to(full: Float32, quick: FloatImage, target: FloatImage) -> Float32:
    """Apply to a portrait the change that turns its thumbnail into the target."""
    before, after = colour.luminance(quick), colour.luminance(target)
    usual = float(after.sum()) / max(float(before.sum()), 1e-30)
    least = max(_DARKEST * float(before.max()), 1e-30)
    ratio = (after + usual * least) / (before + least)
    side = round(len(full) / ROOM)
    above, beside = len(full) - side, (len(full) - side) // 2
    large = cv2.resize(ratio, (side, side), interpolation=cv2.INTER_LINEAR)
    edges = above, 0, beside, above - beside
    return full * cv2.copyMakeBorder(large, *edges, cv2.BORDER_REPLICATE)[..., np.newaxis]


@lru_cache(maxsize=4)
def _away(head: PortraitHead, frame: Framing) -> Float32:
    """Return the fraction of each value in a framed portrait outside the head, (h, w, 3)."""
    return np.repeat(1 - frame.cut(head.coverage)[..., np.newaxis], 3, axis=2)


@lru_cache(maxsize=1)
def _draw(head: PortraitHead, skin: PortraitSkin, light: Facing) -> Float32:
    """Return the full-size picture at a place, cached for display, measurement and relighting."""
    return portrait_picture(head, skin, _of_place(light.light), light.turn_deg)


@lru_cache(maxsize=1)
def _of_place(light: PlaceLight) -> PortraitLight:
    return portrait_light(light.environment.radiance)


def list_heads(folder: Path, *files: str) -> tuple[str, ...]:
    """Return the names of all heads: the built-in ones, followed by the user's own.

    Args:
        folder: Folder that contains the user's heads.
        files: Paths of additional heads. Names of built-in heads are ignored.
    """
    own = [*map(str, own_heads(folder)), *(file for file in files if file.endswith(".npz"))]
    return (*pack_names(), *dict.fromkeys(own))


def load_head(name: str, hair: str = PLAIN, in_place: bool = False) -> Head:
    """Load a built-in head by name, or any other head by the path of its transport.

    Raises:
        TransportError: If the head is unreadable or incomplete.
    """
    pack = load_named_pack(name)
    transport = load_transport_of(pack, name)
    if name.endswith(".npz"):
        _check_own(pack, transport, name)
    # The search tables are needed first, and are better computed here than with the screen.
    _ = pack.tables
    return Head(name, pack, transport, hair, in_place)


def _check_own(pack: StylePack, transport: Transport, name: str) -> None:
    """Raise an error if a head cannot be used on every screen."""
    if pack.header.environment != SHAPE:
        raise TransportError(
            tr("The head {name} was not baked for 64 × 32 texels.", name=Path(name).name),
            tr("Bake the head again without '--env'."),
        )
    load_shape_of(transport, name)


def with_lamps(
    studios: Mapping[str, Studio], studio: Studio | None, style: str
) -> dict[str, Studio]:
    """Change the lamps for a style and its mirror image, or for all others if `style` is ""."""
    names = sorted({style, mirror_name(style)})
    new_studios = {name: one for name, one in studios.items() if name not in names}
    if studio is not None and (style or studio != AS_PUBLISHED):
        new_studios |= dict.fromkeys(names, studio)
    return new_studios
