"""The brightness of the place, measured or entered by the user."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from app.core.base.errors import CoreError
from app.core.second_light.place_brightness import check_lux, illuminance, read_lux
from app.core.solver.place_light import PlaceLight
from app.core.text import tr
from app.ui.presenters.services import Services
from app.words.phrases.quantities import lux_words

BRIGHTNESS: tuple[tuple[str, str, float], ...] = (
    ("night", tr("Night street"), 5.0),
    ("cellar", tr("Cellar"), 30.0),
    ("living", tr("Living room"), 150.0),
    ("office", tr("Office"), 300.0),
    ("studio", tr("Studio"), 500.0),
    ("window", tr("By a window"), 1500.0),
    ("overcast", tr("Overcast sky"), 8000.0),
    ("sun", tr("Sun"), 60000.0),
)
"""The answers to "How bright is it here?".

Each has a key, a label and the vertical illuminance at the face, in lux.
"""

STATED: Final = tr("{lux} at the face, set by you")


@dataclass(frozen=True, slots=True)
class BrightState:
    """The question about the brightness of the place.

    Attributes:
        measured: Label of the button that restores the measured value, such as "Back to the
            measured 460 lx". It is an empty string if the measured value is in use or does not
            exist.
    """

    key: str = ""
    text: str = ""
    error: str = ""
    keep: str = ""
    measured: str = ""


_SAME = 0.01  # fraction of an answer's lux within which it counts as chosen


class PlaceScale:
    """The luminance represented by a radiance of 1 at the open place, in cd/m2.

    A value entered by the user is saved with the place.
    """

    def __init__(self, services: Services, changed: Callable[[], None]) -> None:
        self._services = services
        self._changed = changed
        # the user's value for a light that belongs to no saved place
        self._loose: tuple[PlaceLight, float] | None = None
        self._error = ""
        self.asking = False
        # the illuminance per unit of luminance, cached with its light and front because computing
        # it sums over all texels
        self._unit: tuple[PlaceLight, float, float] | None = None

    @property
    def white(self) -> float | None:
        """The scale in cd/m2, as set by the user or else as measured, or None if it is unknown."""
        value = self._stated
        return self._measured if value is None else value

    @property
    def camera(self) -> str:
        """Model of the camera that measured the scale, or an empty string if it is unknown."""
        place = self._services.model.place
        from_camera = place is not None and place.capture is not None and self._stated is None
        return place.capture.camera if from_camera and place and place.capture else ""

    @property
    def words(self) -> str:
        """Text such as "460 lx at the face, as measured", or "" while the scale is unknown."""
        white = self.white
        if white is None:
            return ""
        lux = lux_words(self._lux(white))
        if self._stated is None:
            return tr("{lux} at the face, as measured", lux=lux)
        return STATED.format(lux=lux)

    def state(self) -> BrightState:
        """Return the state of the question."""
        white, measured = self.white, self._measured
        if white is None:
            return BrightState(error=self._error)
        lux = self._lux(white)
        key = next((k for k, _, value in BRIGHTNESS if abs(value - lux) <= _SAME * value), "")
        back = ""
        if self._stated is not None and measured is not None:
            back = tr("Back to the measured {lux}", lux=lux_words(self._lux(measured)))
        return BrightState(
            key=key,
            text="" if key and self._stated is not None else lux_words(lux).removesuffix(" lx"),
            error=self._error,
            keep=tr("Keep {lux}", lux=lux_words(lux)),
            measured=back,
        )

    def ask(self) -> None:
        """Ask for the brightness again, even though there is an answer."""
        self.asking, self._error = True, ""
        self._changed()

    def keep(self) -> None:
        """Keep the current value, and close the question."""
        self.asking, self._error = False, ""
        self._changed()

    def choose(self, key: str) -> None:
        """Use the answer in `BRIGHTNESS` with the given key."""
        self._say(next(lux for name, _, lux in BRIGHTNESS if name == key))

    def type(self, text: str) -> None:
        """Use a light meter reading typed by the user."""
        try:
            lux = read_lux(text)
        except CoreError as error:
            self._error = str(error)
            self._changed()
            return
        self._say(lux)

    def measure(self) -> None:
        """Revert to the measured value."""
        self._keep(None)

    def place_changed(self) -> None:
        """Close the question, because a different place is now open."""
        self.asking, self._error = False, ""

    @property
    def _measured(self) -> float | None:
        place = self._services.model.place
        white = place.capture.white_cd_m2 if place is not None and place.capture else None
        return white or None

    @property
    def _stated(self) -> float | None:
        model = self._services.model
        if model.place is not None:
            return model.place.said_white_cd_m2
        loose = self._loose
        return loose[1] if loose is not None and loose[0] is model.light else None

    def _lux(self, white: float) -> float:
        """Return the vertical illuminance at the face at turn 0, in lux."""
        model, cache = self._services.model, self._unit
        if model.light is None:
            return 0.0
        if cache is None or cache[0] is not model.light or cache[1] != model.front_deg:
            unit = illuminance(model.light.searched, model.front_deg)
            self._unit = cache = (model.light, model.front_deg, unit)
        return white * cache[2]

    def _say(self, lux: float) -> None:
        unit = self._lux(1.0)
        if unit <= 0.0:
            self._error = tr("No light comes from where the photographer stands.")
            self._changed()
            return
        self._keep(check_lux(lux) / unit)

    def _keep(self, white: float | None) -> None:
        model = self._services.model
        self.asking, self._error = False, ""
        if model.place is not None:
            # The window saves this value with the place.
            model.update(place=replace(model.place, said_white_cd_m2=white))
        elif model.light is not None:
            self._loose = None if white is None else (model.light, white)
        self._changed()
