"""The undo stack: a single list of steps for the whole window, limited to a number of bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.core.text import tr
from app.ui.presenters.window_model import Event

_MOST_BYTES: Final = 64 << 20


@dataclass(frozen=True, slots=True, eq=False)
class Undoable:
    """A step that can be undone.

    Attributes:
        words: Description that follows "Undo", such as "delete My Rembrandt" or "stroke on My
            Rembrandt".
        place: Folder of the place that must be open for this step, or None if the step does not
            depend on a place.
        result: Returns the item that the step moved to the trash. The item identifies the step.
    """

    words: str
    undo: Callable[[], None]
    redo: Callable[[], None]
    size: int = 64
    place: Path | None = None
    result: Callable[[], object] = lambda: None


class UndoStack:
    """The steps taken anywhere in the window, in order.

    Attributes:
        give_up: Aborts a step in progress, such as a stroke while the pen is down, and returns
            whether there was such a step. Undo calls this first.
    """

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self.changed = Event()
        self.reported = Event()
        self.give_up: Callable[[], bool] = lambda: False
        self._past: list[Undoable] = []
        self._undone: list[Undoable] = []
        self._most_bytes = most_bytes

    @property
    def undo_words(self) -> str:
        """Description of the step that `undo` would undo, or an empty string if there is none."""
        return self._past[-1].words if self._past else ""

    @property
    def redo_words(self) -> str:
        """Description of the step that `redo` would redo, or an empty string if there is none."""
        return self._undone[-1].words if self._undone else ""

    def push(self, step: Undoable) -> None:
        """Add a step, and discard the steps that have been undone."""
        self._past.append(step)
        self._undone.clear()
        while len(self._past) > 1 and sum(one.size for one in self._past) > self._most_bytes:
            del self._past[0]
        self.changed.emit()

    def undo(self) -> None:
        """Undo the last step, if there is one."""
        if not self.give_up() and self._past:
            self.take_back(self._past[-1])

    def redo(self) -> None:
        """Redo the last undone step, if there is one."""
        self.give_up()
        if self._undone:
            step = self._undone.pop()
            self._past.append(step)
            step.redo()
            self._tell(step, self._past, tr("Redone: {step}.", step=step.words))

    def take_back(self, step: Undoable) -> None:
        """Undo a particular step, as its message offers, unless the step is already undone."""
        if step in self._past:
            self._past.remove(step)
            self._undone.append(step)
            step.undo()
            self._tell(step, self._undone, tr("Undone: {step}.", step=step.words))

    def take_back_what(self, result: object) -> bool:
        """Undo the step that deleted an item, and return whether that step was found."""
        step = next((one for one in self._past if one.result() == result), None)
        if step is not None:
            self.take_back(step)
        return step is not None

    def failed(self, step: Undoable, *, undoing: bool) -> None:
        """Put a slow step back in its previous list after its undo or redo has failed."""
        source, target = (self._undone, self._past) if undoing else (self._past, self._undone)
        if step in source:
            source.remove(step)
            target.append(step)
            self.changed.emit()

    def drop(self, step: Undoable) -> None:
        """Remove a step that has failed."""
        for steps in (self._past, self._undone):
            if step in steps:
                steps.remove(step)
        self.changed.emit()

    def forget_places(self) -> None:
        """Remove all steps that need the open place, for example when the place is closed."""
        for steps in (self._past, self._undone):
            steps[:] = [one for one in steps if one.place is None]
        self.changed.emit()

    def _tell(self, step: Undoable, where: list[Undoable], words: str) -> None:
        self.changed.emit()
        # A step that failed is back in its old list and was already reported.
        if step in where:
            self.reported.emit(words)
