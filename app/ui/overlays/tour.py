"""The tour: five steps from an empty window to the light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.labels import Icon, Text

if TYPE_CHECKING:
    from app.ui.shell.commands import Commands

STEPS: Final = (
    (
        "probe",
        "Measure the light",
        "Put the 360 camera where the sitter’s head will be, its front lens toward you. Press "
        "Capture and kneel under it. No camera? Drop any HDR panorama on the window.",
    ),
    (
        "styles",
        "Choose a style",
        "Every card shows the studio picture beside what this place can give, and how far to turn "
        "for it. Grey ones are out of reach here, and say why.",
    ),
    (
        "turn",
        "Turn to it",
        "Press “Turn to this” and walk around the sitter, who turns with you. The arrow and the "
        "number can be read from three metres; green means you are in the light.",
    ),
    (
        "brush",
        "Want it otherwise?",
        "Paint where the face should be brighter or darker. The best turn follows the brush.",
    ),
    (
        "camera",
        "Take the picture",
        "With any camera you like. Turnlight keeps the place with all its answers: you find it "
        "under Places.",
    ),
)
"""Icon, title and words of every step."""


class TourBody(QWidget):
    """One step at a time."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
        t = theme()
        self._pages = QStackedWidget()
        for number, (icon, title, words) in enumerate(STEPS, start=1):
            self._pages.addWidget(_page(number, icon, title, words))
        self._count = Text("", 12, role="dim")
        self._back = Button("Back")
        self._demo = Button("Demo place", "pin")
        self._next = Button("Next", kind="primary")
        row = QHBoxLayout()
        row.setSpacing(t.px(8))
        row.addWidget(self._count)
        row.addStretch(1)
        for button in (self._back, self._demo, self._next):
            row.addWidget(button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(t.px(24))
        column.addWidget(self._pages, 1)
        column.addLayout(row)
        self._back.clicked.connect(lambda: self._go(-1))
        self._next.clicked.connect(lambda: self._go(1))
        self._demo.clicked.connect(self._open_demo)
        self.setFocusProxy(self._next)
        self._go(0)

    def _go(self, by: int) -> None:
        page = self._pages.currentIndex() + by
        if page >= len(STEPS):
            self._commands.close_overlay()
            return
        self._pages.setCurrentIndex(page)
        last = page == len(STEPS) - 1
        self._count.set_text(f"{page + 1} of {len(STEPS)}")
        self._back.setEnabled(page > 0)
        self._demo.setVisible(last)
        self._next.set_text("Begin" if last else "Next")

    def _open_demo(self) -> None:
        self._commands.close_overlay()
        self._commands.desk.open_demo()


def _page(number: int, icon: str, title: str, words: str) -> QWidget:
    t = theme()
    page = QWidget()
    page.setAccessibleName(f"Step {number}: {title}")
    column = QVBoxLayout(page)
    column.setContentsMargins(0, t.px(16), 0, t.px(16))
    column.setSpacing(t.px(16))
    column.addWidget(Icon(icon, 40, "amber"), 0, Qt.AlignmentFlag.AlignLeft)
    column.addWidget(Text(title, 20, 600))
    column.addWidget(Text(words, 16, role="dim", wrap=True))
    column.addStretch(1)
    page.setMinimumHeight(t.px(200))
    return page
