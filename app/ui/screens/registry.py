"""The registry of screens, in the order in which they appear on the rail.

The code for each screen is imported when that screen is first shown.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final, Protocol

from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Services
from app.ui.presenters.window_model import Model, Step
from app.words.phrases.turns import size_words, turn_words


class ScreenPresenter(Protocol):
    """The interface that the window requires of every screen's presenter."""

    def attach(self, view: Any) -> None:
        """Start showing the state in `view`."""

    def detach(self) -> None:
        """Stop showing the state because the view is being removed."""

    def enter(self) -> None:
        """Start work now that the screen is visible."""

    def leave(self) -> None:
        """Pause work now that the screen is hidden."""

    def actions(self) -> Sequence[Action]:
        """Return the available actions. Their shortcuts work while the screen is visible."""


@dataclass(frozen=True, slots=True)
class ScreenSpec:
    """A screen whose code is in `app.ui.screens.<key>` and is imported on demand.

    Attributes:
        key: Name of the package, and the value of `Model.step` that shows the screen. For "probe",
            the classes are `screen.ProbePresenter` and `screen_view.ProbeScreen`.
        title, tip, command, icon: Label on the rail, tooltip, entry in "Find anything" and icon. A
            screen without a title does not appear on the rail.
        in_front: Function that returns whether the screen should be visible, or None if
            `Model.step` alone decides.
        done: Function that returns whether the rail marks the screen as done.
        note: Function that returns the decision made on the screen in two forms: a short text for
            the rail, and the full text.
    """

    key: str
    title: str = ""
    tip: str = ""
    command: str = ""
    icon: str = ""
    in_front: Callable[[Model], bool] | None = None
    done: Callable[[Model], bool] = lambda model: False
    note: Callable[[Model], tuple[str, str]] = lambda model: ("", "")

    def belongs_in_front(self, model: Model) -> bool:
        """Return whether this screen should be visible now."""
        return model.step == self.key if self.in_front is None else self.in_front(model)

    def make_presenter(
        self, services: Services, place_controller: PlaceController
    ) -> ScreenPresenter:
        """Create the presenter, which lives as long as the window."""
        presenter: ScreenPresenter = self._part("screen", "Presenter")(services, place_controller)
        return presenter

    def make_view(self, presenter: ScreenPresenter, compact: bool) -> Any:
        """Create the view, a `QWidget`. It is rebuilt whenever the theme or the layout changes."""
        return self._part("screen_view", "Screen")(presenter, compact)

    def read_in(self) -> None:
        """Import the screen's code before it is shown."""
        self._part("screen", "Presenter")
        self._part("screen_view", "Screen")

    def _part(self, module: str, kind: str) -> Any:
        imported = import_module(f"app.ui.screens.{self.key}.{module}")
        return getattr(imported, f"{self.key.title()}{kind}")


def _style(model: Model) -> tuple[str, str]:
    title = model.result.title if model.goal_deg is not None and model.result is not None else ""
    return title, title


def _number_shown(model: Model) -> bool:
    """Return whether the rail shows the goal, which is hidden on the Turn screen."""
    return model.step != Step.TURN and not model.goal_computing


def _goal(model: Model) -> tuple[str, str]:
    goal = model.goal_deg if _number_shown(model) else None
    return ("", "") if goal is None else (size_words(goal), turn_words(goal))


def _lamp(model: Model) -> tuple[str, str]:
    plan = model.lamp_plan
    return ("", "") if plan is None else (plan.lamp, plan.hold)


SCREENS: Final = (
    ScreenSpec(
        Step.PROBE,
        title=tr("Probe"),
        tip=tr("Measure the light"),
        command=tr("Probe: measure the light"),
        icon="probe",
        done=lambda model: model.light is not None,
    ),
    # listed before the gallery, which it covers
    ScreenSpec(
        "paint",
        in_front=lambda model: model.step == Step.STYLES and model.painting is not None,
    ),
    ScreenSpec(
        Step.STYLES,
        title=tr("Styles"),
        tip=tr("Choose a style"),
        command=tr("Styles: choose a style"),
        icon="styles",
        done=lambda model: model.goal_deg is not None,
        note=_style,
    ),
    ScreenSpec(
        Step.TURN,
        title=tr("Turn"),
        tip=tr("Turn to the style"),
        command=tr("Turn: turn to the style"),
        icon="turn",
        done=lambda model: model.aim is not None and model.reached == model.aim,
        note=_goal,
    ),
    ScreenSpec(
        Step.LIGHT,
        title=tr("Light"),
        tip=tr("Place a second light"),
        command=tr("Light: place a second light"),
        icon="light",
        done=lambda model: model.lamp_plan is not None,
        note=_lamp,
    ),
)


def screen(key: str) -> ScreenSpec:
    """Return the screen with the given key."""
    return next(spec for spec in SCREENS if spec.key == key)


def screen_of(model: Model) -> ScreenSpec:
    """Return the screen that should be visible now."""
    return next(spec for spec in SCREENS if spec.belongs_in_front(model))


def steps() -> tuple[ScreenSpec, ...]:
    """Return the screens on the rail, from top to bottom."""
    return tuple(spec for spec in SCREENS if spec.title)
