"""Keyboard shortcuts that work whenever their actions are available."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget

from app.ui.presenters.actions import Action

_ON_BUTTONS = frozenset({"Return", "Enter", "Space"})


class Shortcuts:
    """Binds the shortcuts for a group of actions to a window."""

    def __init__(self, window: QWidget) -> None:
        self._window = window
        self._resting = False
        self._actions: dict[str, Action] = {}
        self._shortcuts: dict[str, QShortcut] = {}

    def bind(self, actions: Sequence[Action]) -> None:
        """Replace the shortcuts of the group."""
        self._actions = {
            keys.strip(): action
            for action in actions
            for keys in action.shortcut.split(";")
            if keys.strip()
        }
        # Reuse existing shortcuts, because creating one takes a millisecond.
        for keys in self._actions.keys() - self._shortcuts.keys():
            self._shortcuts[keys] = QShortcut(QKeySequence(keys), self._window)
            self._shortcuts[keys].activated.connect(partial(self._run, keys))
        self._enable()

    def rest(self, resting: bool) -> None:
        """Disable or enable the shortcuts, for example while an overlay is open."""
        if resting != self._resting:
            self._resting = resting
            self._enable()

    def _enable(self) -> None:
        for keys, shortcut in self._shortcuts.items():
            shortcut.setEnabled(keys in self._actions and not self._resting)

    def _run(self, keys: str) -> None:
        focus, action = QApplication.focusWidget(), self._actions[keys]
        # These keys press the focused button.
        if keys in _ON_BUTTONS and isinstance(focus, QAbstractButton):
            focus.click()
        elif action.enabled():
            action.run()


def hints_of(actions: Sequence[Action]) -> list[tuple[str, str]]:
    """Return the shortcuts for the line at the foot, as pairs of keys and text."""
    return [
        (action.keys or key_text(action.shortcut), action.hint) for action in actions if action.hint
    ]


def key_text(shortcut: str) -> str:
    """Return the first of an action's shortcuts as text, such as "Ctrl+K"."""
    first = shortcut.split(";")[0].strip()
    names = {"Return": "Enter", "Escape": "Esc"}
    return "+".join(names.get(part, part) for part in first.split("+"))
