"""The Like this photo sheet: the photo, the chosen face and the head under movable lamps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QMouseEvent, QPainter
from PySide6.QtWidgets import QWidget

from app.core.text import tr
from app.ui.plots.parts.base import disc, draw_text
from app.ui.plots.sky_map import SkyMap
from app.ui.screens.styles.like_photo import RATIOS, SIDE, LikePhoto, LikeState
from app.ui.theme import px, theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.dialogs import KeysSheet
from app.ui.widgets.displays import Picture
from app.ui.widgets.fields import Toggle
from app.ui.widgets.labels import Text
from app.ui.widgets.layouts import column, row

_GAP = 16
_SIZES_DEG = (8.0, 80.0)
_FILL_PX = 8
_WORDS_PX = 24
_SOFTNESS = ((15.0, tr("hard")), (35.0, tr("medium")), (60.0, tr("soft")), (90.0, tr("very soft")))


@dataclass(frozen=True, slots=True, eq=False)
class _Sky:
    """An empty background, used because the match is not computed for every direction."""

    tones: NDArray[np.uint8] = field(default_factory=lambda: np.full((2, 4), 64, np.uint8))
    closed: None = None
    line: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 4), np.float32))
    half_height_deg: float = 90.0


class _LampMap(SkyMap):
    """A map of the lamps around the face: the key, and the fill if there is one."""

    fill = False
    ground = "panel"

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Position of the key"))
        self.setToolTip(
            tr("Drag the key. Arrow keys move it by 1°, or by 10° with Shift. Home resets it.")
        )
        self.show_sky(_Sky())

    def lamp_moved(self) -> None:
        """Move the labels along with the lamp."""
        super().lamp_moved()
        self.update()

    def draw_over(self, painter: QPainter, _ratio: float) -> None:
        """Paint the fill and the labels over the map."""
        state = self._state
        if self.fill:
            disc(painter, self.place_of(0.0, 0.0), px(_FILL_PX), None, theme().c.amberfill, 2.0)
            self._name(painter, (0.0, 0.0), tr("fill"))
        if state is not None and state.best is not None:
            self._name(painter, state.best, tr("as read"))

    def _name(self, painter: QPainter, spot: tuple[float, float], words: str) -> None:
        x, y = self.place_of(*spot)
        draw_text(painter, (x, y + px(_WORDS_PX)), words, theme().font(12), theme().c.ontag, 0.5)


class _Photo(Picture):
    """The whole photo. Clicking a face chooses that face."""

    pressed = Signal(float, float)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Emit the position of a click, as fractions of the picture's size."""
        at = event.position()
        self.pressed.emit(at.x() / self.width(), at.y() / self.height())


def _softness_words(size_deg: float) -> str:
    words = next(words for most, words in _SOFTNESS if size_deg <= most)
    return tr("{size:.0f}°, {words}", size=size_deg, words=words)


class LikeSheet(KeysSheet):
    """A sheet that shows the light in a photo and lets the user correct and save it."""

    def __init__(self, host: QWidget, like: LikePhoto) -> None:
        super().__init__(host, tr("Like this photo"), 3 * SIDE + 2 * _GAP + 48)
        self._photo, self._face = _Photo(tr("Photo")), Picture(tr("Face"))
        self._head = Picture(tr("Head in this light"))
        pictures = (self._photo, self._face, self._head)
        for picture in pictures:
            picture.setFixedSize(px(SIDE), px(SIDE))
        self._face.set_tag(tr("Photo"))
        self._head.set_tag(tr("Head in this light"))
        self._note, self._trouble = Text("", 14, wrap=True), Text("", 14, 600, wrap=True)
        self._lamps = _LampMap()
        self._size = LabelledSlider(
            tr("Softness of the key"), *_SIZES_DEG, 20.0, 1.0, _softness_words
        )
        self._ratio = SegmentedChoice(RATIOS, name=tr("Lighting ratio"))
        self._save = Button(tr("Save as my style"), "save", kind="primary")
        self._controls = QWidget()
        label = Text(tr("Lighting ratio"), 12, 600)
        choices = row((self._size, 1), column(label, row(self._ratio, ...), gap=6), gap=24)
        hint = Text(tr("Drag the key to where its light comes from"), 12, 600)
        plot = column(hint, self._lamps, gap=4)
        column(self._note, plot, choices, into=self._controls, gap=12)
        self._mirrored, self._hint = Toggle(tr("Mirrored")), Text("", 14, wrap=True)
        self._mirrored.setToolTip(tr("Some phones save selfies as mirror images"))
        self.body.addLayout(row(*pictures, gap=_GAP))
        self.body.addLayout(row(self._mirrored, (self._hint, 1), gap=_GAP))
        self.body.addWidget(self._trouble)
        self.body.addWidget(self._controls)
        self._again = Button(tr("Reset to the photo"), "restore", do=like.go_back)
        self.add_button(self._again)
        self.add_button(self._save)
        self._connect(like)

    def _connect(self, like: LikePhoto) -> None:
        self._photo.pressed.connect(like.choose_at)
        self._mirrored.switched.connect(like.set_mirrored)
        self._lamps.moved.connect(like.move)
        self._lamps.home_asked.connect(like.go_back)
        self._size.changed.connect(like.set_size)
        self._ratio.chosen.connect(like.set_fill)
        self._save.clicked.connect(like.save)
        self._save.clicked.connect(self.shut)

    def show_state(self, state: LikeState) -> None:
        """Show a `LikeState`."""
        self._photo.set_picture(state.photo)
        self._face.set_picture(state.face)
        self._head.set_picture(state.head)
        several = len(state.faces) > 1
        self._photo.set_tag(tr("Click another face to read it") if several else "")
        self._photo.setCursor(
            Qt.CursorShape.PointingHandCursor if several else Qt.CursorShape.ArrowCursor
        )
        self._mirrored.setChecked(state.mirrored)
        self._hint.set_text(state.hint)
        self._trouble.say(state.trouble)
        works = state.light is not None and not state.trouble
        self._controls.setVisible(works)
        self._save.setEnabled(works)
        self._again.setVisible(works and state.light is not state.read)
        self._note.set_text(state.note)
        light = state.light
        if light is None or not works:
            return
        self._lamps.fill = light.fill_ratio is not None
        self._lamps.show_heads(state)
        self._size.set_value(light.softness_deg or _SIZES_DEG[0])
        self._ratio.choose("none" if light.fill_ratio is None else f"{light.fill_ratio:g}")
