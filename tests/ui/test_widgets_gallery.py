"""All components on one sheet, in three themes and at two resolutions.

The sheets are written beside the test's other temporary files, to be looked at:
``pytest tests/ui/test_widgets_gallery.py --basetemp=sheets``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication, QGridLayout, QHBoxLayout, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import ThemeName, apply, set_theme, theme
from app.ui.theme.icons import ICONS, draw_icon
from app.ui.widgets.buttons import Button, Chip, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.displays import Bar, Meter, Picture, Spinner, draw_meter
from app.ui.widgets.fields import ListField, TextField, Toggle
from app.ui.widgets.labels import KeyHint, Sign, Text
from app.ui.widgets.lists import Cell, Column, TableHead, TableRow
from app.ui.widgets.messages import Banner, Empty, Toasts
from app.ui.widgets.paint import put_text
from app.ui.widgets.surfaces import Card, Divider, Surface

THEMES: tuple[ThemeName, ...] = ("dark", "light", "contrast")
SIDES = [("all", "All 18"), ("in", "In reach 16"), ("out", "Out of reach 2"), ("mine", "Mine 0")]
PLANS = [("paper", "Quick", "3 frames, 9 s"), ("full", "Full range", "7 frames, 21 s")]
LAMPS = [Column("Lamps found"), Column("Azimuth", 88), Column("Share of the light", 200)]
SCENE = np.stack(np.meshgrid(*[np.linspace(0, 255, n) for n in (120, 80)]) * 2, axis=2)[..., :3]


class StyleCard(Card):
    """As on the Styles screen, without its pictures."""

    def paint_content(self, painter: QPainter) -> None:
        t = theme()
        inner = self.rect().adjusted(t.px(8), t.px(8), -t.px(8), -t.px(8))
        name = QRect(inner.left(), inner.top(), inner.width() - t.px(60), t.px(24))
        put_text(painter, name, self.accessibleName(), t.font(14, 600), t.c.text)
        turn = QRect(inner.right() - t.px(56), inner.top(), t.px(20), t.px(24))
        draw_icon(painter, "clockwise", turn, t.px(16), t.c.amber)
        degrees = QRect(turn.right() + t.px(4), inner.top(), t.px(36), t.px(24))
        put_text(painter, degrees, "96°", t.font(16, 600), t.c.amber)
        meter = QRect(inner.left(), inner.bottom() - t.px(12), inner.width(), t.px(12))
        draw_meter(painter, meter, 63, before=29)


def row(*widgets: QWidget) -> QHBoxLayout:
    line = QHBoxLayout()
    line.setSpacing(theme().px(8))
    for widget in widgets:
        line.addWidget(widget)
    line.addStretch(1)
    return line


def disabled(widget: QWidget) -> QWidget:
    widget.setEnabled(False)
    return widget


def buttons() -> list[QHBoxLayout]:
    busy = Button("Save as my style", "save")
    busy.set_busy("Saving…")
    held = Button("Lamps", "bulb", size="small", checkable=True)
    held.setChecked(True)
    down = Button("Pressed")
    down.setDown(True)
    hand = IconButton("hand", "Drag the panorama", checkable=True, size="small")
    hand.setChecked(True)
    off = Button("Turn to this", kind="primary")
    off.set_available(False, "No style is chosen.")
    return [
        row(
            Button("Turn to this", kind="primary", size="main"),
            Button("Paint", "brush", size="main"),
            IconButton("more", "More", size="main"),
        ),
        row(Button("Turn first", "counterclockwise", "primary"), busy, down),
        row(off, disabled(Button("Clear strokes")), Button("Quiet", "undo", "quiet")),
        row(
            hand,
            IconButton("minus", "Zoom out", size="small"),
            IconButton("plus", "Zoom in", size="small"),
            held,
            Button("Grid", "grid", size="small", checkable=True),
            Button("Change", size="small"),
        ),
        row(
            IconButton("undo", "Undo", kind="quiet", shortcut="Ctrl+Z"),
            disabled(IconButton("redo", "Redo", kind="quiet")),
            IconButton("search", "Find anything", kind="quiet", shortcut="Ctrl+K"),
            disabled(IconButton("redo", "Redo")),
            Button("Best match", trailing="chevron-down"),
        ),
    ]


def choices(column: QVBoxLayout) -> None:
    low = Chip("battery", "THETA V, 12 %")
    low.set("theta", "THETA V", "12 % battery")
    column.addLayout(row(SegmentedChoice(SIDES, "Which styles")))
    column.addWidget(SegmentedChoice(PLANS, "Plan", equal=True))
    column.addLayout(row(Chip("person", "Generic head, medium skin", menu=True), low))
    column.addWidget(LabelledSlider("Size", 8, 120, 64, 1, lambda v: f"{v:.0f} px"))
    faded = LabelledSlider("Exposure", -4, 4, 0, 0.1, lambda v: f"{v:.1f} EV", inline=True)
    column.addWidget(faded)
    column.addWidget(disabled(LabelledSlider("Overlay", 0, 100, 45, 1, "{:.0f} %".format)))
    pressure = Toggle("Pen pressure", "pen")
    pressure.setChecked(True)
    column.addWidget(Toggle("Mirror", "mirror"))
    column.addWidget(pressure)
    column.addWidget(disabled(Toggle("Within arm’s reach only")))


def fields(column: QVBoxLayout) -> None:
    wrong = TextField("Name of the place", "North studio")
    wrong.set_text("North/studio")
    wrong.set_error("A name cannot contain a slash.")
    column.addWidget(TextField("Address", "192.168.1.1", icon="wifi"))
    column.addWidget(wrong)
    start = [("rembrandt", "Rembrandt", "sitter’s left (camera right)"), ("flat", "Flat", "")]
    column.addWidget(ListField("Start from", start))
    column.addWidget(ListField("Your lamp", [("led", "LED panel", "5600 K")], icon="lamp"))
    column.addWidget(disabled(ListField("Sort by", [("match", "Best match")])))


def pictures(column: QVBoxLayout) -> None:
    line = QHBoxLayout()
    for name in ("Target", "Here, at 96°"):
        picture = Picture(name)
        picture.set_picture(np.ascontiguousarray(SCENE.astype(np.uint8)))
        picture.set_tag(name)
        picture.setFixedHeight(theme().px(88))
        line.addWidget(picture)
    column.addLayout(line)
    meter = Meter()
    meter.set(96.4)
    gain = Meter()
    gain.set(63, before=29)
    column.addWidget(meter)
    column.addWidget(gain)
    bar = Bar("Saving the originals")
    bar.set(0.66)
    column.addLayout(row(Text("Saving the originals, 2 of 3", 12), bar, Spinner()))
    column.addLayout(row(KeyHint("Space", "capture"), KeyHint("M", "move marker")))
    column.addLayout(row(Sign("plus"), Text("light helps", 12, role="dim"), Sign("minus")))


def words(column: QVBoxLayout) -> None:
    column.addWidget(Text("Rembrandt", 20, 600))
    column.addWidget(Text("Light from the sitter’s left (camera right)", role="dim"))
    column.addWidget(Text("96°", 48, 700, "amber"))
    column.addLayout(row(Text("in the light from 79° to 111°", 14, 600, "ok")))
    table = QVBoxLayout()
    table.setSpacing(0)
    table.addWidget(TableHead(LAMPS))
    column.addLayout(table)
    for letter, name in (("A", "Window"), ("B", "Ceiling tubes, front left")):
        cells = [Cell(name, letter=letter, strong=True), Cell("47°"), Cell("clipped", "hatch")]
        table.addWidget(TableRow(LAMPS, cells))
    text = (
        "Most of the light comes from it, and turns are rough. Two darker "
        "frames (−4 and −6 EV, 6 s) mend that. Keep the camera where it is."
    )
    title = "The window is still clipped at −2 EV."
    column.addWidget(Banner("warning", title, text, ["Add two darker frames"]))


def cards() -> QWidget:
    holder = QWidget()
    grid = QGridLayout(holder)
    for number, name in enumerate(("Loop", "Rembrandt", "Split", "Paint a new style")):
        card = StyleCard(name, dashed=number == 3)
        card.set_selected(number == 1)
        grid.addWidget(card, *divmod(number, 2))
    return holder


def gallery() -> QWidget:
    t = theme()
    whole = Surface("bg")
    across = QHBoxLayout(whole)
    across.setContentsMargins(0, 0, 0, 0)
    across.setSpacing(0)
    for number in range(3):
        surface = Surface("panel" if number != 1 else "bg", ("right",))
        column = QVBoxLayout(surface)
        column.setContentsMargins(t.px(24), t.px(16), t.px(24), t.px(16))
        column.setSpacing(t.px(12))
        if number == 0:
            for line in buttons():
                column.addLayout(line)
            column.addWidget(Divider())
            pictures(column)
            column.addWidget(cards())
        elif number == 1:
            choices(column)
            column.addWidget(Empty("Nothing here yet.", "Go to Probe"))
        else:
            words(column)
            fields(column)
        column.addStretch(1)
        across.addWidget(surface, 1)
    return whole


def icon_sheet(dpr: float) -> QImage:
    t = theme()
    columns, side = 11, t.px(64)
    size = QRect(0, 0, columns * side, -(-len(ICONS) // columns) * side).size() * dpr
    image = QImage(size, QImage.Format.Format_ARGB32_Premultiplied)
    image.setDevicePixelRatio(dpr)
    image.fill(t.c.panel)
    painter = QPainter(image)
    for number, name in enumerate(ICONS):
        row_number, column = divmod(number, columns)
        cell = QRect(column * side, row_number * side, side // 2, side)
        draw_icon(painter, name, cell, t.px(28), t.c.text)
        draw_icon(painter, name, cell.translated(side // 2, 0), t.px(16), t.c.dim)
    painter.end()
    return image


@pytest.mark.parametrize("name", THEMES)
@pytest.mark.parametrize("dpr", [1.0, 2.0])
def test_everything_paints_in_every_theme(
    name: ThemeName,
    dpr: float,
    qtbot: QtBot,
    qapp: QApplication,
    tmp_path: Path,
    picture_of: Callable[[QWidget, float], QImage],
) -> None:
    set_theme(name)
    apply(qapp)
    whole = gallery()
    qtbot.addWidget(whole)
    whole.resize(1440, 1000)
    whole.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen)
    whole.show()
    toasts = Toasts(whole)
    toasts.tell("Draft kept", kind="done", actions=[("Continue", lambda: None)])
    toasts.tell("The camera went away after frame 2 of 3. Both are here.", kind="error")
    qtbot.wait(10)
    image = picture_of(whole, dpr)
    assert image.save(str(tmp_path / f"widgets-{name}-{dpr:.0f}x.png"))
    icons = icon_sheet(dpr)
    assert icons.save(str(tmp_path / f"icons-{name}-{dpr:.0f}x.png"))
    assert image.width() == 1440 * dpr
    colours = {image.pixelColor(x, y).name() for x in range(0, 900, 7) for y in range(0, 900, 7)}
    # Whatever is missing or transparent would leave only the surfaces.
    assert {theme().c.panel.name(), theme().c.amberfill.name()} <= colours
    assert len(colours) > 20
