"""All screens, in the order of the rail. Each is imported when it is first shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.ui.presenters.model import Step
from app.ui.presenters.screen import ScreenSpec

if TYPE_CHECKING:
    from app.ui.presenters.model import Model

SCREENS: Final = (
    ScreenSpec(
        Step.PROBE,
        "ProbePresenter",
        "ProbeScreen",
        title="Probe",
        tip="Measure the light",
        command="Probe: measure the light",
        icon="probe",
        done=lambda model: model.light is not None,
    ),
    # Before the gallery, which it covers.
    ScreenSpec(
        "paint",
        "PaintPresenter",
        "PaintScreen",
        in_front=lambda model: model.step == Step.STYLES and model.painting is not None,
    ),
    ScreenSpec(
        Step.STYLES,
        "StylesPresenter",
        "StylesScreen",
        title="Styles",
        tip="Choose a style",
        command="Styles: choose one",
        icon="styles",
        done=lambda model: model.goal_deg is not None,
    ),
    ScreenSpec(
        Step.TURN,
        "TurnPresenter",
        "TurnScreen",
        title="Turn",
        tip="Turn to it",
        command="Turn to it",
        icon="turn",
    ),
    ScreenSpec(
        Step.LIGHT,
        "LightPresenter",
        "LightScreen",
        title="Light",
        tip="Place a second light",
        command="Light: place a second one",
        icon="light",
        done=lambda model: model.lamp_plan is not None,
    ),
)


def screen(key: str) -> ScreenSpec:
    """Find a screen by its key."""
    return next(spec for spec in SCREENS if spec.key == key)


def screen_of(model: Model) -> ScreenSpec:
    """Say which screen belongs in front."""
    return next(spec for spec in SCREENS if spec.belongs_in_front(model))


def steps() -> tuple[ScreenSpec, ...]:
    """Give the screens on the rail, from top to bottom."""
    return tuple(spec for spec in SCREENS if spec.title)
