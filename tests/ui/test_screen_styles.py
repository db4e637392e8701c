"""The Styles screen by mouse and keyboard."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QFontMetricsF, QGuiApplication, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QFileDialog, QWidget
from pytestqt.qtbot import QtBot

from app.core.base.angles import at_turn
from app.core.base.errors import CoreError
from app.core.places.place import CaptureFacts, Place
from app.core.portrait.full_size_portrait import portrait_picture
from app.core.portrait.gallery_portraits import framing
from app.core.portrait.light import portrait_light
from app.core.storage.item_library import DamagedItem
from app.core.styles.lamps import Studio
from app.ui.presenters.window_model import NEEDS_LIGHT, NO_LIGHT, Step
from app.ui.screens.styles.cards import CANNOT_READ, CardState
from app.ui.screens.styles.cards_view import (
    NO_TURNS,
    CompareSheet,
    DamagedCard,
    PaintCard,
    StyleCard,
    card_size,
)
from app.ui.screens.styles.detail_view import picture_sizes
from app.ui.screens.styles.files import LIKE_PHOTO
from app.ui.screens.styles.gallery_view import layout_for
from app.ui.screens.styles.lamps_and_lens_view import LampsSheet
from app.ui.screens.styles.screen_view import StylesScreen, detail_width
from app.ui.theme import theme
from app.ui.widgets.buttons import Button
from app.ui.widgets.dialogs import Sheet, Term
from app.ui.widgets.displays import Picture
from app.ui.widgets.labels import Text
from app.ui.widgets.paint import put_text
from app.ui.widgets.surfaces import Menu
from app.words.explanations import EXPLANATIONS
from app.words.verdict import own_lamps_words
from tests.helpers.styles_screen import Table, head, scene_light

KEY = Qt.Key
PLAIN = Qt.KeyboardModifier.NoModifier


def captured(plan: str, share: float) -> Place:
    """A place whose bracket left so much of the light clipped."""
    day = datetime(2026, 11, 21, 14, 5, tzinfo=UTC)
    return Place("Here", day, capture=CaptureFacts(plan=plan, clipped_share=share))


@pytest.mark.parametrize(
    ("plan", "share", "offered"),
    [("paper", 0.3, True), ("paper", 0.001, False), ("full", 0.3, False), ("files", 0.3, False)],
)
def test_a_clipped_capture_is_taken_anew_for_the_style_in_front(
    qtbot: QtBot, tmp_path: Path, plan: str, share: float, offered: bool
) -> None:
    table = Table(tmp_path).open(scene_light("interior"))
    table.model.update(place=captured(plan, share))
    shown = Shown(qtbot, table)
    table.presenter.choose("left-loop")
    shown.settle()
    button = shown.view.detail.recapture
    assert button.isVisible() is offered
    if offered:
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        assert table.model.step == Step.PROBE
        assert table.model.recapture
        assert table.model.chosen == "left-loop"


@pytest.mark.parametrize("in_reach", [True, False])
@pytest.mark.parametrize("wide", [180, 290])
def test_every_card_has_its_grade_however_long_its_reason(
    qtbot: QtBot, monkeypatch: pytest.MonkeyPatch, in_reach: bool, wide: int
) -> None:
    reason = "the middle of the face is not dark enough"
    state = CardState("top", "Top", line=reason, word="Soft", turn="121°", in_reach=in_reach)
    found: dict[str, QRect] = {}

    def put(painter: Any, area: QRect, text: str, font: Any, *rest: Any) -> None:
        found[text] = QRect(area)
        put_text(painter, area, text, font, *rest)

    monkeypatch.setattr("app.ui.screens.styles.cards_view.put_text", put)
    card = StyleCard(state)
    qtbot.addWidget(card)
    card.setFixedSize(card_size(wide))
    card.grab()
    assert {"Soft", reason, "Top", "121°"} <= set(found)
    assert found["Soft"].top() == found[reason].top() > found["Top"].top()
    width = QFontMetricsF(theme().font(12, 600)).horizontalAdvance("Soft")
    assert found[reason].left() >= found["Soft"].left() + width
    assert found[reason].right() <= wide - 8


class Shown:
    """A screen with a place, or without, and with the numbers behind *Why?*."""

    def __init__(
        self, qtbot: QtBot, table: Table, compact: bool = False, *, numbers: bool = True
    ) -> None:
        self.bot, self.table = qtbot, table
        table.model.set("show_numbers", numbers)
        self._before = table.runner.ran.count("styles-pictures")
        self.view = StylesScreen(table.presenter, compact)
        qtbot.addWidget(self.view)
        self.view.resize(*((952, 620) if compact else (1352, 804)))
        table.presenter.attach(self.view)
        self.view.show()
        self.view.activateWindow()
        self.settle()

    def settle(self) -> None:
        for _ in range(4):
            QApplication.processEvents()

    def press(self, key: Qt.Key, modifiers: Qt.KeyboardModifier = PLAIN) -> None:
        widget = QApplication.focusWidget()
        assert widget is not None
        QTest.keyClick(widget, key, modifiers)
        self.settle()

    @property
    def pictures_made(self) -> int:
        """How often all pictures were made since the view is there."""
        return int(self.table.runner.ran.count("styles-pictures")) - self._before

    @property
    def keys(self) -> list[str]:
        return [card.key for card in self.table.presenter.resolve().cards]

    @property
    def chosen(self) -> str | None:
        return self.table.model.chosen

    def card(self, key: str) -> StyleCard:
        return self.view.gallery._cards[key]


@pytest.fixture
def shown(qtbot: QtBot, tmp_path: Path) -> Shown:
    return Shown(qtbot, Table(tmp_path).open(scene_light()))


@pytest.fixture
def small(qtbot: QtBot, tmp_path: Path) -> Shown:
    return Shown(qtbot, Table(tmp_path).open(scene_light()), compact=True)


def goal(shown: Shown) -> float | None:
    return shown.table.model.goal_deg


def step(shown: Shown) -> str:
    return shown.table.model.step


def needle(shown: Shown) -> float | None:
    return shown.table.model.needle_deg


def test_target_and_here_share_the_width_in_the_narrow_layout(small: Shown) -> None:
    """As long as the paper's median and minimum are not beside them."""
    fresh = type(small.view.detail)(True, lambda: ())
    small.bot.addWidget(fresh)
    fresh.resize(small.view.detail.size())
    fresh.show()
    for detail in (small.view.detail, fresh):
        portrait, _ = picture_sizes(detail.width(), compact=True)
        assert detail.target.size() == detail.here.size() == portrait
        assert 2 * portrait.width() > 0.8 * detail.width()


class TestGrid:
    def test_four_columns_of_the_design(self, shown: Shown) -> None:
        cards = [shown.card(key) for key in shown.keys]
        assert {(card.width(), card.height()) for card in cards} == {(206, 176)}
        gives = shown.table.presenter.resolve().groups[0].count
        assert gives == 3
        assert [card.x() for card in cards[:8]] == [24, 238, 452, 24, 238, 452, 666, 24]
        layout = layout_for(shown.view.gallery.width(), compact=False)
        assert (layout.card.width(), layout.card.height()) == (206, 176)
        assert shown.view.detail.width() == 456

    @pytest.mark.parametrize("compact", [False, True])
    def test_half_of_a_card_and_more_is_faces(
        self, qtbot: QtBot, tmp_path: Path, compact: bool
    ) -> None:
        """Of the head that is smallest in its picture; counted in the picture of its coverage."""
        shown = Shown(qtbot, Table(tmp_path).open(scene_light()), compact)
        card = shown.card(shown.keys[0])
        picture = card.state.here
        assert picture is not None
        for name in ("generic", "female", "male"):
            wanted = framing(100, picture.shape[:2], close=True)
            coverage = head(name).pack.coverage.astype(np.float32)
            seen = wanted.of(coverage[np.newaxis])[0] >= 0.5
            assert 2 * seen.sum() >= 0.49 * card.width() * card.height(), name

    def test_the_first_picture_is_of_the_size_of_the_card(self, shown: Shown) -> None:
        picture = shown.card(shown.keys[0]).state.here
        assert picture is not None
        assert picture.shape == (127, 99, 3)
        assert [job for job in shown.table.runner.ran if "detail" not in job][
            -1
        ] == "styles-pictures"
        assert shown.pictures_made == 0, "they were of the right size before the view was there"

    def test_arrows_move_the_choice_in_two_dimensions(self, shown: Shown) -> None:
        keys = shown.keys
        shown.table.presenter.choose(keys[0])
        shown.view.gallery.focus_card()
        # The place gives three styles, so the others begin in the next row.
        for key, place in ((KEY.Key_Right, 1), (KEY.Key_Down, 4), (KEY.Key_Left, 3)):
            shown.press(key)
            assert shown.chosen == keys[place]
            assert QApplication.focusWidget() is shown.card(keys[place])
        shown.press(KEY.Key_Right)
        shown.press(KEY.Key_Right)
        shown.press(KEY.Key_Right)
        assert shown.chosen == keys[6]
        shown.press(KEY.Key_Right)
        assert shown.chosen == keys[7], "on to the next row, as one reads"
        shown.press(KEY.Key_End)
        assert shown.chosen == keys[-1]
        shown.press(KEY.Key_Home)
        assert shown.chosen == keys[0]

    def test_the_grid_is_one_stop_for_tab(self, shown: Shown) -> None:
        shown.view.gallery.focus_card()
        shown.press(KEY.Key_Tab)
        focus = QApplication.focusWidget()
        assert focus is not None
        assert isinstance(focus, PaintCard)
        stops = [c for c in shown.view.findChildren(StyleCard) if tabbed(c)]
        assert [card.state.key for card in stops] == [shown.chosen]

    def test_a_click_chooses_and_a_double_click_turns(self, shown: Shown) -> None:
        key = shown.keys[2]
        QTest.mouseClick(shown.card(key), Qt.MouseButton.LeftButton)
        assert shown.chosen == key
        assert step(shown) is not Step.TURN
        QTest.mouseDClick(shown.card(key), Qt.MouseButton.LeftButton)
        assert step(shown) is Step.TURN
        result = shown.table.model.result
        assert result is not None
        assert goal(shown) == pytest.approx(result.turn_refined_deg)

    def test_enter_turns_and_space_chooses(self, shown: Shown) -> None:
        keys = shown.keys
        shown.table.presenter.choose(keys[0])
        shown.view.gallery.focus_card()
        shown.press(KEY.Key_Right)
        shown.press(KEY.Key_Space)
        assert step(shown) is not Step.TURN
        shown.press(KEY.Key_Return)
        assert step(shown) is Step.TURN
        assert shown.chosen == keys[1]

    def test_enter_from_a_shortcut_of_the_window_turns_too(self, shown: Shown) -> None:
        """The window's Return presses whatever button has the focus by calling `click`."""
        shown.view.gallery.focus_card()
        focus = QApplication.focusWidget()
        assert isinstance(focus, QAbstractButton)
        focus.click()
        assert step(shown) is Step.TURN

    def test_cards_say_what_they_show(self, shown: Shown) -> None:
        for card in shown.view.findChildren(StyleCard):
            assert card.accessibleName() == card.state.spoken
            assert card.accessibleDescription() == ("selected" if card.state.chosen else "")
        assert any(
            card.accessibleName().startswith(
                "Rembrandt, light from the sitter’s left, camera right"
            )
            for card in shown.view.findChildren(StyleCard)
        )

    def test_filter_and_order_by_hand(self, shown: Shown) -> None:
        part = shown.view.gallery._filter.part("mine")
        QTest.mouseClick(part, Qt.MouseButton.LeftButton)
        shown.settle()
        assert not any(card.isVisible() for card in shown.view.findChildren(StyleCard))
        shown.view.gallery._sort.chosen.emit("name")
        shown.view.gallery._filter.chosen.emit("all")
        for group in shown.table.presenter.resolve().groups:
            titles = [shown.card(card.key).state.title for card in group.cards]
            assert titles == sorted(titles)
        assert shown.card(shown.keys[0]).pos() == QPoint(24, 36)

    def test_headings_stand_over_their_cards(self, shown: Shown) -> None:
        headings = [one for one in shown.view.gallery._headings if one.isVisible()]
        assert [one.accessibleName() for one in headings] == ["This place gives", "Not here"]
        gives, rest = (
            [shown.card(card.key).geometry() for card in group.cards]
            for group in shown.table.presenter.resolve().groups
        )
        assert headings[0].geometry().bottom() < min(card.top() for card in gives)
        assert max(card.bottom() for card in gives) < headings[1].y()
        assert headings[1].geometry().bottom() < min(card.top() for card in rest)

    def test_the_switch_shows_the_other_side_by_click_and_key(self, shown: Shown) -> None:
        card = shown.card("left-loop")
        QTest.mouseClick(card.switch, Qt.MouseButton.LeftButton)
        shown.settle()
        assert shown.chosen == "right-loop"
        assert not card.isVisible()
        other = shown.card("right-loop")
        assert other.isVisible()
        assert other.geometry() == card.geometry()
        assert "sitter’s left: soft, " in other.switch.accessibleName()
        shown.view.gallery.focus_card()
        actions = {action.key: action for action in shown.table.presenter.actions()}
        actions["other-side"].run()
        shown.settle()
        assert shown.chosen == "left-loop"
        assert QApplication.focusWidget() is card, "the focus stays with the card"
        assert not shown.card("flat").switch.isVisible()

    def test_the_lit_half_of_the_switch_is_that_of_the_picture(self, shown: Shown) -> None:
        """Camera right is the sitter's left: the right disc, and its right half."""
        switch = shown.card("left-loop").switch
        image = switch.grab().toImage()
        half, middle = image.width() // 2, image.height() // 2
        tag, ink = theme().c.tag.rgb(), theme().c.ontag.rgb()
        chosen = [image.pixel(half + half // 2 + dx, middle) for dx in (-3, 3)]
        assert chosen == [ink, tag]
        hidden = [image.pixel(half // 2 + dx, middle) for dx in (-3, 3)]
        assert hidden == [ink, tag]

    def test_painting_from_the_gallery(self, shown: Shown) -> None:
        QTest.mouseClick(shown.view.gallery._paint, Qt.MouseButton.LeftButton)
        assert shown.table.model.painting == ""

    def test_a_damaged_style_shows_its_file(
        self, shown: Shown, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        opened: list[str] = []
        monkeypatch.setattr(
            "PySide6.QtGui.QDesktopServices.openUrl", lambda url: opened.append(url.toLocalFile())
        )
        file = shown.table.folder / "styles" / "broken.toml"
        shown.table.model.update(damaged_styles=(DamagedItem(file, CoreError("It is empty.")),))
        card = shown.view.findChild(DamagedCard)
        assert isinstance(card, DamagedCard)
        assert CANNOT_READ in card.accessibleName()
        QTest.mouseClick(card.button, Qt.MouseButton.LeftButton)
        assert [Path(one) for one in opened] == [file.parent]
        shown.table.model.update(damaged_styles=())
        shown.settle()
        assert not card.isVisible()

    def test_old_numbers_are_dim_while_new_ones_come(self, shown: Shown) -> None:
        key = shown.keys[1]
        before = pixels(shown.card(key))
        shown.table.runner.held = {"solve"}
        shown.table.model.update(front_deg=20.0)
        shown.settle()
        dim = pixels(shown.card(key))
        assert dim.max() < before.max()
        shown.table.runner.release("solve")
        shown.settle()
        assert pixels(shown.card(key)).max() > dim.max()


class TestSizes:
    """Larger and smaller cards, by slider, keys and wheel."""

    def test_fewer_and_larger_cards_by_keys_are_kept_as_a_setting(self, shown: Shown) -> None:
        size = shown.view.gallery.zoom
        size.setFocus(Qt.FocusReason.TabFocusReason)
        for columns, width in ((3, 277), (2, 420)):
            shown.press(KEY.Key_Right)
            cards = [shown.card(key) for key in shown.keys]
            assert {card.width() for card in cards} == {width}
            assert shown.table.model.settings.card_width == width
            assert size.accessibleDescription() == f"{columns} across"
            picture = shown.card(shown.keys[0]).state.here
            assert picture is not None
            assert abs(picture.shape[1] - (width - 8) / 2) <= 1, "made anew, not blown up"
        shown.press(KEY.Key_Home)
        assert shown.card(shown.keys[0]).width() == 206

    def test_a_step_makes_no_portrait_in_the_thread_of_the_window(self, shown: Shown) -> None:
        before = shown.table.presenter.resolve().detail
        shown.table.runner.held = {"styles-pictures"}
        shown.view.gallery.zoom.setFocus(Qt.FocusReason.TabFocusReason)
        shown.press(KEY.Key_Right)
        assert shown.card(shown.keys[0]).width() == 277
        assert shown.table.presenter.resolve().detail.here is before.here
        assert "styles-pictures" in shown.table.runner.waiting, "cards' pictures are a job"

    def test_ctrl_and_the_wheel_over_the_cards(self, shown: Shown) -> None:
        viewport = shown.view.gallery._scroll.viewport()
        for notch, width in ((120, 277), (-120, 206)):
            turn = QWheelEvent(
                QPointF(50, 50),
                viewport.mapToGlobal(QPointF(50, 50)),
                QPoint(),
                QPoint(0, notch),
                Qt.MouseButton.NoButton,
                Qt.KeyboardModifier.ControlModifier,
                Qt.ScrollPhase.NoScrollPhase,
                False,
            )
            QApplication.sendEvent(viewport, turn)
            shown.settle()
            assert shown.card(shown.keys[0]).width() == width
            assert shown.view.gallery._scroll.verticalScrollBar().value() == 0

    def test_a_size_from_before_is_there_at_the_start(self, qtbot: QtBot, tmp_path: Path) -> None:
        table = Table(tmp_path)
        table.model.update(settings=table.model.settings.with_("card_width", 277))
        shown = Shown(qtbot, table.open(scene_light()))
        assert shown.card(shown.keys[0]).width() == 277
        assert shown.pictures_made == 1


class TestSwap:
    """Targets and pictures here change places for as long as a key or a button is held."""

    def test_holding_the_key(self, shown: Shown) -> None:
        shown.view.gallery.focus_card()
        card, focus = shown.card(shown.keys[0]), focused()
        before, detail = card.state, shown.table.presenter.resolve().detail
        QTest.keyPress(focus, KEY.Key_S)
        shown.settle()
        assert card.state.target is before.here
        assert card.state.here is before.target
        held = shown.table.presenter.resolve().detail
        assert held.target is detail.here
        assert (held.target_tag, held.here_tag) == (detail.here_tag, "Target")
        assert shown.view.gallery.hold.isDown()
        QTest.keyRelease(focus, KEY.Key_S)
        shown.settle()
        assert card.state.target is before.target
        assert not shown.view.gallery.hold.isDown()

    def test_holding_the_button_paints_the_other_picture(self, shown: Shown) -> None:
        card, hold = shown.card(shown.keys[0]), shown.view.gallery.hold
        plain = top(card)
        QTest.mousePress(hold, Qt.MouseButton.LeftButton)
        shown.settle()
        assert (top(card)[20:100, 10:90] == plain[20:100, 111:191]).all()
        QTest.mouseRelease(hold, Qt.MouseButton.LeftButton)
        shown.settle()
        assert (top(card) == plain).all()

    def test_leaving_the_window_lets_go(self, shown: Shown) -> None:
        shown.view.gallery.focus_card()
        QTest.keyPress(focused(), KEY.Key_S)
        assert shown.table.presenter.resolve().swapped
        QApplication.sendEvent(shown.view, QEvent(QEvent.Type.WindowDeactivate))
        assert not shown.table.presenter.resolve().swapped


class TestCompare:
    def test_marked_by_ctrl_click_and_space_and_seen_side_by_side(self, shown: Shown) -> None:
        gallery, keys = shown.view.gallery, shown.keys
        assert not gallery.compare.isVisible()
        held = Qt.KeyboardModifier.ControlModifier
        QTest.mouseClick(shown.card(keys[1]), Qt.MouseButton.LeftButton, held)
        shown.settle()
        assert gallery.compare.isVisible()
        assert not gallery.compare.isEnabled()
        assert shown.chosen != keys[1], "marking is not choosing"
        shown.card(keys[0]).setFocus()
        shown.press(KEY.Key_Space)
        assert shown.card(keys[0]).accessibleName().endswith(", marked")
        assert gallery.compare.text() == "Compare 2"
        QTest.mouseClick(gallery.compare, Qt.MouseButton.LeftButton)
        shown.settle()
        sheet = shown.view.sheet
        assert isinstance(sheet, CompareSheet)
        pictures = sheet.findChildren(Picture)
        assert len(pictures) == 4
        assert len({one.size().toTuple() for one in pictures}) == 1
        turns = [shown.card(key).state.turn for key in (keys[1], keys[0])]
        words = [text.text() for text in sheet.findChildren(Text) if "clockwise" in text.text()]
        assert [one.split(" ")[0] for one in words] == turns
        shown.press(KEY.Key_Escape)
        assert shown.view.sheet is None
        assert QApplication.focusWidget() is gallery.compare
        assert gallery.compare.text() == "Compare 2", "the marks stay"
        QTest.mouseClick(gallery._unmark, Qt.MouseButton.LeftButton)
        assert not gallery.compare.isVisible()

    def test_turn_to_one_of_them(self, shown: Shown) -> None:
        keys = shown.keys[:3]
        for key in keys:
            shown.table.presenter.mark(key)
        shown.table.presenter.compare()
        shown.settle()
        sheet = shown.view.sheet
        assert isinstance(sheet, CompareSheet)
        QTest.mouseClick(sheet.findChildren(Button)[-1], Qt.MouseButton.LeftButton)
        assert not sheet.isVisible()
        assert step(shown) is Step.TURN
        assert shown.chosen == keys[-1]

    def test_a_fifth_takes_the_place_of_the_first(self, shown: Shown) -> None:
        keys = shown.keys
        for key in keys[:5]:
            shown.table.presenter.mark(key)
        assert shown.table.presenter.resolve().marked == 4
        assert [key for key in keys if shown.card(key).state.marked] == keys[1:5]
        shown.table.presenter.compare()
        shown.settle()
        assert shown.view.sheet is not None
        sheet, window = shown.view.sheet._panel.geometry(), shown.view.rect()
        assert window.contains(sheet)

    def test_the_key_swaps_there_too(self, shown: Shown) -> None:
        for key in shown.keys[:2]:
            shown.table.presenter.mark(key)
        shown.table.presenter.compare()
        shown.settle()
        sheet = shown.view.sheet
        assert isinstance(sheet, CompareSheet)
        first = sheet.findChildren(Picture)[0]
        before = first._array
        QTest.keyPress(focused(), KEY.Key_S)
        assert first._array is not before
        QTest.keyRelease(focused(), KEY.Key_S)
        assert first._array is before


class TestSameExposure:
    def test_by_button_and_as_said_on_the_picture(self, shown: Shown) -> None:
        button, detail = shown.view.gallery.alike, shown.view.detail
        assert button.accessibleName() == "Same exposure"
        assert not button.isChecked()
        plain = shown.table.model.settings.with_("hair", "plain").with_("behind", "grey")
        shown.table.model.update(settings=plain)
        state = shown.table.presenter.resolve().detail
        assert detail.here._tags.get("tr", "") == state.here_exposed != ""
        assert detail.here.accessibleDescription() == state.exposed_tip
        assert not detail.target._tags.get("tr", "")
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        shown.settle()
        assert button.isChecked()
        assert shown.table.model.settings.same_exposure
        assert "selected style" in detail.here.toolTip()
        keys = [action for action in shown.table.presenter.actions() if action.shortcut == "E"]
        keys[0].run()
        shown.settle()
        assert not button.isChecked()

    def test_compared_styles_say_theirs(self, shown: Shown) -> None:
        for key in shown.keys[:2]:
            shown.table.presenter.mark(key)
        shown.table.presenter.compare()
        shown.settle()
        assert shown.view.sheet is not None
        tags = [one._tags.get("tr", "") for one in shown.view.sheet.findChildren(Picture)]
        assert [bool(tag) for tag in tags] == [False, True, False, True]


class TestTerms:
    """What a number means is one click away."""

    @pytest.mark.parametrize("compact", [False, True])
    def test_each_number_says_what_it_means(
        self, qtbot: QtBot, tmp_path: Path, compact: bool
    ) -> None:
        shown = Shown(qtbot, Table(tmp_path).open(scene_light()), compact)
        terms = [term for term in shown.view.findChildren(Term) if term.isVisible()]
        assert {"turn", "clock", "good_from", "match", "contrast", "ratio", "card"} <= {
            term.key for term in terms
        }
        for term in terms:
            assert term.accessibleName() == f"{term.text()}: what does it mean?"
            assert term.width() >= term.sizeHint().width(), f"{term.text()} is cut off"

    def test_by_keys_and_back(self, shown: Shown) -> None:
        term = next(one for one in shown.view.findChildren(Term) if one.key == "contrast")
        term.setFocus(Qt.FocusReason.TabFocusReason)
        shown.press(KEY.Key_Return)
        (sheet,) = Sheet.over(shown.view.window())
        words = [text.text() for text in sheet.findChildren(Text)]
        assert words == list(EXPLANATIONS["contrast"])
        shown.press(KEY.Key_Escape)
        assert not Sheet.over(shown.view.window())
        assert QApplication.focusWidget() is term

    def test_a_style_out_of_reach_says_what_the_grade_is(self, shown: Shown) -> None:
        shown.table.presenter.choose("badger")
        term = next(t for t in shown.view.findChildren(Term) if t.text() == "Not here")
        QTest.mouseClick(term, Qt.MouseButton.LeftButton)
        (sheet,) = Sheet.over(shown.view.window())
        assert sheet.accessibleName() == "Grade"
        sheet.shut()


class TestWhy:
    """Match, ratio, contrast and curves are one click away, and stay where they are."""

    @pytest.mark.parametrize("compact", [False, True])
    def test_numbers_come_with_a_click_and_stay(
        self, qtbot: QtBot, tmp_path: Path, compact: bool
    ) -> None:
        table = Table(tmp_path).open(scene_light())
        shown = Shown(qtbot, table, compact, numbers=False)
        shown.table.presenter.choose("left-loop")
        shown.settle()
        detail = shown.view.detail
        hidden = (detail.plot, detail.facts, detail.weights)
        assert not any(widget.isVisible() for widget in hidden)
        assert detail.background.isVisible()
        assert detail.words._turn.isVisible()
        texts = [text.text() for text in detail.findChildren(Text) if text.isVisible()]
        assert not [text for text in texts if "match" in text.lower()]
        QTest.mouseClick(detail.more_words, Qt.MouseButton.LeftButton)
        shown.settle()
        assert detail.plot.isVisible()
        assert detail.facts.isVisible()
        assert table.model.settings.show_numbers
        actions = {action.key: action for action in table.presenter.actions()}
        actions["why"].run()
        shown.settle()
        assert not any(widget.isVisible() for widget in hidden)
        assert not detail.more_words.isChecked()

    def test_the_background_fills_the_width_when_it_is_alone(
        self, qtbot: QtBot, tmp_path: Path
    ) -> None:
        shown = Shown(qtbot, Table(tmp_path).open(scene_light()), numbers=False)
        qtbot.waitUntil(lambda: shown.table.presenter._pictures.sizes.background == (184, 408))
        picture = shown.table.presenter.resolve().detail.background
        assert picture is not None
        assert picture.shape == (184, 408, 3)
        assert shown.view.detail.background.width() == 408

    def test_what_is_missing_is_said_without_the_numbers(
        self, qtbot: QtBot, tmp_path: Path
    ) -> None:
        shown = Shown(qtbot, Table(tmp_path).open(scene_light()), numbers=False)
        for key in ("badger", "left-loop"):
            shown.table.presenter.choose(key)
            shown.settle()
            words = shown.view.detail.words
            reason = shown.table.presenter.resolve().detail.reason
            assert reason
            assert words._reason.isVisible()
            assert words._reason.text() == reason
        assert words._direction.text() == "clockwise"


class TestDetail:
    def test_dragging_the_needle(self, shown: Shown) -> None:
        plot = shown.view.detail.plot
        dial = plot.dial
        QTest.mousePress(plot, Qt.MouseButton.LeftButton, pos=spot(dial, -90.0))
        QTest.mouseMove(plot, spot(dial, 120.0))
        shown.settle()
        assert needle(shown) == pytest.approx(120.0, abs=1.0)
        tag = shown.table.presenter.resolve().detail.here_tag
        assert tag in ("Here, at 119°", "Here, at 120°", "Here, at 121°")
        QTest.mouseRelease(plot, Qt.MouseButton.LeftButton, pos=spot(dial, 45.0))
        shown.settle()
        assert shown.view.detail.weights.needle == pytest.approx(needle(shown))
        assert shown.view.detail._back.isVisible()

    def test_events_that_come_too_fast_are_left_out(self, shown: Shown) -> None:
        seen: list[float] = []
        shown.view.detail.looked.connect(seen.append)
        for turn in range(100):
            shown.view.detail.plot.turn_to(float(turn))
        shown.settle()
        assert seen == [99.0]
        assert needle(shown) == 99.0

    def test_letting_go_is_not_waited_for(self, shown: Shown) -> None:
        plot = shown.view.detail.plot
        plot.begin_drag(70.0)
        plot.end_drag()
        assert needle(shown) == 70.0

    def test_keys_on_the_plot(self, shown: Shown) -> None:
        plot = shown.view.detail.plot
        plot.setFocus()
        best = shown.table.presenter.resolve().detail.best
        assert best is not None
        shown.press(KEY.Key_Right)
        assert needle(shown) == round(best) + 1
        shown.press(KEY.Key_Left, Qt.KeyboardModifier.ShiftModifier)
        assert needle(shown) == round(best) - 9
        shown.press(KEY.Key_Home)
        assert needle(shown) is None
        assert not shown.view.detail._back.isVisible()

    def test_a_peak_takes_a_click(self, shown: Shown) -> None:
        result = next(one for one in shown.table.model.results if len(one.peaks) > 1)
        shown.table.presenter.choose(result.name)
        shown.settle()
        plot = shown.view.detail.plot
        place = plot.peak_places()[0]
        QTest.mouseClick(
            plot, Qt.MouseButton.LeftButton, pos=QPoint(round(place[0]), round(place[1]))
        )
        shown.settle()
        assert needle(shown) == pytest.approx(result.peaks[1].turn_refined_deg)
        QTest.mouseClick(shown.view.detail._back, Qt.MouseButton.LeftButton)
        assert needle(shown) is None

    def test_the_main_button(self, shown: Shown) -> None:
        detail = shown.view.detail
        assert detail.main.text() == "Turn to this"
        shown.table.presenter.choose("badger")
        assert detail.main.text() == "Try a lamp"
        QTest.mouseClick(detail.main, Qt.MouseButton.LeftButton)
        assert shown.table.model.step is Step.LIGHT

    def test_paint_button(self, shown: Shown) -> None:
        QTest.mouseClick(shown.view.detail.paint, Qt.MouseButton.LeftButton)
        assert shown.table.model.painting == shown.chosen

    def test_the_same_number_on_card_and_in_the_detail(self, shown: Shown) -> None:
        detail = shown.view.detail
        for key in shown.keys:
            shown.table.presenter.choose(key)
            card = shown.card(key).state
            if card.in_reach:
                assert detail.words._turn.text() == card.turn

    def test_nothing_below_moves_with_the_needle(self, shown: Shown) -> None:
        detail = shown.view.detail
        for key in ("left-loop", "left-rembrandt", "badger"):
            shown.table.presenter.choose(key)
            shown.settle()
            before = detail.weights.y()
            for turn in (None, 10.0, -150.0):
                if turn is not None:
                    shown.table.presenter.look_at(turn)
                shown.settle()
                assert detail.weights.y() == before
                inner = detail.facts.mapTo(detail, QPoint(0, detail.facts.height()))
                assert inner.y() <= detail.weights.y()

    def test_more(self, shown: Shown) -> None:
        QTest.mouseClick(shown.view.detail.more, Qt.MouseButton.LeftButton)
        menu = shown.view.detail.findChild(Menu)
        assert isinstance(menu, Menu)
        words = [action.text().split("\t")[0] for action in menu.actions()]
        first, last = ["Save set sheet…", "Copy numbers"], LIKE_PHOTO
        assert words == [*first, "Import style…", last]
        menu.actions()[1].trigger()
        assert "Match " in QGuiApplication.clipboard().text()
        menu.close()

    def test_saving_a_sheet_by_hand(
        self, shown: Shown, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
    ) -> None:
        file = tmp_path / "sheet.png"
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args, **kwargs: (str(file), ""))
        shown.table.presenter.files.ask_sheet()
        assert file.is_file()
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args, **kwargs: ("", ""))
        shown.table.presenter.files.ask_sheet()

    def test_a_name_is_typed_in_place(self, shown: Shown) -> None:
        title = shown.view.detail._title
        asked: list[str] = []
        shown.view.detail.renamed.connect(asked.append)
        shown.view.ask_name("Mine")
        assert title._field.isVisible()
        assert not title._text.isVisible()
        QTest.keyClicks(title._field.edit, "Window")
        QTest.keyClick(title._field.edit, KEY.Key_Return)
        assert asked == ["Window"]
        shown.view.ask_name("Mine")
        shown.view.show_trouble("There is already a style of that name.")
        assert title._field.isVisible()
        QTest.keyClick(title._field.edit, KEY.Key_Escape)
        assert not title._field.isVisible()


class TestLamps:
    """The photographer's own lamps, by mouse and by keys."""

    @pytest.fixture(params=[False, True], ids=["full", "compact"])
    def shown(self, request: pytest.FixtureRequest, qtbot: QtBot, tmp_path: Path) -> Shown:
        table = Table(tmp_path)
        table.model.update(place=Place("Café", table.services.today()))
        return Shown(qtbot, table.open(scene_light("interior")), compact=request.param)

    def opened(self, shown: Shown) -> LampsSheet:
        QTest.mouseClick(shown.view.gallery.lamps, Qt.MouseButton.LeftButton)
        shown.settle()
        sheet = shown.view.sheet
        assert isinstance(sheet, LampsSheet)
        return sheet

    def studio(self, shown: Shown, name: str) -> Studio:
        assert shown.table.model.head is not None
        return shown.table.model.head.pack.studio(name)

    def test_clicks_choose_a_ratio_and_the_pictures_follow(self, shown: Shown) -> None:
        shown.table.presenter.choose("left-loop")
        button = shown.view.gallery.lamps
        assert button.accessibleName() == "Lamps: standard"
        before = shown.card("left-loop").state.target
        sheet = self.opened(shown)
        detail = shown.view.detail
        place = QRect(sheet._panel.mapTo(shown.view, QPoint(0, 0)), sheet._panel.size())
        assert not place.intersects(detail.geometry()), "target and picture here stay in sight"
        assert shown.view.rect().contains(place)
        QTest.mouseClick(sheet._ratio.part("4:1"), Qt.MouseButton.LeftButton)
        shown.settle()
        assert self.studio(shown, "left-loop") == Studio(None, 4.0)
        assert button.accessibleName() == "Lamps: 4:1"
        assert before is not None
        assert (before != shown.card("left-loop").state.target).any()
        QTest.mouseClick(sheet._own, Qt.MouseButton.LeftButton)
        QTest.mouseClick(sheet._ratio.part("8:1"), Qt.MouseButton.LeftButton)
        shown.settle()
        assert self.studio(shown, "right-loop") == Studio(None, 8.0)
        assert self.studio(shown, "left-split") == Studio(None, 4.0)
        QTest.mouseClick(sheet, Qt.MouseButton.LeftButton, pos=QPoint(2, 2))
        shown.settle()
        assert shown.view.sheet is None

    def test_all_of_it_by_keys(self, shown: Shown) -> None:
        shown.table.presenter.choose("left-loop")
        shown.view.gallery.lamps.setFocus(Qt.FocusReason.TabFocusReason)
        shown.press(KEY.Key_Return)
        sheet = shown.view.sheet
        assert isinstance(sheet, LampsSheet)
        names = [stop.accessibleName() for stop in sheet._stops()]
        size = "Lamp size: Standard studio lamps"
        assert names == [size, "Unchanged", "This style only", "Close"]
        for _ in range(2):
            shown.press(KEY.Key_Down)
        assert self.studio(shown, "left-loop") == Studio(30.0, None)
        shown.press(KEY.Key_Tab)
        shown.press(KEY.Key_Right)
        assert self.studio(shown, "left-loop") == Studio(30.0, 2.0)
        shown.press(KEY.Key_Tab)
        shown.press(KEY.Key_Space)
        assert shown.table.presenter.lamps.resolve().only
        shown.press(KEY.Key_Escape)
        assert shown.view.sheet is None
        assert QApplication.focusWidget() is shown.view.gallery.lamps
        assert shown.view.gallery.lamps.accessibleName() == "Lamps: 30°, 2:1"

    def test_lamps_of_a_size_of_its_own_are_shown_and_stay(self, shown: Shown) -> None:
        shown.table.desk.choose_lamps(Studio(25.0, 3.5))
        sheet = self.opened(shown)
        assert sheet._size.box.accessibleName() == "Lamp size: 25°"
        sheet._ratio.chosen.emit("3:1")
        assert self.studio(shown, "left-loop") == Studio(25.0, 3.0)

    def test_a_style_with_its_own_lamps_says_so_under_its_picture(self, shown: Shown) -> None:
        shown.table.desk.choose_lamps(Studio(None, 2.0))
        detail = shown.view.detail
        shown.table.presenter.choose("left-loop-rim")
        shown.settle()
        assert detail._note.isVisible()
        assert detail._note.text() == own_lamps_words(Studio(None, 2.0))
        shown.table.presenter.choose("left-loop")
        shown.settle()
        assert detail._note.text() != own_lamps_words(Studio(None, 2.0))

    def test_without_a_place_it_says_why_not(self, qtbot: QtBot, tmp_path: Path) -> None:
        button = Shown(qtbot, Table(tmp_path).open()).view.gallery.lamps
        assert not button.isEnabled()
        assert button.toolTip() == NEEDS_LIGHT


class TestLayouts:
    def test_no_light(self, qtbot: QtBot, tmp_path: Path) -> None:
        shown = Shown(qtbot, Table(tmp_path).open())
        detail = shown.view.detail
        assert detail.words._direction.text() == NO_LIGHT
        assert detail.words._reason.text() == NO_TURNS
        assert detail.words._reason.isVisible()
        assert not detail.words._turn.isVisible()
        QTest.mouseClick(detail.main, Qt.MouseButton.LeftButton)
        assert shown.table.model.step is Step.PROBE

    def test_small_windows_scroll_and_keep_the_choice_in_view(self, small: Shown) -> None:
        cards = [small.card(key) for key in small.keys]
        assert {card.width() for card in cards} == {186}
        assert small.view.detail.width() == 344
        scroll = small.view.gallery._scroll
        for key in (small.keys[-1], small.keys[0], small.keys[9]):
            small.table.presenter.choose(key)
            small.settle()
            top = small.card(key).mapTo(scroll.viewport(), QPoint(0, 0)).y()
            assert top >= 0
            assert top + small.card(key).height() <= scroll.viewport().height()

    def test_small_windows_have_the_background_on_a_tab(self, small: Shown) -> None:
        detail = small.view.detail
        assert detail.plot.isVisible()
        assert not detail.background.isVisible()
        detail._pages.setCurrentIndex(2)
        small.settle()
        assert detail.background.isVisible()
        picture = small.table.presenter.resolve().detail.background
        assert picture is not None
        assert picture.shape[:2] == (176, 296)

    @pytest.mark.parametrize(
        ("size", "compact", "columns", "card"),
        [
            ((1352, 804), False, 4, (206, 176)),
            ((952, 620), True, 3, (186, 163)),
            ((1832, 984), False, 5, (238, None)),
        ],
    )
    def test_columns(
        self,
        size: tuple[int, int],
        compact: bool,
        columns: int,
        card: tuple[int, int | None],
    ) -> None:
        detail = detail_width(*size, compact)
        layout = layout_for(size[0] - detail, compact)
        assert layout.columns == columns
        assert layout.card.width() == card[0]
        assert card[1] in (None, layout.card.height())
        assert detail <= 560

    def test_every_control_has_a_name_and_nothing_sticks_out(self, shown: Shown) -> None:
        for widget in shown.view.findChildren(QWidget):
            if not widget.isVisible() or widget.focusPolicy() == Qt.FocusPolicy.NoFocus:
                continue
            assert widget.accessibleName(), widget
            parent = widget.parentWidget()
            assert parent is not None
            assert parent.rect().contains(widget.geometry()), widget.accessibleName()

    def test_a_view_made_anew_shows_the_same(self, shown: Shown) -> None:
        shown.table.presenter.choose("left-loop")
        shown.table.presenter.look_at(12.0)
        shown.table.presenter.set_filter("mine")
        shown.table.presenter.detach()
        other = Shown(shown.bot, shown.table)
        assert other.view.detail.plot.needle == 12.0
        assert other.view.gallery._filter.key == "mine"
        assert other.pictures_made == 0


@pytest.mark.slow
@pytest.mark.alone
def test_a_drag_event_costs_a_few_bare_pictures(shown: Shown) -> None:
    """Picture, exposure, framing, background, weights, plot and all painting, as a ratio.

    The bare picture is the portrait at full size that is shown.
    """
    turns = iter(np.linspace(-170.0, 170.0, 80))
    shown.table.presenter.choose("left-rembrandt")

    def drag() -> None:
        shown.view.detail.plot.turn_to(float(next(turns)))
        shown.settle()

    whole = head().full
    assert whole is not None
    shape, skin = whole

    def bare() -> None:
        portrait_picture(shape, skin, light, 33.0)

    light = portrait_light(scene_light().environment.radiance)
    # In turn, so that what else the machine does meets both.
    rounds = [(quickest(drag, 2), quickest(bare, 2)) for _ in range(20)]
    moved, plain = (min(times) for times in zip(*rounds, strict=True))
    assert moved < 4.0 * plain


def quickest(work: Callable[[], None], times: int) -> float:
    best = float("inf")
    for _ in range(times):
        start = time.thread_time()
        work()
        best = min(best, time.thread_time() - start)
    return best


def focused() -> QWidget:
    widget = QApplication.focusWidget()
    assert widget is not None
    return widget


def tabbed(widget: QWidget) -> bool:
    wanted = Qt.FocusPolicy.TabFocus
    return widget.isVisible() and widget.focusPolicy() & wanted == wanted


def spot(dial: object, turn: float) -> QPoint:
    x, y = at_turn(dial.centre, dial.rim * 0.9, turn)  # type: ignore[attr-defined]
    return QPoint(round(x), round(y))


def top(widget: QWidget) -> np.ndarray:
    """Pixels of the part with the pictures, (h, w, 3)."""
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(bytes(image.constBits()), np.uint8).reshape(image.height(), -1)
    return rows[3:129, 9 : 3 * image.width() - 9].reshape(126, -1, 3).copy()


def pixels(widget: QWidget) -> np.ndarray:
    image = widget.grab().toImage().convertToFormat(widget.grab().toImage().Format.Format_RGB888)
    rows = np.frombuffer(bytes(image.constBits()), np.uint8).reshape(image.height(), -1)
    inner: np.ndarray = rows[80:, : 3 * image.width()]
    return inner


class TestAsInThePaper:
    def test_four_pictures_of_one_size_and_words_that_agree(self, shown: Shown) -> None:
        model, detail = shown.table.model, shown.view.detail
        shown.table.presenter.choose("left-loop")
        shown.settle()
        whole = detail.target.size()
        assert not any(picture.isVisible() for picture in detail.marks)
        for objective in ("picture", "paper", "picture"):
            model.update(settings=model.settings.with_("paper_mode", objective == "paper"))
            shown.table.presenter.choose("left-loop")
            shown.settle()
            state = shown.table.presenter.resolve().detail
            words = detail.plot.accessibleDescription()
            assert f", {state.numbers}. " in words
            paper = objective == "paper"
            name = shown.card("left-loop").accessibleName()
            assert (f", {state.numbers}, " in name) == paper
            assert [picture.isVisible() for picture in detail.marks] == [paper, paper]
            row = (detail.target, detail.here, *detail.marks)[: 4 if paper else 2]
            assert len({picture.size().toTuple() for picture in row}) == 1
            assert (row[0].width() == 96) == paper
            inside = [picture.mapTo(detail, picture.rect().topRight()).x() for picture in row]
            assert inside == sorted(inside)
            assert inside[-1] <= detail.width() - 24
            assert ("Minimum at" in words) == paper
        assert detail.target.size() == whole

    def test_the_foot_tells_where_the_rules_disagree(self, shown: Shown) -> None:
        how, model = shown.view.gallery._how, shown.table.model
        model.update(settings=model.settings.with_("paper_mode", True))
        shown.settle()
        assert how.text() == shown.table.presenter.resolve().rules != ""
