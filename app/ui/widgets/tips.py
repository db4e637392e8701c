"""What a control says of itself: its accessible name, its tool tip, and why it is disabled."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

_LINE: Final = 52


def _wrapped(text: str) -> str:
    """Break a long sentence, since a plain tool tip is one line."""
    lines = text.splitlines()
    return "\n".join(line if len(line) <= _LINE else textwrap.fill(line, _LINE) for line in lines)


def describe(widget: QWidget, name: str, shortcut: str = "", tip: str | None = None) -> None:
    """Name a control for those who cannot see it, and give it its tool tip."""
    widget.setAccessibleName(name)
    text = name if tip is None else tip
    text = f"{text} ({shortcut})" if shortcut and text else text
    wrapped = _wrapped(text)
    widget.setProperty("tip", wrapped)
    if widget.isEnabled():
        widget.setToolTip(wrapped)


def set_available(widget: QWidget, available: bool, why: str = "") -> None:
    """Enable or disable a control; a disabled one says why."""
    widget.setEnabled(available)
    tip = str(widget.property("tip") or "")
    widget.setToolTip(tip if available or not why else _wrapped(why))
    widget.setAccessibleDescription("" if available else why)
