"""The messages since the start, the newest first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.icons import Icon
from app.ui.widgets.labels import Role, Text
from app.ui.widgets.surfaces import Scroll

if TYPE_CHECKING:
    from app.ui.commands import Commands

__all__ = ["MessagesBody"]

_ICONS: Final[dict[str, tuple[str, Role]]] = {
    "info": ("info", "dim"),
    "done": ("check", "ok"),
    "warning": ("warning", "text"),
    "error": ("error", "err"),
}


class MessagesBody(QWidget):
    """What was told.

    Parameters
    ----------
    commands : Commands
        Knows the messages.
    """

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        t = theme()
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, t.px(16), 0)
        column.setSpacing(t.px(16))
        messages = commands.messages()
        if not messages:
            column.addWidget(Text("Nothing was told yet.", 14, role="dim"))
        for message in reversed(messages):
            row = QHBoxLayout()
            row.setSpacing(t.px(12))
            name, role = _ICONS[message.kind]
            row.addWidget(Icon(name, 20, role, says=message.kind))
            row.addWidget(Text(f"{message.moment:%H:%M}", 12, role="dim"))
            row.addWidget(Text(message.text, 14, wrap=True), 1)
            column.addLayout(row)
        column.addStretch(1)
        area = Scroll()
        area.setWidget(inside)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(area)
