"""Qt without a screen; each test starts with the dark theme, and Qt must not complain."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QPoint
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from app.ui.theme import apply, set_theme

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let every warning that Qt prints during a test of this folder fail it."""
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.qt_log_level_fail("WARNING"))
            # What the offscreen platform says of itself.
            item.add_marker(pytest.mark.qt_log_ignore("This plugin does not support", extend=True))


@pytest.fixture(autouse=True)
def plain_theme(request: pytest.FixtureRequest) -> Iterator[None]:
    """Set the dark theme at scale 1 before every test, and again after it."""
    set_theme("dark")
    if "qtbot" in request.fixturenames or "qapp" in request.fixturenames:
        apply(request.getfixturevalue("qapp"))
    yield
    set_theme("dark")
    # Widgets that were closed go only now: no event loop runs here that would let them.
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def picture_of() -> Callable[[QWidget, float], QImage]:
    """Paint a widget at so many device pixels for each logical one."""

    def paint(widget: QWidget, dpr: float) -> QImage:
        image = QImage(widget.size() * dpr, QImage.Format.Format_ARGB32_Premultiplied)
        image.setDevicePixelRatio(dpr)
        widget.render(image, QPoint(0, 0))
        return image

    return paint
