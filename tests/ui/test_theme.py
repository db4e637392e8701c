"""Colours, type and scale; what Qt itself paints follows them."""

from __future__ import annotations

import sys
from dataclasses import fields

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QFontInfo, QFontMetricsF, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication, QLineEdit, QToolTip, QWidget
from pytestqt.qtbot import QtBot

from app.export.canvas import WEIGHTS
from app.ui.theme import Colours, Theme, ThemeName, apply, set_theme, theme
from app.ui.theme.style import bar_sheet, dress_menu, menu_sheet, palette
from app.ui.theme.theme import LINE_HEIGHTS, PALETTES
from app.ui.widgets.lists import ListPopup
from app.ui.widgets.surfaces import Menu

NAMES: tuple[ThemeName, ...] = ("dark", "light", "contrast")


@pytest.mark.parametrize("name", NAMES)
def test_every_token_becomes_its_colour(name: ThemeName) -> None:
    t = Theme(name)
    for token, code in PALETTES[name].items():
        assert getattr(t.c, token).name() == code
    assert [f.name for f in fields(Colours)] == list(PALETTES[name])


def test_edges_are_twice_as_wide_in_contrast() -> None:
    assert [Theme(name).line_width for name in NAMES] == [1, 1, 2]
    assert [Theme(name).contrast for name in NAMES] == [False, False, True]


def test_lengths_follow_the_scale_and_round_half_up() -> None:
    t = Theme("dark", 1.5)
    assert (t.px(8), t.px(3), t.px(1), t.px(0), t.px(-3)) == (12, 5, 2, 0, -5)
    assert (t.line_height(14), t.line_height(224), t.line_height(10)) == (30, 264, 21)


def test_the_scale_stays_within_its_limits() -> None:
    assert [Theme("dark", scale).scale for scale in (0.1, 1.2, 9)] == [1.0, 1.2, 2.0]


def test_an_unknown_theme_is_refused() -> None:
    with pytest.raises(KeyError):
        Theme("sepia")  # type: ignore[arg-type]


def test_the_theme_that_was_set_is_the_current_one() -> None:
    assert set_theme("light", 1.25) is theme()
    assert (theme().name, theme().scale) == ("light", 1.25)


@pytest.mark.parametrize("weight", WEIGHTS)
@pytest.mark.usefixtures("qapp")
def test_the_font_is_ours_with_figures_of_equal_width(weight: int) -> None:
    font = Theme().font(48, weight)
    assert QFontInfo(font).family() == "Inter"
    assert QFontInfo(font).weight() == weight
    metrics = QFontMetricsF(font)
    widths = [metrics.horizontalAdvance(figure) for figure in "0123456789"]
    # Proportional figures differ by a quarter of their width; the rest is the font's rounding.
    assert max(widths) - min(widths) < 0.005 * max(widths)
    assert metrics.horizontalAdvance("i") < metrics.horizontalAdvance("0")


@pytest.mark.usefixtures("qapp")
def test_type_grows_with_the_scale_and_each_font_is_a_copy() -> None:
    first, second = Theme("dark", 2).font(14), Theme("dark", 2).font(14)
    assert first.pixelSize() == 28
    first.setPixelSize(5)
    assert second.pixelSize() == Theme("dark", 2).font(14).pixelSize() == 28


@pytest.mark.usefixtures("qapp")
def test_every_size_of_the_design_fits_its_line() -> None:
    for size, line in LINE_HEIGHTS.items():
        metrics = QFontMetricsF(Theme().font(size))
        # The largest number stands alone: its line only needs to hold the figures.
        needed = metrics.capHeight() if size > 100 else metrics.ascent()
        assert needed <= line, size


@pytest.mark.parametrize("name", NAMES)
def test_qt_paints_in_the_theme(name: ThemeName, qapp: QApplication) -> None:
    t = set_theme(name, 1.5)
    apply(qapp)
    assert qapp.palette().color(QPalette.ColorRole.Window) == t.c.bg
    assert qapp.palette().color(QPalette.ColorRole.Text) == t.c.text
    grey = qapp.palette().color(QPalette.ColorGroup.Disabled, QPalette.ColorRole.ButtonText)
    assert grey == t.c.dis
    assert qapp.font().pixelSize() == 21
    # One for all would be looked up for every widget, whenever it is put into another.
    assert not qapp.styleSheet()
    for sheet in (bar_sheet(t), menu_sheet(t)):
        assert t.c.ctl.name() in sheet


def test_qt_alone_paints_a_tool_tip(qapp: QApplication, qtbot: QtBot) -> None:
    """Python may collect garbage as it runs: with the tip's owner the tip would go in painting."""
    apply(qapp)
    told = QWidget()
    qtbot.addWidget(told)
    told.show()
    QToolTip.showText(QPoint(50, 50), "Undo (Ctrl+Z)", told)
    tip = next(w for w in qapp.topLevelWidgets() if w.inherits("QTipLabel") and w.isVisible())
    ran: list[str] = []
    sys.setprofile(lambda frame, what, _arg: ran.append(what + frame.f_code.co_name))
    tip.grab()
    sys.setprofile(None)
    QToolTip.hideText()
    assert [each for each in ran if each.startswith("call")] == []


@pytest.mark.parametrize("name", NAMES)
def test_a_tool_tip_is_painted_in_the_theme(
    name: ThemeName, qapp: QApplication, qtbot: QtBot
) -> None:
    t = set_theme(name)
    apply(qapp)
    told = QWidget()
    qtbot.addWidget(told)
    told.show()
    QToolTip.showText(QPoint(50, 50), "Undo (Ctrl+Z)", told)
    tip = next(w for w in qapp.topLevelWidgets() if w.inherits("QTipLabel") and w.isVisible())
    seen = tip.grab().toImage()
    QToolTip.hideText()
    assert seen.pixelColor(0, 0) == t.c.ctl
    inside = {
        seen.pixelColor(x, y).name()
        for x in range(4, seen.width() - 4)
        for y in range(4, seen.height() - 4)
    }
    assert {t.c.tag.name(), t.c.ontag.name()} <= inside


def test_the_palette_of_one_theme_is_not_that_of_another(qapp: QApplication) -> None:
    assert qapp.palette() is not None
    assert palette(Theme("dark")) != palette(Theme("light"))


@pytest.mark.usefixtures("qtbot")
@pytest.mark.parametrize(("platform", "round_"), [("xcb", False), ("wayland", True)])
def test_no_black_corners_where_nothing_may_be_seen_behind_a_menu(
    monkeypatch: pytest.MonkeyPatch, platform: str, round_: bool
) -> None:
    monkeypatch.setattr(QGuiApplication, "platformName", staticmethod(lambda: platform))
    host = QWidget()
    menu, popup, copying = Menu(host), ListPopup(host, "Lamp"), QLineEdit(host)
    standard = copying.createStandardContextMenu()
    dress_menu(standard)
    for shown in (menu, popup, standard):
        assert shown.testAttribute(Qt.WidgetAttribute.WA_TranslucentBackground) == round_
    for dressed in (menu, standard):
        assert ("border-radius: 8px; padding" in dressed.styleSheet()) == round_
    assert popup._radius == (8 if round_ else 0)
