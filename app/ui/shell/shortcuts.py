"""Keyboard shortcuts of actions, as long as the actions are on offer."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from app.ui.presenters.actions import Action

_ON_BUTTONS = frozenset({"Return", "Enter", "Space"})


class Shortcuts:
    """Binds the shortcuts of a group of actions to a window."""

    def __init__(self, window: QWidget) -> None:
        self._window = window
        self._resting = False
        self._bound: list[QShortcut] = []

    def bind(self, actions: Sequence[Action]) -> None:
        """Take the place of the group's former shortcuts."""
        for old in self._bound:
            old.setEnabled(False)
            old.setParent(None)
        self._bound = [
            self._made(action, keys.strip())
            for action in actions
            for keys in action.shortcut.split(";")
            if keys.strip()
        ]

    def rest(self, resting: bool) -> None:
        """Let the keys go to others, as while something lies over the screen."""
        if resting != self._resting:
            self._resting = resting
            for shortcut in self._bound:
                shortcut.setEnabled(not resting)

    def _made(self, action: Action, keys: str) -> QShortcut:
        shortcut = QShortcut(QKeySequence(keys), self._window)
        shortcut.setContext(Qt.ShortcutContext.WindowShortcut)

        def run() -> None:
            focus = QApplication.focusWidget()
            # These keys press the button that has the focus.
            if keys in _ON_BUTTONS and isinstance(focus, QAbstractButton):
                focus.click()
            elif action.enabled():
                action.run()

        shortcut.activated.connect(run)
        shortcut.setEnabled(not self._resting)
        return shortcut


def hints_of(actions: Sequence[Action]) -> list[tuple[str, str]]:
    """Say which shortcuts the line at the foot shows.

    Returns list of (str, str). Keys and words.
    """
    return [
        (action.keys or written(action.shortcut), action.hint) for action in actions if action.hint
    ]


def written(shortcut: str) -> str:
    """Write the first of an action's shortcuts as keys are named on screen: "Ctrl K"."""
    first = shortcut.split(";")[0].strip()
    names = {"Return": "Enter", "Escape": "Esc"}
    return " ".join(names.get(part, part) for part in first.split("+"))
