"""Which screen is shown when, and how it is made. Each is imported when it is first shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

from app.ui.presenters.model import Step

if TYPE_CHECKING:
    from collections.abc import Sequence

    from PySide6.QtWidgets import QWidget

    from app.ui.presenters.actions import Action
    from app.ui.presenters.model import Model
    from app.ui.presenters.place_controller import PlaceController
    from app.ui.presenters.services import Services

ScreenKey: TypeAlias = Literal["probe", "styles", "paint", "turn", "light"]


class ScreenPresenter(Protocol):
    """What the frame needs of every screen's presenter."""

    def attach(self, view: Any) -> None:
        """Show everything in `view` from now on."""

    def detach(self) -> None:
        """Show nothing any more; the view is going away."""

    def entered(self) -> None:
        """Begin: the screen has come to the front."""

    def left(self) -> None:
        """Pause: the screen is no longer in front."""

    def actions(self) -> Sequence[Action]:
        """Give what can be done here; the shortcuts hold while the screen is in front."""


def screen_of(model: Model) -> ScreenKey:
    """Say which screen belongs in front."""
    if model.step is Step.STYLES and model.painting is not None:
        return "paint"
    keys: dict[Step, ScreenKey] = {
        Step.PROBE: "probe",
        Step.STYLES: "styles",
        Step.TURN: "turn",
        Step.LIGHT: "light",
    }
    return keys[model.step]


def make_presenter(key: ScreenKey, services: Services, desk: PlaceController) -> ScreenPresenter:
    """Make the presenter of a screen; it lives as long as the window."""
    if key == "probe":
        from app.ui.screens.probe.presenter import ProbePresenter

        return ProbePresenter(services, desk)
    if key == "styles":
        from app.ui.screens.styles.presenter import StylesPresenter

        return StylesPresenter(services, desk)
    if key == "paint":
        from app.ui.screens.paint.presenter import PaintPresenter

        return PaintPresenter(services, desk)
    if key == "turn":
        from app.ui.screens.turn.presenter import TurnPresenter

        return TurnPresenter(services, desk)
    from app.ui.screens.light.presenter import LightPresenter

    return LightPresenter(services, desk)


def make_view(key: ScreenKey, presenter: Any, compact: bool) -> QWidget:
    """Make the view of a screen; it is made anew when theme, scale or layout change."""
    if key == "probe":
        from app.ui.screens.probe.view.screen import ProbeScreen

        return ProbeScreen(presenter, compact)
    if key == "styles":
        from app.ui.screens.styles.view.screen import StylesScreen

        return StylesScreen(presenter, compact)
    if key == "paint":
        from app.ui.screens.paint.view.screen import PaintScreen

        return PaintScreen(presenter, compact)
    if key == "turn":
        from app.ui.screens.turn.view.screen import TurnScreen

        return TurnScreen(presenter, compact)
    from app.ui.screens.light.view.screen import LightScreen

    return LightScreen(presenter, compact)
