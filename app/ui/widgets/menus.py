"""Menus in our look."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QMenu, QWidget

from app.ui.theme import theme
from app.ui.theme.icons import icon
from app.ui.theme.style import menu_sheet

if TYPE_CHECKING:
    from collections.abc import Callable

    from PySide6.QtGui import QAction


class Menu(QMenu):
    """A menu with round corners; entries have an icon and say why they are disabled."""

    def __init__(self, parent: QWidget, name: str = "Menu") -> None:
        super().__init__(parent)
        self.setWindowFlag(Qt.WindowType.FramelessWindowHint)
        self.setWindowFlag(Qt.WindowType.NoDropShadowWindowHint)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        self.setToolTipsVisible(True)
        self.setStyleSheet(menu_sheet(theme()))
        self.setFont(theme().font(14))
        self.setAccessibleName(name)

    def add(
        self,
        text: str,
        do: Callable[[], None],
        icon_name: str = "",
        shortcut: str = "",
        why: str = "",
    ) -> QAction:
        """Add an entry."""
        # In a title these are letters, not the sign of a key and of a column.
        plain = text.replace("&", "&&").replace("\t", " ")
        action = self.addAction(f"{plain}\t{shortcut}" if shortcut else plain)
        if icon_name:
            action.setIcon(icon(icon_name))
        action.setEnabled(not why)
        action.setToolTip(why)
        action.triggered.connect(lambda _on=False: do())
        return action

    def drop(self, under: QWidget) -> None:
        """Open it under a widget without waiting for an answer."""
        self.popup(under.mapToGlobal(QPoint(0, under.height() + theme().px(4))))
