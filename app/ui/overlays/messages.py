"""The messages since the start, the newest first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.labels import Icon, Role, Text
from app.ui.widgets.surfaces import Scroll

if TYPE_CHECKING:
    from collections.abc import Callable

    from app.ui.shell.commands import Commands
    from app.ui.shell.notify import Message

_ICONS: Final[dict[str, tuple[str, Role]]] = {
    "info": ("info", "dim"),
    "done": ("check", "ok"),
    "warning": ("warning", "text"),
    "error": ("error", "err"),
}


class MessagesBody(QWidget):
    """What was told."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        self._commands = commands
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
            top = Qt.AlignmentFlag.AlignTop
            row.addWidget(Icon(name, 20, role, says=message.kind), 0, top)
            row.addWidget(Text(f"{message.moment:%H:%M}", 12, role="dim"), 0, top)
            said = QVBoxLayout()
            said.setSpacing(t.px(8))
            said.addWidget(Text(message.text, 14, wrap=True))
            said.addLayout(self._buttons(message))
            row.addLayout(said, 1)
            column.addLayout(row)
        column.addStretch(1)
        area = Scroll()
        area.setWidget(inside)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(area)

    def _buttons(self, message: Message) -> QHBoxLayout:
        """Offer again what could be done about it."""
        line = QHBoxLayout()
        line.setSpacing(theme().px(8))
        for words, do in message.actions:
            button = Button(words, size="small")
            button.setAccessibleName(f"{words}: {message.text}")
            button.clicked.connect(lambda _on=False, do=do: self._act(do))
            line.addWidget(button)
        line.addStretch(1)
        return line

    def _act(self, do: Callable[[], None]) -> None:
        self._commands.close_overlay()
        QTimer.singleShot(0, do)
