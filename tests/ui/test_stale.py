"""The window dims an answer that is not of what is selected, and says that it is being computed."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.ui.presenters.window_model import COMPUTING
from app.ui.screens.styles.screen_view import StylesScreen
from app.ui.theme import set_theme
from app.ui.widgets.messages import StaleVeil
from tests.helpers.styles_screen import Table, scene_light


def _spread(widget: QWidget) -> float:
    """How far apart the tones of a widget are."""
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_Grayscale8)
    return float(np.std(np.frombuffer(image.constBits(), np.uint8)))


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_detail_and_cards_are_dimmed_while_computing(
    qtbot: QtBot, tmp_path: Path, theme: Literal["dark", "light"]
) -> None:
    set_theme(theme)
    table = Table(tmp_path).open(scene_light("studio"))
    view = StylesScreen(table.presenter, compact=False)
    qtbot.addWidget(view)
    view.resize(1352, 804)
    table.presenter.attach(view)
    view.show()
    QApplication.processEvents()
    veil, before = view.detail.veil, _spread(view.detail)
    assert not veil.isVisible()
    table.runner.held.add("solve")
    table.model.update(front_deg=50.0)
    QApplication.processEvents()
    assert veil.isVisible()
    assert veil.accessibleName() == COMPUTING
    assert veil.width() > 0.8 * view.detail.width()
    assert _spread(view.detail) < 0.8 * before
    table.runner.release("solve")
    QApplication.processEvents()
    assert not veil.isVisible()
    set_theme("dark")


def test_veil_grows_with_what_it_covers(qtbot: QtBot) -> None:
    part = QWidget()
    qtbot.addWidget(part)
    veil = StaleVeil(part, COMPUTING)
    part.resize(200, 100)
    part.show()
    veil.cover(True)
    part.resize(300, 150)
    assert (veil.width(), veil.height()) == (300, 150)
    veil.cover(False)
    assert not veil.isVisible()
