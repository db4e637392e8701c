"""The tools: the brush, the starting point and undo."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

from app.core.painting.stroke import Brush, Tool
from app.core.painting.user_style import UserStyle
from app.core.text import tr
from app.ui.presenters.actions import Action
from app.ui.screens.paint.document import PaintDocument
from app.words.styles import side_words

SMALLEST: Final = 4.0
LARGEST: Final = 160.0
"""Smallest and largest diameters of the brush, in canvas pixels."""

_LIMITS: Final = {"diameter": (SMALLEST, LARGEST), "strength": (0.0, 1.0), "softness": (0.0, 1.0)}
TOOLS: Final = {
    Tool.BRIGHTER: tr("brighter"),
    Tool.DARKER: tr("darker"),
    Tool.IGNORE: tr("ignore"),
    Tool.RESTORE: tr("restore"),
}
NOTHING: Final = ("", tr("Nothing"), tr("an empty face"))
_GROW: Final = 1.15
_EVEN: Final = 2.0


@dataclass(frozen=True, slots=True)
class ToolsState:
    """The state of the tool column.

    Attributes:
        starts: Key, title and side of each style from which painting can start.
        start: Key of the current starting point.
        undo, redo: Name of the step to undo or redo, or an empty string if there is none.
        notice: The reason why there are no starting points.
    """

    brush: Brush = field(default_factory=Brush)
    starts: tuple[tuple[str, str, str], ...] = field(default=(), repr=False)
    start: str = ""
    undo: str = ""
    redo: str = ""
    can_clear: bool = False
    notice: str = ""


def starts_of(
    document: PaintDocument, own: Sequence[UserStyle]
) -> tuple[tuple[str, str, str], ...]:
    """Return the key, title and side of each starting point.

    The starting points are nothing, the user's own styles and the built-in styles.

    A style that was saved from this painting is omitted, unless the painting started from it.
    """
    mine = tuple((one.name, one.title, side_words(one) or tr("painted by you")) for one in own)
    names = {one.name for one in own}
    rest = (one for one in document.head.pack.styles if one.name not in names)
    starts = (NOTHING, *mine, *((one.name, one.title, side_words(one)) for one in rest))
    return tuple(one for one in starts if one[0] != document.key or document.key == document.start)


class BrushBox:
    """Holds the brush and changes it."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self.brush = Brush(pen_pressure=True)

    def change(self, **changes: Any) -> None:
        """Change fields of the `Brush`, keeping all numbers within their limits."""
        for name, (least, most) in _LIMITS.items():
            if name in changes:
                changes[name] = min(max(float(changes[name]), least), most)
        brush = replace(self.brush, **changes)
        if brush != self.brush:
            self.brush = brush
            self._changed()

    def resize(self, steps: int) -> None:
        """Change the size of the brush in steps of 15%, or of 2 pixels if that is more."""
        now = self.brush.diameter
        size = round(now * _GROW**steps / _EVEN) * _EVEN
        self.change(diameter=now + _EVEN * steps if size == now else size)

    def flip(self, name: str) -> None:
        """Toggle the field ``mirror`` or ``pen_pressure``."""
        self.change(**{name: not getattr(self.brush, name)})

    def _action(self, tool: Tool, key: str) -> Action:
        words = tr("Brush: {tool}", tool=TOOLS[tool])
        return Action(f"tool-{tool}", words, partial(self.change, tool=tool), tool.value, key)

    def actions(self) -> Sequence[Action]:
        """Return the brush's keyboard actions. The first two have hints."""
        return (
            replace(self._action(Tool.BRIGHTER, "B"), hint=tr("tools"), keys="B D I R"),
            Action("brush-larger", tr("Larger brush"), lambda: self.resize(1), "plus", "]",
                   hint=tr("size"), keys="[ ]"),
            self._action(Tool.DARKER, "D"),
            self._action(Tool.IGNORE, "I"),
            self._action(Tool.RESTORE, "R"),
            Action("brush-smaller", tr("Smaller brush"), lambda: self.resize(-1), "minus", "["),
            Action("brush-mirror", tr("Mirror on or off"),
                   lambda: self.flip("mirror"), "mirror", "M"),
            Action("brush-pressure", tr("Pen pressure on or off"),
                   lambda: self.flip("pen_pressure"), "pen", "P"),
        )  # fmt: skip
