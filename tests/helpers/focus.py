"""Where the focus ring lies."""

from __future__ import annotations

import shiboken6
from PySide6.QtCore import QRect

from app.ui.theme.style import FocusRing

__all__ = ["rect_of"]


def rect_of(focus: FocusRing) -> QRect | None:
    """Outer rectangle of the ring in its host's coordinates; None while it is hidden."""
    ring = focus._ring
    if ring is None or not shiboken6.isValid(ring) or not ring.isVisible():
        return None
    return ring.geometry()
