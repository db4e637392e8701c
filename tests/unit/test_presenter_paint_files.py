"""A painted style as a file: saved, named, copied, deleted and brought back, handed on."""

from __future__ import annotations

import errno
from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.core.painting.draft_file import load_draft
from app.core.painting.stroke import Tool
from app.core.painting.user_style import not_saved
from app.core.painting.user_styles import list_user_styles
from app.ui.screens.paint.files import CHANGED, NOT_SAVED
from app.ui.screens.paint.screen import PaintState, PaintView
from tests.helpers.paint_studio import Studio, studio


@pytest.fixture
def room(tmp_path: Path) -> Studio:
    room = studio(tmp_path)
    room.enter("left-split")
    return room


def _view(room: Studio) -> MagicMock:
    view = MagicMock(spec=PaintView)
    room.presenter.attach(view)
    return view


def _state(room: Studio) -> PaintState:
    return room.presenter.resolve()


def _saved(room: Studio, title: str = "Mine") -> None:
    room.stroke((0.4, 0.4), (0.6, 0.6))
    room.presenter.files.named("save", title)


def test_name_is_asked_for_and_the_new_style_is_chosen(room: Studio) -> None:
    view = _view(room)
    room.stroke((0.4, 0.4), (0.6, 0.6))
    room.presenter.files.ask_save()
    view.ask_name.assert_called_once_with("save", "My Split")
    painted = room.presenter.canvas
    room.presenter.files.named("save", "Window light")
    view.show_trouble.assert_called_with("")
    styles, damaged = list_user_styles(room.styles)
    assert damaged == ()
    (style,) = styles
    assert painted is not None
    np.testing.assert_array_equal(style.weights, painted.weights)
    assert (style.title, style.side, style.origin) == ("Window light", "left", "left-split")
    assert style.head == "synthetic"
    assert room.model.chosen == room.model.painting == style.name
    assert [one.name for one in room.model.user_styles] == [style.name]
    state = _state(room)
    assert (state.save.title, state.save.status) == ("Window light", "saved")
    assert state.save.why == "Everything is saved"
    assert not list(room.drafts.iterdir())


def test_strokes_can_be_undone_after_saving_and_are_unsaved_then(room: Studio) -> None:
    _saved(room)
    room.services.undo.undo()
    assert _state(room).save.status == CHANGED
    assert (room.drafts / "paint-mine.npz").exists()
    room.services.undo.redo()
    assert _state(room).save.status == "saved"
    assert not (room.drafts / "paint-mine.npz").exists()


def test_changes_of_an_own_style_are_saved_in_place(room: Studio) -> None:
    view = _view(room)
    _saved(room)
    room.presenter.tools.change(tool=Tool.DARKER)
    room.stroke((0.3, 0.3))
    assert _state(room).save.words == "Save changes"
    view.ask_name.reset_mock()
    room.presenter.files.ask_save()
    view.ask_name.assert_not_called()
    (style,) = list_user_styles(room.styles)[0]
    np.testing.assert_array_equal(style.weights, room.presenter.canvas.weights)  # type: ignore[union-attr]
    assert _state(room).save.status == "saved"


def test_restored_to_the_start_is_a_change_that_can_be_saved(room: Studio) -> None:
    _saved(room)
    room.presenter.clear()
    assert _state(room).save.why == ""
    room.presenter.files.ask_save()
    (style,) = list_user_styles(room.styles)[0]
    np.testing.assert_array_equal(style.weights, room.presenter.canvas.start_weights)  # type: ignore[union-attr]


def test_an_own_style_is_opened_as_it_was_saved(room: Studio, tmp_path: Path) -> None:
    _saved(room)
    painted = room.presenter.canvas
    assert painted is not None
    again = studio(tmp_path)
    again.model.update(user_styles=list_user_styles(again.styles)[0])
    again.enter("mine")
    np.testing.assert_array_equal(again.presenter.canvas.weights, painted.weights)  # type: ignore[union-attr]
    assert _state(again).save.why == "Everything is saved"
    again.stroke((0.5, 0.3))
    draft = load_draft(again.drafts / "paint-mine.npz")
    assert (draft.style, draft.title) == ("mine", "Mine")


def test_full_disk_is_told_and_strokes_are_kept(
    room: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    view = _view(room)

    def full(*_args: object, **_more: object) -> None:
        raise OSError(28, "No space left on device")

    room.stroke((0.4, 0.4), (0.6, 0.6))
    painted = room.presenter.canvas
    monkeypatch.setattr("app.core.painting.user_style.write_layers", full)
    room.presenter.files.named("save", "Mine")
    words = str(not_saved(OSError(errno.ENOSPC, "")))
    assert [str(error) for error in room.told.errors] == [words]
    view.show_trouble.assert_called_with(words)
    assert room.presenter.canvas is not None
    assert painted is not None
    np.testing.assert_array_equal(room.presenter.canvas.weights, painted.weights)
    assert _state(room).save.status == NOT_SAVED
    assert not _state(room).save.busy
    assert (room.drafts / "paint-left-split.npz").exists()
    monkeypatch.undo()
    room.presenter.files.named("save", "Mine")
    assert _state(room).save.status == "saved"


def test_a_name_is_needed(room: Studio) -> None:
    view = _view(room)
    room.stroke((0.4, 0.4))
    room.presenter.files.named("save", "   ")
    assert "Enter a name" in view.show_trouble.call_args.args[0]
    assert not room.styles.exists()


def test_unsaved_painting_is_renamed_in_its_draft(room: Studio) -> None:
    room.stroke((0.4, 0.4))
    room.presenter.files.named("rename", "  Late   sun ")
    assert _state(room).save.title == "Late sun"
    assert load_draft(room.drafts / "paint-left-split.npz").title == "Late sun"


def test_saved_style_is_renamed_on_the_disk(room: Studio) -> None:
    view = _view(room)
    _saved(room)
    room.presenter.files.named("rename", "Late sun")
    assert list_user_styles(room.styles)[0][0].title == "Late sun"
    assert (_state(room).save.title, room.model.user_styles[0].title) == ("Late sun", "Late sun")
    room.presenter.files.duplicate()
    room.presenter.files.named("rename", "Late sun 2")
    assert "already taken" in view.show_trouble.call_args.args[0]


def test_copy_is_made_and_can_be_painted_on(room: Studio) -> None:
    _saved(room)
    room.presenter.files.duplicate()
    assert [one.title for one in room.model.user_styles] == ["Mine", "Mine 2"]
    assert room.model.painting == "mine"
    room.told.buttons["Paint on it"]()
    assert (room.model.painting, _state(room).save.title) == ("mine-2", "Mine 2")


def test_deleted_style_goes_and_comes_back(room: Studio) -> None:
    _saved(room)
    room.presenter.files.delete()
    room.presenter.leave()
    assert room.told.messages[-1] == "Mine deleted."
    assert (room.model.painting, room.model.user_styles) == (None, ())
    assert room.model.chosen != "mine"
    assert list_user_styles(room.styles)[0] == ()
    room.told.buttons["Undo"]()
    assert [one.title for one in list_user_styles(room.styles)[0]] == ["Mine"]
    assert room.model.chosen == "mine"
    room.enter("mine")
    assert _state(room).save.status == "saved"


def test_style_is_handed_on_and_taken_in(room: Studio, tmp_path: Path) -> None:
    view = _view(room)
    room.stroke((0.4, 0.4), (0.6, 0.6))
    room.presenter.files.ask_export()
    view.ask_file.assert_called_with("export", "My Split.turnstyle")
    room.presenter.files.export(tmp_path / "gift")
    file = tmp_path / "gift.turnstyle"
    assert file.exists()
    room.presenter.files.import_style(file)
    (style,) = room.model.user_styles
    np.testing.assert_array_equal(style.weights, room.presenter.canvas.weights)  # type: ignore[union-attr]
    assert (style.title, style.side) == ("My Split", "left")
    # What is on the easel stays there.
    assert room.model.painting == "left-split"


def test_a_file_that_is_no_style_changes_nothing(room: Studio, tmp_path: Path) -> None:
    bad = tmp_path / "bad.turnstyle"
    bad.write_bytes(b"PK\x03\x04 nothing")
    room.presenter.files.import_style(bad)
    assert "bad.turnstyle is damaged" in str(room.told)
    assert room.model.user_styles == ()


def test_what_needs_a_saved_style_is_offered_only_then(room: Studio) -> None:
    def offered() -> set[str]:
        return {one.key for one in room.presenter.files.actions() if one.enabled()}

    assert offered() == {"rename-painting", "import-painting"}
    room.stroke((0.4, 0.4))
    assert offered() >= {"save-style-as", "export-painting"}
    assert "delete-painting" not in offered()
    room.presenter.files.named("save", "Mine")
    assert offered() >= {"delete-painting", "duplicate-painting"}


def test_a_draft_that_the_disk_refuses_is_not_said_to_be_kept(
    room: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_given: object) -> None:
        raise OSError(28, "No space left on device")

    room.enter()
    monkeypatch.setattr("app.ui.screens.paint.drafts.save_draft", full)
    room.stroke((0.5, 0.5), (0.6, 0.5))
    room.leave()
    assert "disk is full" in room.told.messages[-1]
    assert not any(words.startswith("Draft saved") for words in room.told.messages)


def test_a_stroke_never_waits_for_the_disk(
    room: Studio, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    keeper = room.presenter._keeper
    written: list[object] = []

    def slow(path: Path, draft: object) -> None:
        if not written:
            # As from another thread, in the middle of writing.
            written.append(draft)
            keeper.keep(path, newer)
        else:
            written.append(draft)

    older, newer = MagicMock(), MagicMock()
    monkeypatch.setattr("app.ui.screens.paint.drafts.save_draft", slow)
    monkeypatch.setattr(keeper, "_start", lambda: None)
    keeper.keep(tmp_path / "d.npz", older)
    assert keeper.flush()
    assert keeper.flush()
    assert written == [older, newer]
