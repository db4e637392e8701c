"""Text, pictures, meters, tags, tables, banners: what they show, and that all can be read out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from app.ui.theme import ThemeName, set_theme, theme
from app.ui.widgets.buttons import Button, Chip, IconButton
from app.ui.widgets.choices import LabelledSlider, SegmentedChoice
from app.ui.widgets.displays import Bar, Meter, Picture, Spinner
from app.ui.widgets.fields import ListField, TextField, Toggle
from app.ui.widgets.labels import Icon, KeyHint, Sign, Text, draw_sign
from app.ui.widgets.lists import Cell, Column, TableHead, TableRow, places
from app.ui.widgets.messages import Banner, Empty
from app.ui.widgets.paint import Anchor, draw_tag, mix, tag_size
from app.ui.widgets.surfaces import Card, Divider

PictureOf: TypeAlias = Callable[[QWidget, float], QImage]
LAMPS = [Column("Lamp"), Column("Azimuth", 88), Column("Share", 120)]
LONG = "Most of the light comes from it, and turns may be a few degrees off."


def canvas(width: int, height: int, ground: str = "#808080") -> QImage:
    image = QImage(width, height, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(QColor(ground))
    return image


def everything() -> list[QWidget]:
    return [
        Text("Rembrandt"),
        Button("Paint"),
        IconButton("plus", "Zoom in"),
        Chip("person", "Generic head"),
        SegmentedChoice([("a", "A"), ("b", "B")], "Choice"),
        LabelledSlider("Size", 0, 1, 0, 1, str),
        Toggle("Mirror"),
        Picture("Target"),
        Meter(),
        KeyHint("Space", "capture"),
        Card("Loop"),
        Bar(),
        Spinner(),
        Sign("plus"),
        TableHead(LAMPS),
        TableRow(LAMPS, [Cell("Window"), Cell("47°"), Cell("3 %")]),
        Banner("warning", "The window is clipped."),
        Empty("Nothing here yet."),
        Icon("check", says="done"),
    ]


def test_every_component_can_be_read_out_and_painted(qtbot: QtBot, picture_of: PictureOf) -> None:
    for name in ("dark", "light", "contrast"):
        set_theme(name)
        name_field, lamp_field = TextField("Name"), ListField("Lamp", [("led", "LED panel")])
        for field in (name_field, lamp_field):
            qtbot.addWidget(field)
        for widget in (*everything(), name_field.edit, lamp_field.box):
            if widget.parentWidget() is None:
                qtbot.addWidget(widget)
            said = widget.text() if isinstance(widget, Text) else widget.accessibleName()
            assert said, type(widget).__name__
            widget.resize(widget.sizeHint().expandedTo(widget.minimumSizeHint()))
            assert not picture_of(widget, 2).isNull()


def test_what_can_have_the_keyboard_can_be_tabbed_to(qtbot: QtBot) -> None:
    for widget in everything():
        qtbot.addWidget(widget)
        if widget.focusPolicy() != Qt.FocusPolicy.NoFocus:
            assert widget.focusPolicy() & Qt.FocusPolicy.TabFocus, type(widget).__name__


@pytest.mark.parametrize(("size", "line"), [(12, 16), (14, 20), (20, 28), (48, 52)])
def test_text_stands_on_the_lines_of_the_design(size: int, line: int, qtbot: QtBot) -> None:
    text = Text("96°\n45°", size)
    qtbot.addWidget(text)
    assert text.sizeHint().height() == 2 * line


def test_text_wraps_at_words_and_gets_higher(qtbot: QtBot) -> None:
    text = Text(LONG, wrap=True)
    qtbot.addWidget(text)
    widths = (2000, 240, 120)
    heights = [text.heightForWidth(width) for width in widths]
    assert heights[0] == 20 < heights[1] < heights[2]
    assert heights[1] % 20 == 0
    assert " ".join(text._broken(120)) == LONG


def test_elided_text_shows_the_whole_as_tool_tip(qtbot: QtBot, picture_of: PictureOf) -> None:
    text = Text(LONG, elide=True)
    qtbot.addWidget(text)
    text.resize(80, 20)
    text.show()
    assert text.toolTip() == LONG
    text.resize(text.sizeHint())
    assert text.toolTip() == ""
    text.set_text("Window")
    assert text.sizeHint().width() < 80


@pytest.mark.parametrize("role", ["text", "dim", "amber", "ok", "err"])
@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
def test_text_takes_its_colour_from_its_role(
    role: str, name: ThemeName, qtbot: QtBot, picture_of: PictureOf
) -> None:
    c = set_theme(name).c
    text = Text("█████", 20)
    qtbot.addWidget(text)
    text.set_role(role)  # type: ignore[arg-type]
    text.resize(text.sizeHint())
    wanted: QColor = getattr(c, role)
    assert text.colour() == wanted
    text.setEnabled(False)
    assert text.colour() == c.dis


def stripes(width: int, height: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Left third red, middle third green, right third blue."""
    picture = np.zeros((height, width, 3), np.uint8)
    for channel, part in enumerate(np.array_split(np.arange(width), 3)):
        picture[:, part, channel] = 255
    return picture


@pytest.mark.parametrize("dpr", [1, 1.5, 2])
def test_a_picture_is_cropped_in_its_middle(
    dpr: float, qtbot: QtBot, picture_of: PictureOf
) -> None:
    picture = Picture("Target")
    qtbot.addWidget(picture)
    picture.resize(60, 60)
    picture.set_picture(stripes(180, 60))
    image = picture_of(picture, dpr)
    for x in (4, 30, 55):
        assert image.pixelColor(round(x * dpr), round(30 * dpr)).name() == "#00ff00"


@pytest.mark.parametrize("dpr", [1, 2])
def test_its_pixels_are_those_of_the_array(dpr: int, qtbot: QtBot, picture_of: PictureOf) -> None:
    """At its own size nothing is resampled, and the corners are round."""
    noise = np.random.default_rng(5).integers(0, 255, (40 * dpr, 60 * dpr, 3), np.uint8)
    picture = Picture("Target")
    qtbot.addWidget(picture)
    picture.resize(60, 40)
    picture.set_picture(noise)
    image = picture_of(picture, dpr).convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    shown = rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)
    inner = slice(8 * dpr, -8 * dpr)
    np.testing.assert_array_equal(shown[inner, inner], noise[inner, inner])
    assert not np.array_equal(shown[0, 0], noise[0, 0])


def test_an_empty_well_is_the_same_in_every_theme(qtbot: QtBot, picture_of: PictureOf) -> None:
    for name in ("dark", "light", "contrast"):
        set_theme(name)
        picture = Picture("Live")
        qtbot.addWidget(picture)
        picture.resize(60, 40)
        assert picture_of(picture, 1).pixelColor(30, 20).name() == "#2b2b2b"


def test_tags_stand_in_the_corners(qtbot: QtBot, picture_of: PictureOf) -> None:
    picture = Picture("Target")
    qtbot.addWidget(picture)
    picture.resize(200, 100)
    picture.set_tag("Target")
    picture.set_tag("A", "tr")
    image = picture_of(picture, 1)
    assert image.pixelColor(12, 100 - 8 - 3).name() == theme().c.tag.name()
    assert image.pixelColor(200 - 8 - 4, 8 + 2).name() == theme().c.tag.name()
    picture.set_tag("", "tr")
    assert picture_of(picture, 1).pixelColor(188, 10).name() == theme().c.well.name()


@pytest.mark.parametrize(
    "wrong", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4, 3))]
)
def test_what_is_no_picture_is_refused(
    wrong: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], qtbot: QtBot
) -> None:
    picture = Picture("Target")
    qtbot.addWidget(picture)
    with pytest.raises(ValueError, match="uint8 picture"):
        picture.set_picture(wrong)


@pytest.mark.parametrize("dpr", [1, 2])
def test_a_meter_shows_value_gain_and_limit(dpr: int, qtbot: QtBot, picture_of: PictureOf) -> None:
    meter = Meter()
    qtbot.addWidget(meter)
    meter.set(63, before=29)
    meter.resize(200, 8)
    image = picture_of(meter, dpr)
    c = theme().c
    gain = mix(c.track2, c.text, 0.45)

    def at(share: float, y: float = 4) -> str:
        return image.pixelColor(int(2 * share * dpr), int(y * dpr)).name()

    assert (at(20), at(50), at(80)) == (c.text.name(), gain.name(), c.track2.name())
    assert at(45, 0.5) == c.dim.name()
    assert at(20, 0.5) not in (c.text.name(), c.dim.name(), gain.name())
    assert meter.accessibleName() == "Match 63 of 100, previously 29"


def test_a_meter_floors_what_it_says(qtbot: QtBot) -> None:
    meter = Meter("Strength")
    qtbot.addWidget(meter)
    meter.set(44.99)
    assert meter.accessibleName() == "Strength 44 of 100"


@pytest.mark.parametrize(
    ("anchor", "left", "top"),
    [("tl", 50, 40), ("br", None, 20), ("c", None, 30), ("t", None, 40), ("bl", 50, 20)],
)
def test_tags_hang_on_their_anchor(
    anchor: Anchor, left: int | None, top: int, qtbot: QtBot
) -> None:
    image = canvas(200, 100)
    painter = QPainter(image)
    place = draw_tag(painter, 50, 40, "Goal", anchor)
    painter.end()
    width, height = tag_size("Goal")
    assert (place.width(), place.height(), height) == (width, 20, 20)
    assert place.top() == top
    if left is not None:
        assert place.left() == left
    assert place.adjusted(-1, -1, 1, 1).contains(QPointF(50, 40))
    inside = image.pixelColor(int(place.center().x()), int(place.top()) + 1)
    assert inside.name() == theme().c.tag.name()
    assert qtbot is not None


@pytest.mark.parametrize("sign", ["plus", "minus"])
def test_weights_have_their_sign(sign: str, qtbot: QtBot) -> None:
    image = canvas(32, 32)
    painter = QPainter(image)
    draw_sign(painter, QRectF(0, 0, 32, 32), sign)  # type: ignore[arg-type]
    painter.end()
    assert image.pixelColor(5, 16) == getattr(theme().c, sign)
    assert image.pixelColor(12, 16).name() == "#000000"
    assert (image.pixelColor(16, 11).name() == "#000000") == (sign == "plus")
    assert qtbot is not None


def test_columns_share_what_is_left() -> None:
    assert places(LAMPS, 500) == [(0, 292), (292, 88), (380, 120)]
    assert places(LAMPS, 100)[0] == (0, 0)


def test_a_row_is_read_out_with_its_columns(qtbot: QtBot) -> None:
    row = TableRow(LAMPS, [Cell("Window", letter="A"), Cell("47°"), Cell("at least 64 %")])
    qtbot.addWidget(row)
    assert row.accessibleName() == "Lamp A Window, Azimuth 47°, Share at least 64 %"
    assert row.height() == 44
    with pytest.raises(ValueError, match="zip"):
        row.set([Cell("Window")])


def test_advice_offers_its_action(qtbot: QtBot) -> None:
    banner = Banner("warning", "The window is still clipped at −2 EV.", LONG, ["Add two frames"])
    qtbot.addWidget(banner)
    banner.resize(390, 160)
    banner.show()
    assert banner.accessibleName() == f"The window is still clipped at −2 EV. {LONG}"
    with qtbot.waitSignal(banner.pressed) as pressed:
        QTest.mouseClick(banner.button(), Qt.MouseButton.LeftButton)
    assert pressed.args == [0]
    banner.set("check", "All is well.")
    with pytest.raises(IndexError):
        banner.button()


def test_an_empty_place_offers_what_fills_it(qtbot: QtBot) -> None:
    empty = Empty("No panorama yet.", "Try the demo place", second="Open files…")
    qtbot.addWidget(empty)
    empty.show()
    with qtbot.waitSignal(empty.pressed) as pressed:
        QTest.mouseClick(empty.button(1), Qt.MouseButton.LeftButton)
    assert pressed.args == [1]
    empty.set("No lamp chosen.")
    assert empty.accessibleName() == "No lamp chosen."


@pytest.mark.parametrize("dpr", [1, 2])
def test_a_bar_shows_its_share(dpr: int, qtbot: QtBot, picture_of: PictureOf) -> None:
    bar = Bar("Saving the originals")
    qtbot.addWidget(bar)
    bar.set(0.5)
    assert (bar.width(), bar.height()) == (160, 4)
    image = picture_of(bar, dpr)
    c = theme().c
    assert image.pixelColor(70 * dpr, 2 * dpr) == c.text
    assert image.pixelColor(90 * dpr, 2 * dpr) == c.track2
    for share, value in ((7.0, 1000), (-1.0, 0)):
        bar.set(share)
        assert bar.value() == value


def test_a_bar_of_unknown_length_moves(qtbot: QtBot, picture_of: PictureOf) -> None:
    bar = Bar()
    qtbot.addWidget(bar)
    bar.show()
    bar.set(None)
    first = picture_of(bar, 1)
    qtbot.waitUntil(lambda: picture_of(bar, 1) != first)


@pytest.mark.parametrize("dpr", [1, 2])
@pytest.mark.parametrize(("name", "width"), [("dark", 2), ("light", 2), ("contrast", 4)])
def test_the_chosen_card_has_a_wider_edge(
    dpr: int, name: ThemeName, width: int, qtbot: QtBot, picture_of: PictureOf
) -> None:
    c = set_theme(name).c
    card = Card("Loop")
    qtbot.addWidget(card)
    card.resize(card.sizeHint())
    card.set_selected(True)
    assert (card.width(), card.height()) == (206, 138)
    image = picture_of(card, dpr)
    column = [image.pixelColor(100 * dpr, y).name() for y in range(8 * dpr)]
    assert column == [c.sel.name()] * (width * dpr) + [c.raised.name()] * ((8 - width) * dpr)


def test_a_divider_is_as_wide_as_edges(qtbot: QtBot) -> None:
    assert Divider().height() == 1
    set_theme("contrast")
    assert Divider().height() == 2
    assert qtbot is not None
