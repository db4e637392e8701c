"""The choice of lamps and camera position, on which every answer depends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, cast

from app.core.base.angles import wrap
from app.core.base.arrays import Bytes
from app.core.solver.lens.lens_wish import STRAIGHT, LensWish, YawAsked, YawWord
from app.core.solver.style_result import StyleResult
from app.core.styles.lamps import (
    AS_PUBLISHED,
    Studio,
    choice_keys,
    parse_ratio,
    parse_softness,
)
from app.core.text import tr
from app.ui.presenters.services import Services
from app.ui.screens.styles.pictures import StylesPictures
from app.words.lamps import RATIO_CHOICES, SIZE_CHOICES, studio_words
from app.words.phrases.directions import LENS_CHOICES, aside_words

if TYPE_CHECKING:
    from app.ui.presenters.place_controller import PlaceController

_ASIDE: Final = tr("aside")
_LENS_SHORT: Final = {
    "0": tr("straight"),
    "auto": tr("best"),
    "short": tr("short"),
    "broad": tr("broad"),
}


@dataclass(frozen=True, slots=True)
class LampsState:
    """The lamps for the current style or for all styles.

    Attributes:
        words: Text such as "Lamps: 30°, 4:1".
        sizes: Key and label for each available lamp size.
        size, ratio: Keys of the selected lamps.
        only: Whether the selection applies only to the current style.
        own: Whether the current style can have its own lamps. A painted style cannot.
        works: Whether a place is open in which to save the selection.
    """

    words: str = tr("Lamps: {lamps}", lamps=tr("standard"))
    sizes: tuple[tuple[str, str], ...] = tuple(SIZE_CHOICES.items())
    size: str = "paper"
    ratio: str = "none"
    only: bool = False
    own: bool = False
    works: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class LensState:
    """The camera position.

    Attributes:
        short, words: Display text such as "Lens: short" and "Lens: short light".
        key: One of `LENS_CHOICES`.
        background: Panorama azimuth required behind the sitter, in degrees, or None if any will do.
        width: Tolerance on either side of that azimuth, in degrees.
    """

    short: str = tr("Lens: straight")
    words: str = tr("Lens: {lens}", lens=tr("Face to the lens"))
    key: str = "0"
    background: float | None = None
    width: float = 20.0
    panorama: Bytes | None = field(default=None, repr=False)
    works: bool = False


class LampsChoice:
    """Sets the lamps that light the targets, either for all styles or for the current one."""

    def __init__(
        self, services: Services, place_controller: PlaceController, pictures: StylesPictures
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._pictures = pictures

    def resolve(self) -> LampsState:
        """Return the lamps for the current style."""
        model, snapshot, style = self._services.model, self._pictures.snapshot, self._style
        studios = model.studios
        studio = studios.get(style, studios.get("", AS_PUBLISHED))
        size, ratio = choice_keys(studio)
        sizes = SIZE_CHOICES if size in SIZE_CHOICES else {**SIZE_CHOICES, size: f"{size}°"}
        return LampsState(
            words=tr("Lamps: {lamps}", lamps=studio_words(studio)),
            sizes=tuple(sizes.items()),
            size=size,
            ratio=ratio,
            only=style in studios,
            own=snapshot is not None and style not in snapshot.asking,
            works=model.place is not None,
        )

    def prepare(self) -> None:
        """Compute in advance the answers for all lamps that are one click away."""
        now = self.resolve()
        pairs = [(now.size, ratio) for ratio in RATIO_CHOICES]
        pairs += [(size, now.ratio) for size in SIZE_CHOICES]
        self._place_controller.prepare_lamps([_studio(*pair) for pair in pairs], self._of_style())

    def choose(self, size: str, ratio: str) -> None:
        """Light the targets with other lamps, given by keys from `LampsState`."""
        self._place_controller.choose_lamps(_studio(size, ratio), self._of_style())

    def keep_to_style(self, only: bool) -> None:
        """Give the current style its own lamps, or return it to the lamps shared by all styles."""
        model, style = self._services.model, self._style
        if style:
            now = model.studios.get("", AS_PUBLISHED)
            self._place_controller.choose_lamps(now if only else None, style)

    def _of_style(self) -> str:
        """Return the name of the current style if it has its own lamps, or "" for all styles."""
        return self._style if self.resolve().only else ""

    @property
    def _style(self) -> str:
        """Name of the current style in the style pack."""
        snapshot, front = self._pictures.snapshot, self._pictures.front or ""
        return front if snapshot is None else snapshot.source(front)


class LensChoice:
    """Sets the angle of the face to the lens, and the background behind the sitter."""

    def __init__(
        self, services: Services, place_controller: PlaceController, pictures: StylesPictures
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._pictures = pictures

    def resolve(self) -> LensState:
        """Return the camera position."""
        model = self._services.model
        lens, light = model.lens, model.light
        key = lens.yaw if isinstance(lens.yaw, str) else f"{lens.yaw:g}"
        name = LENS_CHOICES.get(key) or aside_words(float(key))
        middle, width = None, 20.0
        if lens.background is not None:
            start, end = lens.background
            width = (end - start) % 360.0 / 2.0
            middle = wrap(start + width)
        return LensState(
            short=tr("Lens: {lens}", lens=_LENS_SHORT.get(key, _ASIDE)),
            words=tr("Lens: {lens}", lens=name),
            key=key,
            background=middle,
            width=width,
            panorama=None if light is None else light.display,
            works=self.works(),
        )

    def works(self) -> bool:
        """Return whether a place is open and the head has turned views."""
        model = self._services.model
        return model.place is not None and model.head is not None and bool(model.head.views)

    def choose(self, key: str) -> None:
        """Choose the angle of the face to the lens, given by its key in `LENS_CHOICES`."""
        yaw: YawAsked = float(key) if key.lstrip("-").isdigit() else cast("YawWord", key)
        self._place_controller.choose_lens(replace(self._services.model.lens, yaw=yaw))

    def choose_background(self, middle_deg: float | None, width_deg: float = 20.0) -> None:
        """Require a panorama azimuth in degrees behind the sitter, or allow any if this is None.

        A lens straight in front of the face allows only one background. Requiring a background
        therefore frees such a lens to move.
        """
        lens = self._services.model.lens
        if middle_deg is None:
            self._place_controller.choose_lens(replace(lens, background=None))
            return
        ends = wrap(middle_deg - width_deg), wrap(middle_deg + width_deg)
        yaw: YawAsked = "auto" if lens == STRAIGHT else lens.yaw
        self._place_controller.choose_lens(LensWish(yaw, ends))

    def background_now(self) -> float:
        """Return the panorama azimuth behind the sitter for the current style, in degrees."""
        result: StyleResult | None = self._pictures.result
        return wrap(self._services.model.front_deg + (result.background_deg if result else 180.0))


def _studio(size: str, ratio: str) -> Studio:
    return Studio(parse_softness(size), parse_ratio(ratio))
