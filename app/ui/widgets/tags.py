"""Labels on pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from PySide6.QtCore import QRectF

from app.ui.theme import theme
from app.ui.widgets.paint import MIDDLE, box, put_text, text_width

if TYPE_CHECKING:
    from PySide6.QtGui import QColor, QPainter

Anchor: TypeAlias = Literal["tl", "tr", "bl", "br", "t", "b", "c"]
"""Which point of the tag is given: a corner, the middle of an edge, or the centre."""

_HEIGHT: Final = 20
_PADDING: Final = 8


def tag_size(text: str, weight: int = 400) -> tuple[int, int]:
    """Give width and height of a tag in logical pixels.

    Returns
    -------
    tuple of int
        (width, height).
    """
    t = theme()
    return text_width(t.font(12, weight), text) + 2 * t.px(_PADDING), t.px(_HEIGHT)


def draw_tag(
    painter: QPainter,
    x: float,
    y: float,
    text: str,
    anchor: Anchor = "tl",
    fill: QColor | None = None,
    ink: QColor | None = None,
    weight: int = 400,
) -> QRectF:
    """Paint a tag: 12 px letters on a dark plate with corners of 4.

    Parameters
    ----------
    x, y : float
        The point that `anchor` names, logical pixels.
    anchor : str, optional
        "tl", "tr", "bl", "br", "t", "b" or "c".
    """
    t = theme()
    width, height = tag_size(text, weight)
    left = x - (width if "r" in anchor else 0 if "l" in anchor else width / 2)
    top = y - (height if "b" in anchor else 0 if "t" in anchor else height / 2)
    area = QRectF(round(left), round(top), width, height)
    box(painter, area, t.px(4), fill or t.c.tag)
    put_text(painter, area, text, t.font(12, weight), ink or t.c.ontag, MIDDLE)
    return area
