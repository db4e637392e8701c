"""The step for a second light: what each style out of reach lacks, and where its lamps stand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

from app.ui.presenters.actions import Action
from app.ui.presenters.model import Step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.core.solve import StyleResult
    from app.core.styles import Style, StyleLamp
    from app.ui.presenters.desk import Desk
    from app.ui.presenters.services import Services

__all__ = ["LightPresenter", "LightRow", "LightState", "LightView", "lamp_words"]

_SHOWN: Final = frozenset({"results", "head", "light"})
_FRONT: Final = ((15.0, "in front"), (60.0, "a little in front"), (110.0, "level with the ears"))
_LEVEL_DEG: Final = 5.0


@dataclass(frozen=True, slots=True)
class LightRow:
    """A style that this place cannot give.

    Attributes
    ----------
    name, title, reason : str
        The style, and what the place lacks.
    lamps : tuple of str
        Where its lamps stand in a studio, in words.
    """

    name: str
    title: str
    reason: str
    lamps: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LightState:
    """What the step shows.

    Attributes
    ----------
    headline, words : str
        What this step is about, now.
    rows : tuple of LightRow
        Styles out of reach.
    action : str
        Words on the button that leads on.
    """

    headline: str
    words: str
    rows: tuple[LightRow, ...] = ()
    action: str = "Go to Probe"


class LightView(Protocol):
    """Shows a `LightState`."""

    def show_state(self, state: LightState) -> None:
        """Show it."""


class LightPresenter:
    """Says what a second light would have to do here.

    Parameters
    ----------
    services : Services
        The window's.
    desk : Desk
        The open place.
    """

    def __init__(self, services: Services, desk: Desk) -> None:
        del desk
        self._services = services
        self._view: LightView | None = None
        services.model.changed.connect(self._model_changed)

    def attach(self, view: LightView) -> None:
        """Show everything in `view` from now on."""
        self._view = view
        view.show_state(self.resolve())

    def detach(self) -> None:
        """Show nothing any more."""
        self._view = None

    def entered(self) -> None:
        """Nothing is to be started."""

    def left(self) -> None:
        """Nothing is to be stopped."""

    def actions(self) -> Sequence[Action]:
        """Give the one thing that leads on."""
        return (Action("light-on", self.resolve().action, self.go_on, "", "Return; Enter"),)

    def go_on(self) -> None:
        """Go where the button says."""
        model = self._services.model
        model.update(step=Step.PROBE if model.light is None else Step.STYLES, painting=None)

    def choose(self, name: str) -> None:
        """Look at a style in the gallery."""
        self._services.model.choose(name)
        self._services.model.update(step=Step.STYLES, painting=None)

    def resolve(self) -> LightState:
        """Work out what the step shows now."""
        model = self._services.model
        if model.light is None:
            return LightState(
                "A lamp of your own can bring back what a place lacks.",
                "Measure the light first: then this step lists the styles that are out of reach, "
                "and from where each of them is lit in a studio.",
            )
        styles = {style.name: style for style in model.head.pack.styles} if model.head else {}
        rows = tuple(
            _row(result, styles.get(result.name))
            for result in model.results
            if not result.attainable
        )
        if not rows:
            return LightState(
                "Every style is in reach here.",
                "This place needs no second light.",
                action="Back to the styles",
            )
        count = "One style is" if len(rows) == 1 else f"{len(rows)} styles are"
        return LightState(
            f"{count} out of reach here. A lamp can help.",
            "Turn so that the light of the place does what it can, then hold a phone, a panel or "
            "a flash where the style has its lamp in a studio. Start close: at half the distance "
            "a lamp is four times as bright.",
            rows,
            "Back to the styles",
        )

    def _model_changed(self, names: frozenset[str]) -> None:
        if names & _SHOWN and self._view is not None:
            self._view.show_state(self.resolve())


def lamp_words(lamp: StyleLamp) -> str:
    """Say where a lamp stands: side, front or back, height.

    Parameters
    ----------
    lamp : StyleLamp
        Relative to the face.

    Returns
    -------
    str
        "to the sitter's left (camera right), a little in front, raised 35°".
    """
    away = abs(lamp.azimuth_deg)
    parts = []
    if 5.0 < away < 175.0:
        left = lamp.azimuth_deg > 0
        parts.append(
            "to the sitter’s left (camera right)" if left else "to the sitter’s right (camera left)"
        )
    depth = next((words for limit, words in _FRONT if away <= limit), "")
    parts.append(depth or ("a little behind" if away <= 150.0 else "behind"))
    height = round(lamp.elevation_deg)
    if abs(height) < _LEVEL_DEG:
        parts.append("at face height")
    else:
        parts.append(f"{'raised' if height > 0 else 'lowered'} {abs(height)}°")
    return ", ".join(parts)


def _row(result: StyleResult, style: Style | None) -> LightRow:
    lamps = tuple(lamp_words(lamp) for lamp in style.lamps) if style is not None else ()
    title = style.full_title if style is not None else result.title
    return LightRow(result.name, title, result.reason or "", lamps)
