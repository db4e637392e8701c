"""A window's services with a synthetic head in known light, ready for painting."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np

from app.core.environment.environment import Environment
from app.core.portrait.head import Head
from app.core.solver.place_light import PlaceLight, prepare
from app.devices.clock import VirtualClock
from app.ui.presenters.place_controller import PlaceController
from app.ui.presenters.services import Folders, Services
from app.ui.presenters.undo_stack import UndoStack
from app.ui.presenters.window_model import Model, Step
from app.ui.screens.paint.screen import PaintPresenter
from tests.helpers.immediate_runner import ImmediateRunner
from tests.helpers.synthetic import lambert_sphere_transport, lamp_environment, synthetic_pack
from tests.helpers.told import Told

__all__ = ["Studio", "Told", "lamp_light", "studio"]


@dataclass
class Studio:
    """Everything that the Paint screen works with."""

    services: Services
    model: Model
    told: Told
    presenter: PaintPresenter
    drafts: Path
    styles: Path

    def enter(self, key: str = "") -> None:
        """Bring the Paint screen to the front, as the window does."""
        self.model.update(step=Step.STYLES, painting=key)
        self.presenter.enter()

    def leave(self) -> None:
        """Go back to the gallery, as the window does."""
        self.model.update(painting=None)
        self.presenter.leave()

    def stroke(self, *points: tuple[float, float]) -> None:
        """Paint a stroke through points in shares of the canvas."""
        canvas = self.presenter.canvas
        assert canvas is not None
        first, *rest = [(x * canvas.size, y * canvas.size, 1.0) for x, y in points]
        self.presenter.press(first)
        self.presenter.draw(rest)
        self.presenter.lift()


@cache
def _head() -> Head:
    return Head("synthetic", synthetic_pack(), lambert_sphere_transport())


@cache
def lamp_light(azimuth_deg: float) -> PlaceLight:
    """One small white lamp at eye level at a panorama azimuth."""
    radiance = lamp_environment(azimuth_deg, 0.0, 12.0, (128, 256), 0.02)
    white = np.repeat(radiance[..., None], 3, axis=2).astype(np.float32)
    return prepare(Environment(white, "lamp"))


def even_light() -> PlaceLight:
    """Light from everywhere alike, which shows no style."""
    return prepare(Environment(np.ones((128, 256, 3), np.float32), "even"))


def studio(home: Path, lamp_deg: float | None = 0.0, runner: Any = None) -> Studio:
    """Set up a presenter on a synthetic head.

    Args:
        home: Folder for drafts and styles.
        lamp_deg: Where the only lamp is; None: no light was measured.
        runner: Does everything at once by default.
    """
    model, told = Model(), Told()
    services = Services(
        model=model,
        runner=ImmediateRunner() if runner is None else runner,
        notify=told,
        undo=UndoStack(),
        clock=VirtualClock(),
        today=lambda: datetime(2026, 11, 21, 14, 5, tzinfo=UTC),
        devices=MagicMock(),
        folders=Folders(home, home / "places", home / "styles", home / "drafts", home / "demo"),
    )
    place_controller = PlaceController(services)
    model.update(head=_head(), light=None if lamp_deg is None else lamp_light(lamp_deg))
    return Studio(
        services,
        model,
        told,
        PaintPresenter(services, place_controller),
        home / "drafts",
        home / "styles",
    )
