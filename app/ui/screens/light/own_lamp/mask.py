"""Painting, detecting and saving the mask of a captured lamp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol, TypeAlias

import numpy as np

from app.core.base.arrays import Bytes, Float32
from app.core.base.colour import LUMINANCE_WEIGHTS, to_bytes
from app.core.base.errors import CoreError
from app.core.second_light.captured_lamps.captured_lamp import CapturedLamp, centroid, make_lamp
from app.core.second_light.captured_lamps.lamp_library import update_lamp
from app.core.second_light.captured_lamps.lamp_mask import find_mask
from app.core.second_light.captured_lamps.mask_brush import stroke
from app.core.text import tr
from app.ui.presenters.file_changes import FileChange
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.words.phrases.quantities import lux_words

Point: TypeAlias = tuple[float, float]

RADII_DEG: Final = (0.5, 12.0)
"""Smallest and largest radii of the brush, in degrees."""

_FIND: Final = "light-mask"

_MEASURE: Final = "light-mask-lux"

_MOST_UNDONE: Final = 50

_DEEP: Final = 2000.0  # ratio of the lamp's level to the darkest level that stays visible


@dataclass(frozen=True, slots=True, eq=False)
class MaskState:
    """The contents of the sheet.

    Attributes:
        picture: The capture with its shadows raised, (H, 2 H, 3) uint8 sRGB.
        alpha: The mask as currently painted, (H, 2 H) float32.
        centre: Azimuth and elevation of the lamp, in degrees, at which the view is initially
            centred.
        gives: A sentence such as "The lamp produces 640 lx at the camera."
    """

    title: str
    picture: Bytes = field(repr=False)
    alpha: Float32 = field(repr=False)
    centre: Point
    adds_lamp: bool = True
    radius_deg: float = 3.0
    can_undo: bool = False
    changed: bool = False
    busy: bool = False
    gives: str = ""
    error: str = ""


class MaskView(Protocol):
    """A view that shows a `MaskState`."""

    def show_state(self, state: MaskState) -> None:
        """Show the state."""

    def shut(self) -> None:
        """Close the sheet after saving."""


class MaskLook(NamedTuple):
    """The sheet's initial contents, as returned by `look_at_mask`.

    Attributes:
        picture: The capture, (H, 2 H, 3) uint8 sRGB, as in `MaskState`.
    """

    picture: Bytes
    centre: Point
    gives: str


class _Patch(NamedTuple):
    """A part of a mask as it was before a change."""

    rows: slice
    columns: slice
    alpha: Float32


def look_at_mask(lamp: CapturedLamp) -> MaskLook:
    """Prepare the contents of the sheet for a lamp's mask. This takes a moment."""
    return MaskLook(_picture(lamp), centroid(lamp.light), _size_words(lamp, lamp.alpha))


class MaskEdit:
    """The mask of a lamp while the user is editing it."""

    def __init__(
        self,
        services: Services,
        place_controller: PlaceController,
        folder: Path,
        lamp: CapturedLamp,
        look: MaskLook,
        saved: Callable[[], None],
    ) -> None:
        self._services = services
        self._place_controller = place_controller
        self._folder = folder
        self._lamp = lamp
        self._saved = saved
        self._view: MaskView | None = None
        self._before: list[_Patch] = []
        self._untouched: Float32 = lamp.alpha
        self._last: Point | None = None
        picture, centre, gives = look
        self._state = MaskState(lamp.title, picture, lamp.alpha, centre, gives=gives)

    def attach(self, view: MaskView) -> None:
        """Start showing the state in `view`."""
        self._view = view
        self._show()

    def detach(self) -> None:
        """Close the sheet and discard unsaved changes."""
        self._view = None
        self._services.runner.cancel(_FIND)
        self._services.runner.cancel(_MEASURE)

    def state(self) -> MaskState:
        """Return the state of the sheet."""
        changed = self._state.alpha is not self._lamp.alpha
        return replace(self._state, can_undo=bool(self._before), changed=changed)

    def _show(self, **changes: Any) -> None:
        """Change fields of the `MaskState`, and show the result."""
        self._state = replace(self._state, **changes)
        if self._view is not None:
            self._view.show_state(self.state())

    def set_lit(self, adds_lamp: bool) -> None:
        """Set whether the brush adds to the mask or erases from it."""
        self._show(adds_lamp=adds_lamp)

    def set_radius(self, radius_deg: float) -> None:
        """Set the radius of the brush, in degrees."""
        self._show(radius_deg=min(max(radius_deg, RADII_DEG[0]), RADII_DEG[1]))

    def press(self, at: Point) -> None:
        """Start a stroke at an azimuth and elevation in degrees. Undo removes a whole stroke."""
        if self._state.busy:
            return
        self._untouched = self._state.alpha
        self._last = at
        self._paint((at,))

    def draw(self, points: Sequence[Point]) -> None:
        """Continue the stroke through the given points."""
        if self._last is not None and points:
            self._paint((self._last, *points))
            self._last = points[-1]

    def lift(self) -> None:
        """End the stroke."""
        if self._last is not None:
            self._last = None
            self._remember(self._untouched)
            self._settled()

    def undo(self) -> None:
        """Undo the last stroke."""
        self.lift()
        if self._before and not self._state.busy:
            *self._before, patch = self._before
            earlier = self._state.alpha.copy()
            earlier[patch.rows, patch.columns] = patch.alpha
            # If the mask equals the saved mask again, there is nothing to save.
            same = np.array_equal(earlier, self._lamp.alpha)
            self._settled(alpha=self._lamp.alpha if same else earlier)

    def find_again(self) -> None:
        """Detect the lamp again, replacing the mask. The user can undo this."""
        radiance = self._lamp.radiance
        self._show(busy=True)
        self._services.runner.submit(
            _FIND, lambda *_: find_mask(radiance).alpha, done=self._take_alpha, failed=self._failed
        )

    def save(self) -> None:
        """Save the mask with the lamp, and move the old mask to the trash folder."""
        lamp, alpha, folder = self._lamp, self._state.alpha, self._folder
        if self._state.busy or alpha is lamp.alpha:
            return
        self._show(busy=True)

        def work() -> CapturedLamp:
            edited = make_lamp(
                lamp.name,
                lamp.radiance,
                alpha,
                title=lamp.title,
                white_cd_m2=lamp.white_cd_m2,
                distance_m=lamp.distance_m,
                camera=lamp.camera,
            )
            update_lamp(folder, edited)
            return edited

        change = FileChange(
            self._place_controller.file_work,
            tr("new mask of {title}", title=lamp.title),
            work,
            lambda _: update_lamp(folder, lamp),
            on_apply=lambda _: self._on_saved(change),
            undone=lambda _: self._saved(),
            failed=self._failed,
        )
        change.begin()

    def _paint(self, points: tuple[Point, ...]) -> None:
        state = self._state
        painted = stroke(state.alpha, points, state.radius_deg, state.adds_lamp)
        self._show(alpha=painted, error="")

    def _take_alpha(self, alpha: Float32) -> None:
        before, self._state = self._state.alpha, replace(self._state, alpha=alpha)
        self._remember(before)
        self._settled()

    def _settled(self, **changes: Any) -> None:
        """Show the change, and compute the lamp's illuminance."""
        self._show(busy=False, error="", **changes)
        lamp, alpha = self._lamp, self._state.alpha
        self._services.runner.submit(
            _MEASURE,
            lambda *_: _size_words(lamp, alpha),
            done=lambda gives: self._show(gives=gives),
        )

    def _remember(self, before: Float32) -> None:
        """Store the changed part of the mask for undo."""
        changed = before != self._state.alpha
        rows, columns = (np.flatnonzero(changed.any(axis=axis)) for axis in (1, 0))
        if not rows.size:
            return
        high, wide = (slice(int(each[0]), int(each[-1]) + 1) for each in (rows, columns))
        patch = _Patch(high, wide, before[high, wide].copy())
        self._before = [*self._before[-_MOST_UNDONE:], patch]

    def _failed(self, error: Exception) -> None:
        sentence = str(error)
        if not isinstance(error, CoreError):
            self._services.notify.tell_error(error)
            sentence = tr("The mask was not saved.")
        self._show(busy=False, error=sentence)

    def _on_saved(self, change: FileChange[CapturedLamp]) -> None:
        self._state = replace(self._state, busy=False)
        if self._view is not None:
            self._view.shut()
        self._services.notify.tell(
            tr("Mask of “{title}” saved.", title=self._lamp.title),
            kind="done",
            actions=((tr("Undo"), change.take_back),),
        )
        self._saved()


def _size_words(lamp: CapturedLamp, alpha: Float32) -> str:
    """Return a sentence on a masked lamp's illuminance, or "" if the exposure is unknown."""
    if lamp.white_cd_m2 is None:
        return ""
    draft = replace(lamp, alpha=alpha)
    lux = draft.lux if alpha.any() else 0.0
    return tr("The lamp produces {lux} at the camera.", lux=lux_words(lux or 0.0))


def _picture(lamp: CapturedLamp) -> Bytes:
    """Render a capture to show both the shape of the lamp and the dark room."""
    light = lamp.radiance @ np.array(LUMINANCE_WEIGHTS, np.float32)
    lamp_pixels = light[lamp.alpha > 0.5]
    top = float(np.percentile(lamp_pixels, 95.0)) if lamp_pixels.size else float(light.max())
    level = np.maximum(lamp.radiance, 0.0) * np.float32(_DEEP / max(top, 1e-30))
    tones = np.log1p(level) / np.float32(np.log1p(_DEEP))
    return to_bytes(np.clip(tones, 0.0, 1.0).astype(np.float32))
