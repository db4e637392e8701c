"""What the window needs to know of a screen: one record each, and what every presenter can do."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from app.ui.presenters.actions import Action
    from app.ui.presenters.model import Model
    from app.ui.presenters.place_controller import PlaceController
    from app.ui.presenters.services import Services


class ScreenPresenter(Protocol):
    """What the window needs of every screen's presenter."""

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


@dataclass(frozen=True, slots=True)
class ScreenSpec:
    """A screen: its code lies in `app.ui.screens.<key>`, and is imported when it is needed.

    Attributes:
        key: The package, and the value of `Model.step` that brings it to the front.
        presenter, view: Classes of the package's modules ``presenter`` and ``view.screen``.
        title, tip, command, icon: On the rail, its tool tip, and in "Find anything". Without a
            title it is not on the rail.
        in_front: When it is in front, if not by `Model.step` alone.
        done: Whether the rail marks it as done.
    """

    key: str
    presenter: str
    view: str
    title: str = ""
    tip: str = ""
    command: str = ""
    icon: str = ""
    in_front: Callable[[Model], bool] | None = None
    done: Callable[[Model], bool] = lambda model: False

    def belongs_in_front(self, model: Model) -> bool:
        """Whether this screen is to be seen now."""
        return model.step == self.key if self.in_front is None else self.in_front(model)

    def make_presenter(self, services: Services, desk: PlaceController) -> ScreenPresenter:
        """Make the presenter; it lives as long as the window."""
        made: ScreenPresenter = getattr(self._module("presenter"), self.presenter)(services, desk)
        return made

    def make_view(self, presenter: ScreenPresenter, compact: bool) -> Any:
        """Make the view, a `QWidget`; it is made anew when theme, scale or layout change."""
        return getattr(self._module("view.screen"), self.view)(presenter, compact)

    def read_in(self) -> None:
        """Import its code before it is shown."""
        self._module("presenter")
        self._module("view.screen")

    def _module(self, name: str) -> Any:
        return import_module(f"app.ui.screens.{self.key}.{name}")
