"""Help: all shortcuts, and the words that Turnlight uses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QVBoxLayout, QWidget

from app.ui.shell.shortcuts import written
from app.ui.theme import theme
from app.ui.widgets.labels import KeyHint, Text
from app.ui.widgets.surfaces import Scroll

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.ui.presenters.actions import Action
    from app.ui.shell.commands import Commands

_WORDS: Final = (
    (
        "Turn",
        "How far the sitter, and you with them, rotate. Clockwise is as seen from above: "
        "you walk to your left around the sitter.",
    ),
    (
        "Sitter’s left",
        "The side of the sitter’s own left hand: on the right in the picture. A style is named "
        "after the side of its main light.",
    ),
    (
        "Match",
        "How much the face at that turn looks like the style’s studio picture. 100 is the studio "
        "picture itself; below the limit the style is out of reach.",
    ),
    (
        "Strength",
        "How deep the play of light and shadow is; 100 is as deep as in the studio.",
    ),
    ("Good from … to", "Within these turns hardly anything is lost: choose the nicer background."),
)


def key_lines(actions: Sequence[Action]) -> list[tuple[str, str]]:
    """List keys with what each does: one line for each key, with its own words."""
    lines: dict[str, str] = {}
    for one in actions:
        keys = written(one.shortcut) if one.shortcut else one.keys
        if keys:
            lines.setdefault(keys, one.words)
    return list(lines.items())


class HelpBody(QWidget):
    """Shortcuts of this screen and of all, and words."""

    def __init__(self, commands: Commands) -> None:
        super().__init__()
        t = theme()
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, t.px(16), 0)
        column.setSpacing(t.px(16))
        column.addWidget(Text("Keys", 16, 600))
        grid = QGridLayout()
        grid.setHorizontalSpacing(t.px(32))
        grid.setVerticalSpacing(t.px(8))
        grid.setColumnStretch(0, 1)
        grid.setColumnStretch(1, 1)
        bound = key_lines(commands.all_actions())
        rows = -(-len(bound) // 2)
        hints: list[KeyHint] = []
        for number, (keys, words) in enumerate(bound):
            hint = KeyHint(keys, words)
            hints.append(hint)
            grid.addWidget(hint, number % rows, number // rows, Qt.AlignmentFlag.AlignLeft)
        for side in (hints[:rows], hints[rows:]):
            for hint in side:
                hint.align(max(one.cap() for one in side))
        column.addLayout(grid)
        column.addWidget(Text("Words", 16, 600))
        for word, meaning in _WORDS:
            pair = QVBoxLayout()
            pair.setSpacing(t.px(2))
            pair.addWidget(Text(word, 14, 600))
            pair.addWidget(Text(meaning, 14, role="dim", wrap=True))
            column.addLayout(pair)
        column.addStretch(1)
        area = Scroll(inside, height=440)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(area)
