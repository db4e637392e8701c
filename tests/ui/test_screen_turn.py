"""The Turn screen's view: by mouse and keyboard, in all sizes and themes, for those who listen."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QFileDialog, QSlider, QWidget
from pytestqt.qtbot import QtBot
from shiboken6 import isValid

from app.core.base.angles import whole, wrap
from app.core.base.paths import resources
from app.core.guidance.guide import Phase
from app.core.guidance.who_moves import Mode
from app.core.localization.heading import UNSURE
from app.core.localization.photo_location import PhotoLocation
from app.devices.webcam import SimulatedWebcam
from app.ui.presenters.window_model import Step
from app.ui.screens.turn.guidance import TAKE
from app.ui.screens.turn.live.live_view import LOOKS_WORDS
from app.ui.screens.turn.live.question_view import NAMES, CameraQuestion
from app.ui.screens.turn.live_column_view import DEMO_CAMERA
from app.ui.screens.turn.photos import check_job as photo_check
from app.ui.screens.turn.photos.photos import ShotRow, ShotsState
from app.ui.screens.turn.photos.photos_view import ShotsSheet
from app.ui.screens.turn.screen_view import TurnScreen
from app.ui.theme import set_theme, theme
from app.ui.theme.theme import ThemeName
from app.ui.widgets.buttons import IconButton
from app.ui.widgets.choices import SegmentedChoice
from app.ui.widgets.labels import Text
from app.ui.widgets.surfaces import Menu
from app.words.guidance import IN_LIGHT, TROUBLE, trouble_line
from app.words.phrases.turns import taken_words, turn_words, walking_words
from tests.helpers.photos import write_photo
from tests.helpers.turn_rig import Rig, frame_of

FULL, COMPACT = (1352, 804), (952, 620)


class Shown:
    """A screen on its presenter, ticking only when a test says so."""

    def __init__(self, rig: Rig, qtbot: QtBot, size: tuple[int, int] = FULL) -> None:
        self.rig = rig
        self.screen = TurnScreen(rig.presenter, size[0] < FULL[0])
        qtbot.addWidget(self.screen)
        self.screen.resize(*size)
        rig.presenter.attach(self.screen)
        self.screen.show()
        self.screen._clock.stop()
        rig.presenter.enter()

    def turn_to(self, turn_deg: float) -> None:
        """Turn the sitter; the view is a real one here, so nothing is read off a mock."""
        self.rig.webcam.send(frame_of(wrap(turn_deg + 180.0), (360, 640)))
        self.tick(3)

    def tick(self, times: int = 1, seconds: float = 0.04) -> None:
        for _ in range(times):
            self.rig.clock.sleep(seconds)
            self.rig.presenter.tick()

    def image(self) -> QImage:
        return self.screen.grab().toImage()


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch, qtbot: QtBot) -> Iterator[Callable[..., Shown]]:
    made: list[Shown] = []

    def make_one(size: tuple[int, int] = FULL, demo: bool = False, **settings: object) -> Shown:
        rig = Rig(monkeypatch, **settings)  # type: ignore[arg-type]
        if demo:
            rig.devices.simulated = SimulatedWebcam(resources() / "demo" / "location" / "views")
        made.append(Shown(rig, qtbot, size))
        return made[-1]

    yield make_one
    for one in made:
        one.rig.presenter.leave()
        one.rig.presenter.detach()


def click(widget: QWidget, button: Qt.MouseButton) -> None:
    QTest.mouseClick(widget, button)


def press(
    widget: QWidget,
    key: Qt.Key,
    modifiers: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
) -> None:
    QTest.keyClick(widget, key, modifiers)


def words_on(shown: Shown) -> dict[str, str]:
    column = shown.screen.column
    return {
        "direction": column._direction.words,
        "walk": column._walk.words,
        "pill": column._pill.words,
        "number": column._degrees.accessibleName(),
        "arrow": column._arrow.sign,
    }


def test_what_the_presenter_says_is_on_the_screen(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(shown.rig.goal - 40.0)
    said = words_on(shown)
    assert said["direction"] == "clockwise"
    assert said["walk"] == walking_words("clockwise", Mode.WALK)[0]
    assert said["number"] == "40° to go"
    assert said["arrow"] == "clockwise"
    assert said["pill"] == IN_LIGHT.before
    shown.turn_to(shown.rig.goal - 4.0)
    assert words_on(shown)["number"] == "4° to the best"
    assert shown.screen.column._pill.filled


def test_segmented_by_mouse_and_by_keyboard(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(shown.rig.goal - 40.0)
    mode = shown.screen.column.findChild(SegmentedChoice)
    assert mode is not None
    click(mode.part("selfie"), Qt.MouseButton.LeftButton)
    assert shown.rig.model.settings.mode == "selfie"
    assert words_on(shown)["walk"] == walking_words("clockwise", Mode.SELFIE)[0]
    press(mode, Qt.Key.Key_Left)
    assert shown.rig.model.settings.mode == "walk"


def test_the_question_is_answered_by_mouse(make: Callable[..., Shown]) -> None:
    shown = make(camera_looks="ask")
    assert shown.screen.findChildren(CameraQuestion) == []
    shown.turn_to(0.0)
    question = shown.screen.left.question
    assert question is not None
    assert shown.screen.left.wells.live.geometry().contains(question.geometry().center())
    click(question.answers["me"], Qt.MouseButton.LeftButton)
    assert shown.rig.model.settings.camera_looks == "me"
    assert question.isHidden()


def test_the_question_is_answered_by_keyboard(make: Callable[..., Shown]) -> None:
    shown = make(COMPACT, camera_looks="ask")
    shown.turn_to(0.0)
    question = shown.screen.left.question
    assert question is not None
    names = [answer.accessibleName() for answer in question.answers.values()]
    assert names == [NAMES[looks][1] for looks in ("sitter", "me")]
    chain = focus_chain(shown.screen)
    assert chain.index(question.answers["sitter"]) < chain.index(shown.screen.left.strip)
    press(question.answers["sitter"], Qt.Key.Key_Return)
    assert shown.rig.model.settings.camera_looks == "sitter"


def test_lost_says_what_to_do_and_left_behind_too(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(20.0)
    shown.rig.webcam.send(frame_of(999.0, (360, 640)))
    shown.tick(40)
    column = shown.screen.column
    assert column._pages.currentIndex() == 1
    assert column._sentence.text() == TROUBLE[Phase.LOST]
    assert turn_words(shown.rig.goal) in column._advice.text()
    tracker = shown.rig.presenter._tracker
    assert tracker.track is not None
    bare = replace(tracker.track, raw=replace(UNSURE, few_details=True))
    tracker.track = bare
    shown.tick()
    assert column._sentence.text() == TROUBLE[Phase.FEW_DETAILS]
    assert turn_words(shown.rig.goal) in column._advice.text()
    assert shown.screen.left.tools.quality.text() == trouble_line(Phase.FEW_DETAILS)
    shown.turn_to(20.0)
    track = shown.rig.presenter._tracker.track
    assert track is not None
    shown.rig.presenter._tracker.track = replace(track, left_behind=True)
    shown.tick()
    assert column._sentence.text() == TROUBLE[Phase.LEFT]
    assert shown.screen.left.tools.quality.text() == trouble_line(Phase.LEFT)


def test_the_frame_is_what_the_camera_sees_and_the_number_the_sitters(
    make: Callable[..., Shown],
) -> None:
    shown = make()
    turn = shown.rig.goal - 20.0
    for _ in range(3):
        shown.rig.webcam.send(frame_of(wrap(turn + 180.0 - 10.0), (360, 640), 10.0))
        shown.tick(2, 0.5)
    state = shown.screen.left.strip._state
    assert state is not None
    assert state.now_deg == pytest.approx(turn, abs=0.6)
    assert state.frame_deg == pytest.approx(turn - 10.0, abs=0.8)
    assert shown.screen.left.tools.quality.text() == "Heading likely"
    track = shown.rig.presenter._tracker.track
    assert track is not None
    shown.rig.presenter._tracker.track = replace(
        track, memory=replace(track.memory, confirmed_s=0.0)
    )
    shown.tick()
    assert shown.screen.left.tools.quality.text() == "Heading certain"


@pytest.mark.parametrize("size", [FULL, COMPACT])
def test_the_photo_is_asked_for_and_told_of(
    make: Callable[..., Shown],
    size: tuple[int, int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = make(size)
    place = tmp_path / "place"
    place.mkdir()
    shown.rig.model.update(place_folder=place)
    shown.turn_to(20.0)
    line = shown.screen.left.shots
    assert line.opener.accessibleName() == "Check my shot"
    assert "drop" in line.words
    assert not line.lister.isVisible()
    turn = whole(shown.rig.goal) - 3
    taken = PhotoLocation("found", wrap(turn + 180.0), float(turn), 0.0, 60.0, 0.9)
    monkeypatch.setattr(photo_check, "locate_photo", lambda *_: taken)
    photo = write_photo(tmp_path / "IMG_7.jpg", np.full((300, 400, 3), 90, np.uint8))
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *_: ([str(photo)], ""))
    click(line.opener, Qt.MouseButton.LeftButton)
    assert line.words == f"{taken_words(turn, turn + 3, 0)}."
    # All of it can be read: two lines at most, in the room that there is.
    assert len(line._words._broken(line._words.width())) <= 2
    assert line.lister.isVisible()
    press(line.lister, Qt.Key.Key_Space)
    sheet = shown.screen.window().findChild(ShotsSheet)
    assert sheet is not None
    assert sheet.isVisible()
    remove = next(
        one for one in sheet.findChildren(IconButton) if one.accessibleName() == "Remove IMG_7.jpg"
    )
    press(remove, Qt.Key.Key_Space)
    assert "drop" in line.words
    shown.rig.services.undo.undo()
    assert line.words.startswith("In the light")
    press(sheet, Qt.Key.Key_Escape)
    assert not sheet.isVisible()


def test_alignment_by_mouse_and_opacity_by_keyboard(make: Callable[..., Shown]) -> None:
    shown = make()
    align, overlay = shown.screen.left.tools.align, shown.screen.left.tools.opacity
    assert not align.isEnabled()
    assert align.toolTip() != ""
    shown.turn_to(shown.rig.goal - 10.0)
    click(align, Qt.MouseButton.LeftButton)
    shown.tick(2)
    assert align.text() == "Stop alignment"
    before = shown.screen.left.wells.live.picture
    press(overlay, Qt.Key.Key_Home)
    shown.tick(2)
    goal, live = shown.screen.left.wells.goal.picture, shown.screen.left.wells.live.picture
    assert before is not None
    assert goal is not None
    assert live is not None
    assert np.abs(live.astype(int) - goal).max() <= 1, "at 0 % only the goal is seen"
    assert np.abs(before.astype(int) - goal).max() > 10


def test_arrows_move_the_demo_camera_from_anywhere_free(make: Callable[..., Shown]) -> None:
    shown = make(demo=True)
    simulated = shown.rig.devices.simulated
    shown.screen.setFocus()
    press(shown.screen, Qt.Key.Key_Right)
    press(shown.screen, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    assert simulated.turn_deg == 11.0
    press(shown.screen.left.strip, Qt.Key.Key_Left)
    assert simulated.turn_deg == 10.0
    demo = shown.screen.left.demo
    assert demo is not None
    assert demo.accessibleName() == DEMO_CAMERA
    assert demo.accessibleDescription() == "clockwise"
    press(demo, Qt.Key.Key_Left)
    assert simulated.turn_deg == 9.0


def test_a_real_webcam_has_no_demo_slider(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(0.0)
    assert shown.screen.left.demo is None
    press(shown.screen, Qt.Key.Key_Right)


def test_unplugged_is_dim_with_its_sentence(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(10.0)
    picture = shown.screen.left.wells.live.picture
    shown.rig.webcam.unplug()
    shown.tick()
    assert shown.screen.left.wells.live.dim
    assert shown.screen.left.wells.live.picture is picture
    assert shown.screen.left.wells.live.message.startswith("Webcam disconnected.")
    assert shown.screen.column._sentence.text().startswith("Webcam disconnected.")
    shown.turn_to(10.0)
    assert not shown.screen.left.wells.live.dim


def test_empty_has_the_button_that_fills_it(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.rig.model.update(light=None)
    buttons = [b for b in shown.screen.findChildren(QAbstractButton) if b.isVisible()]
    assert [b.text() for b in buttons] == ["Go to Probe"]
    click(buttons[0], Qt.MouseButton.LeftButton)
    assert shown.rig.model.step is Step.PROBE


def test_the_clock_runs_only_while_it_can_be_seen(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.screen.hide()
    assert not shown.screen._clock.isActive()
    shown.screen.show()
    assert shown.screen._clock.isActive()
    shown.screen._clock.stop()


def test_webcams_can_be_chosen_from_a_menu(make: Callable[..., Shown]) -> None:
    shown = make(webcams=2)
    shown.turn_to(0.0)
    click(shown.screen.left.wells.more, Qt.MouseButton.LeftButton)
    menu = shown.screen.left.findChild(Menu)
    assert menu is not None
    actions = {action.text(): action for action in menu.actions()}
    assert {"Webcam 1", "Webcam 2", *(words for _, words in LOOKS_WORDS)} <= set(actions)
    actions["Webcam 2"].trigger()
    menu.close()
    assert shown.rig.model.settings.webcam == 1


# -- size, theme, names ------------------------------------------------------------------------


def focus_chain(screen: QWidget) -> list[QWidget]:
    chain: list[QWidget] = []
    here = screen.nextInFocusChain()
    while here is not None and here is not screen and len(chain) < 300:
        if here.focusPolicy() & Qt.FocusPolicy.TabFocus and here.isVisible():
            chain.append(here)
        here = here.nextInFocusChain()
    return chain


@pytest.mark.parametrize("size", [FULL, COMPACT, (2560, 1400)])
def test_everything_with_the_focus_has_a_name(
    make: Callable[..., Shown], size: tuple[int, int]
) -> None:
    shown = make(size, demo=True)
    shown.turn_to(0.0)
    chain = focus_chain(shown.screen)
    assert sum(isinstance(one, (QAbstractButton, QSlider)) for one in chain) >= 5
    assert [one for one in chain if not one.accessibleName()] == []


def test_the_guide_is_one_sentence_for_those_who_listen(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(shown.rig.goal - 40.0)
    pages = shown.screen.column._pages
    assert pages.accessibleName() == "What to do"
    assert pages.accessibleDescription().startswith("40° to go, clockwise. Walk to your left.")
    assert "goal" in shown.screen.left.strip.accessibleDescription()


def test_as_designed_at_the_full_size(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.rig.webcam.send(np.full((400, 600, 3), 90, np.uint8))
    shown.tick(2)
    left = shown.screen.left
    assert (left.wells.live.width(), left.wells.live.height()) == (404, 269)
    assert left.wells.goal.x() - left.wells.live.x() == 420
    # The strip with the walk from above beside it, as wide as the pictures together.
    assert (left.strip_size.width(), left.strip_size.height()) == (534, 220)
    plan = left.plan.geometry()
    assert (plan.width(), plan.left() - left.strip.geometry().right()) == (274, 17)
    assert shown.screen._right.width() == 480
    shown.turn_to(shown.rig.goal - 23.0)
    assert shown.screen.column._degrees.figure_font().pixelSize() == 224


def test_wells_keep_the_whole_width_of_a_wider_camera(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(0.0)
    assert (shown.screen.left.wells.live.width(), shown.screen.left.wells.live.height()) == (
        404,
        227,
    )
    picture = shown.screen.left.wells.live.picture
    assert picture is not None
    assert picture.shape == (227, 404, 3)


def apart(left: QWidget, room: int, parts: list[QWidget]) -> None:
    """All are seen, in their column, and none lies over another."""
    assert [part for part in parts if not part.isVisible()] == []
    areas = [QRect(part.mapTo(left, QPoint(0, 0)), part.size()) for part in parts]
    for one in areas:
        assert one.left() >= 0
        assert one.right() < room
    for first in range(len(areas)):
        for second in range(first):
            assert not areas[first].intersects(areas[second])


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("size", [FULL, COMPACT, (1832, 984), (3752, 2064)])
def test_nothing_overlaps_or_leaves_its_column(
    make: Callable[..., Shown], size: tuple[int, int], scale: float
) -> None:
    set_theme("dark", scale)
    if scale > 1.0 and size == FULL:
        size = (1296, 740)
    shown = make(size, demo=True)
    shown.turn_to(-100.0)
    QApplication.processEvents()
    shown.screen.grab()
    left = shown.screen.left
    room = shown.screen._left_scroll.viewport().width()
    assert left.demo is not None
    parts = [
        left.wells.live,
        left.wells.goal,
        left.strip,
        left.plan,
        left.tools.align,
        left.tools.quality,
    ]
    apart(left, room, [*parts, left.shots, left.demo])
    column = shown.screen.column
    assert column.width() <= shown.screen._right.width()
    if scale == 1.0:
        assert column.height() <= size[1], "without scrolling"
        assert left.height() <= size[1]
    wide = left.wells.live.width()
    shown.rig.presenter.alignment.toggle()
    shown.tick(2)
    for _ in range(3):  # the column's new height reaches the area that scrolls it
        QApplication.processEvents()
        shown.screen.grab()
    assert left.wells.live.width() > 1.5 * wide, "the alignment fills the left half"
    parts = [
        left.wells.live,
        left.tools.align,
        left.tools.modes,
        left.tools.opacity,
        left.tools.quality,
    ]
    apart(left, shown.screen._left_scroll.viewport().width(), [*parts, left.shots, left.demo])
    if scale == 1.0:
        assert left.height() <= size[1]


def test_the_right_column_is_amber_in_contrast(make: Callable[..., Shown]) -> None:
    set_theme("contrast")
    shown = make()
    shown.turn_to(0.0)
    image = shown.image()
    assert QColor(image.pixel(1340, 400)) == theme().c.amberfill


@pytest.mark.parametrize("name", ["dark", "light", "contrast"])
def test_in_the_light_the_whole_column_is_green_and_says_so(
    make: Callable[..., Shown], name: ThemeName
) -> None:
    set_theme(name)
    shown = make()
    opener = shown.screen.left.shots.opener
    shown.turn_to(shown.rig.goal - 40.0)
    plain = QColor(shown.image().pixel(1340, 400))
    assert str(opener.kind) == "outlined"
    shown.turn_to(shown.rig.goal - 4.0)
    image = shown.image()
    for y in (4, 400, 800):
        assert QColor(image.pixel(1340, y)) == theme().c.okfill != plain
    said = words_on(shown)
    # Never by the colour alone.
    assert (said["direction"], said["arrow"]) == (TAKE, "check")
    assert said["pill"] == IN_LIGHT.here
    assert str(opener.kind) == "primary"
    shown.turn_to(shown.rig.goal - 40.0)
    assert QColor(shown.image().pixel(1340, 400)) == plain
    assert str(opener.kind) == "outlined"


def test_alignment_fills_the_left_half_in_three_ways(make: Callable[..., Shown]) -> None:
    shown = make(reduce_motion=True)
    shown.turn_to(shown.rig.goal - 10.0)
    left = shown.screen.left
    assert not left.tools.modes.isVisible()
    click(left.tools.align, Qt.MouseButton.LeftButton)
    shown.tick(2)
    hidden = [left.wells.goal, left.strip, left.plan, left.tools.swap]
    assert [one for one in hidden if one.isVisible()] == []
    assert left.wells.live.width() == 824
    assert left.tools.opacity.isVisible()
    press(left.tools.modes, Qt.Key.Key_End)
    shown.tick(2)
    assert (left.tools.modes.key, left.tools.opacity.isVisible()) == ("blink", False)
    live = left.wells.live.picture
    press(left.tools.swap, Qt.Key.Key_Space)
    shown.tick(2)
    assert live is not None
    assert left.wells.live.picture is not None
    assert np.abs(live.astype(int) - left.wells.live.picture).max() > 10
    shown.rig.presenter.back()
    shown.tick(2)
    assert left.wells.goal.isVisible()
    assert left.plan.isVisible()


def test_in_a_selfie_the_arrows_go_the_way_of_the_mirrored_strip(
    make: Callable[..., Shown],
) -> None:
    shown = make(demo=True, mode="selfie")
    strip = shown.screen.left.strip
    strip.setFocus()
    press(strip, Qt.Key.Key_Right)
    assert shown.rig.devices.simulated.turn_deg == -1.0


def test_the_live_picture_is_drawn_as_it_came(make: Callable[..., Shown]) -> None:
    shown = make()
    shown.turn_to(0.0)
    area = shown.screen.left.wells.live.geometry()
    image = shown.image()
    left = QColor(image.pixel(area.x() + 60, area.center().y())).red()
    right = QColor(image.pixel(area.right() - 60, area.center().y())).red()
    assert (left, right) == (60, 200)


def test_no_part_opens_a_window_of_its_own(make: Callable[..., Shown]) -> None:
    """A part shown before it has a parent would take the focus from the real window."""
    shown = make(demo=True, camera_looks="ask")
    shown.turn_to(0.0)
    windows = [one for one in QApplication.topLevelWidgets() if one.isVisible()]
    assert windows == [shown.screen]


def test_the_list_of_photos_leaves_the_keyboard_in_the_window(qtbot: QtBot) -> None:
    """What a photo's face shows was a window of its own for a moment: keys reached nothing then."""
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(*FULL)
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    said = "Key as promised"
    told = ShotRow("shot-0001", "IMG_7.jpg", "In the light", "Loop", said)
    sheet = ShotsSheet(window, lambda _key: None, lambda _on: None)
    sheet.show_shots(ShotsState((told, replace(told, key="shot-0002", face=""))))
    sheet.open()
    QApplication.processEvents()
    assert window.isActiveWindow()
    focus = QApplication.focusWidget()
    assert focus is not None
    assert sheet.isAncestorOf(focus)
    faces = [text.isVisible() for text in sheet.findChildren(Text) if text.text() in (said, "")]
    assert faces == [True, False]


def test_keys_go_to_the_screen_when_it_comes_to_the_front(
    make: Callable[..., Shown], qtbot: QtBot
) -> None:
    shown = make(demo=True)
    shown.screen.activateWindow()
    qtbot.waitUntil(lambda: QApplication.focusWidget() is shown.screen)


def test_another_size_while_the_focus_is_in_the_column(
    make: Callable[..., Shown], qtbot: QtBot
) -> None:
    """The column is made anew: whoever follows the focus must not come upon half a widget."""
    shown = make()
    shown.turn_to(20.0)
    qtbot.waitExposed(shown.screen)
    old = shown.screen.column
    with qtbot.waitActive(shown.screen):
        shown.screen.activateWindow()
    old._mode.part("walk").setFocus()
    assert old._mode.part("walk").hasFocus()
    kinds: list[str] = []

    def follow() -> None:
        kinds.extend(type(one).__name__ for one in shown.screen.findChildren(QWidget))

    application = QApplication.instance()
    assert isinstance(application, QApplication)
    application.focusChanged.connect(follow)
    shown.screen.resize(1600, 1200)
    application.focusChanged.disconnect(follow)
    assert shown.screen.column is not old
    assert kinds, "the focus moved"
    assert isValid(old), "it is deleted later"
    qtbot.waitUntil(lambda: not isValid(old))
