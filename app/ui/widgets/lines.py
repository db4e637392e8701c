"""Lines of a list that begin with a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout

from app.ui.theme import theme
from app.ui.widgets.cards import Frame
from app.ui.widgets.pictures import Picture

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class PictureLine(Frame):
    """A framed line: a picture, words one below the other, and what can be done with it.

    Parameters
    ----------
    picture : (h, w, 3) uint8 or None
        sRGB, as for `Picture.set_picture`; None leaves its place empty.
    """

    def __init__(
        self,
        name: str,
        picture: NDArray[np.uint8] | None,
        size: tuple[int, int],
        *,
        raised: bool = False,
    ) -> None:
        super().__init__("raised" if raised else "panel")
        t = theme()
        self.row = QHBoxLayout(self)
        self.row.setContentsMargins(t.px(8), t.px(8), t.px(8), t.px(8))
        self.row.setSpacing(t.px(16))
        shown = Picture(f"Picture of {name}")
        shown.setFixedSize(t.px(size[0]), t.px(size[1]))
        shown.set_picture(picture)
        self.row.addWidget(shown)
        self.words = QVBoxLayout()
        self.words.setSpacing(t.px(4))
        self.row.addLayout(self.words, 1)
