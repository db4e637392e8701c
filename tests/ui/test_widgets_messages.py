"""Messages and who has the keyboard."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QWidget

from app.ui.widgets.buttons import Button
from app.ui.widgets.messages import Toasts

if TYPE_CHECKING:
    from pytestqt.qtbot import QtBot


def test_a_focus_that_falls_on_a_message_does_not_hold_it(qtbot: QtBot) -> None:
    """Whoever had the focus goes away: it falls on the next button, which nobody chose."""
    window = QWidget()
    window.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
    window.resize(800, 600)
    qtbot.addWidget(window)
    leaving = Button("Capture")
    leaving.setParent(window)
    with qtbot.waitActive(window):
        window.show()
    leaving.show()
    leaving.setFocus()
    toasts = Toasts(window, stay_ms=50)
    toasts.tell("New here?", actions=[("Tour", lambda: None)])
    leaving.hide()
    assert QApplication.focusWidget() is window
    qtbot.waitUntil(lambda: toasts.count == 0)
