"""What can be done on the Paint screen, for menus, shortcuts, hints and "find anything"."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.core.painting.stroke import Tool
from app.ui.presenters.actions import Action
from app.ui.screens.paint.state import Shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.ui.presenters.undo import UndoStack
    from app.ui.screens.paint.presenter import PaintPresenter


def paint_actions(presenter: PaintPresenter, undo: UndoStack) -> Sequence[Action]:
    """List them; those with hints come first."""
    p, files = presenter, presenter.files

    def take(tool: Tool) -> None:
        p.tools.choose_tool(tool)

    return (
        Action("tool-brighter", "Brush: brighter", lambda: take(Tool.BRIGHTER), "brighter", "B",
               hint="tools", keys="B D I R"),
        Action("brush-larger", "Larger brush", lambda: p.tools.resize(1), "plus", "]",
               hint="size", keys="[ ]"),
        Action("undo-here", "Undo", undo.undo, "undo", "",
               lambda: bool(undo.undo_words), "undo", "Ctrl Z", undo.undo_words),
        Action("paint-back", "Back to styles", p.back, "styles", "Escape", hint="back to styles"),
        Action("tool-darker", "Brush: darker", lambda: take(Tool.DARKER), "darker", "D"),
        Action("tool-ignore", "Brush: ignore", lambda: take(Tool.IGNORE), "ignore", "I"),
        Action("tool-restore", "Brush: restore", lambda: take(Tool.RESTORE), "restore", "R"),
        Action("brush-smaller", "Smaller brush", lambda: p.tools.resize(-1), "minus", "["),
        Action("brush-mirror", "Mirror on or off", p.tools.flip_mirror, "mirror", "M"),
        Action("brush-pressure", "Pen pressure on or off",
               p.tools.flip_pen_pressure, "pen", "P"),
        Action("show-weights", "Show the weights", lambda: p.show(Shown.WEIGHTS), "layers", "W"),
        Action("show-target", "Show the target", lambda: p.show(Shown.TARGET), "target", "T"),
        Action("show-here", "Show the picture here", lambda: p.show(Shown.HERE), "person", "H"),
        Action("clear-strokes", "Clear strokes", p.clear, "trash"),
        Action("save-style", "Save as my style", files.ask_save, "save", "Ctrl+S; Return; Enter",
               lambda: p.save_works),
        *files.actions(),
    )  # fmt: skip
