"""Taking things back: one list for the whole window, bounded by bytes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from app.ui.presenters.observe import Event

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["UndoStack", "Undoable"]

_MOST_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True)
class Undoable:
    """Something that was done and can be taken back.

    Attributes
    ----------
    words : str
        What it was, to be read after "Undo": "stroke", "move of the marker".
    undo, redo : callable
        Take it back; do it again.
    size : int
        Bytes that it keeps.
    """

    words: str
    undo: Callable[[], None]
    redo: Callable[[], None]
    size: int = 64


class UndoStack:
    """What was done, in order.

    Parameters
    ----------
    most_bytes : int, optional
        Beyond it the oldest are forgotten.

    Attributes
    ----------
    changed : Event
        Something can be undone or redone that could not be before, or the reverse.
    """

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self.changed = Event()
        self._done: list[Undoable] = []
        self._undone: list[Undoable] = []
        self._most_bytes = most_bytes

    @property
    def undo_words(self) -> str:
        """What `undo` would take back; empty when there is nothing."""
        return self._done[-1].words if self._done else ""

    @property
    def redo_words(self) -> str:
        """What `redo` would do again; empty when there is nothing."""
        return self._undone[-1].words if self._undone else ""

    def push(self, step: Undoable) -> None:
        """Note something that has been done; what was undone before is forgotten.

        Parameters
        ----------
        step : Undoable
            Already done.
        """
        self._done.append(step)
        self._undone.clear()
        while len(self._done) > 1 and sum(one.size for one in self._done) > self._most_bytes:
            del self._done[0]
        self.changed.emit()

    def undo(self) -> None:
        """Take the last step back; without one nothing happens."""
        if self._done:
            step = self._done.pop()
            step.undo()
            self._undone.append(step)
            self.changed.emit()

    def redo(self) -> None:
        """Do the last undone step again; without one nothing happens."""
        if self._undone:
            step = self._undone.pop()
            step.redo()
            self._done.append(step)
            self.changed.emit()

    def clear(self) -> None:
        """Forget everything, as when another place is opened."""
        self._done.clear()
        self._undone.clear()
        self.changed.emit()
