"""Set sheets, and the user's own styles: nothing is lost, and every fault has a sentence."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from app.core.painting.canvas import from_style
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import import_style, list_user_styles, save_user_style
from app.core.places.place import CaptureFacts, Place
from app.core.places.place_verdict import place_verdict
from app.ui.screens.styles.files import ROUGHLY, plain_name
from app.ui.screens.styles.screen import StylesView
from app.words.phrases.place_verdict import place_verdict_words
from app.words.phrases.quantities import contrast_words
from app.words.portrait.face_light import ratio_sentence
from tests.helpers.styles_screen import Table, head, scene_light


@pytest.fixture(autouse=True)
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.fsync", lambda handle: None)


def keep(table: Table, title: str, origin: str = "left-rembrandt") -> UserStyle:
    """Paint a style, as the painting screen would leave it."""
    one = head()
    canvas = from_style(one.pack, one.transport, origin)
    return save_user_style(table.folder / "styles", canvas, title, side="left", head="generic")


@pytest.fixture
def table(tmp_path: Path) -> Table:
    table = Table(tmp_path)
    mine = keep(table, "My Rembrandt")
    table.model.update(user_styles=(mine,))
    table.open(scene_light("sunrise"))
    table.presenter.choose("my-rembrandt")
    return table


def attached(table: Table) -> MagicMock:
    view = MagicMock(spec=StylesView)
    table.presenter.attach(view)
    return view


def titles(table: Table) -> list[str]:
    return [style.title for style in list_user_styles(table.folder / "styles")[0]]


def test_an_own_style_is_a_card_like_the_others(table: Table) -> None:
    card = table.card("my-rembrandt")
    assert card.target is not None
    assert card.here is not None
    assert card.word == ("Yes" if card.in_reach else "–")
    # It asks for what Rembrandt asks for, so it is given at about the same turn.
    other = table.card("left-rembrandt")
    assert abs(int(card.turn[:-1]) - int(other.turn[:-1])) <= 12
    table.presenter.set_filter("mine")
    assert [one.key for one in table.presenter.resolve().cards] == ["my-rembrandt"]
    assert table.presenter.resolve().detail.key == "my-rembrandt"


def test_renaming(table: Table) -> None:
    view = attached(table)
    table.presenter.files.ask_rename()
    view.ask_name.assert_called_once_with("My Rembrandt")
    table.presenter.files.rename("Evening  window")
    view.show_trouble.assert_called_with("")
    assert titles(table) == ["Evening window"]
    assert table.presenter.resolve().detail.title == "Evening window"
    assert table.model.chosen == "my-rembrandt"


def test_a_name_that_is_taken_is_said_beside_it_and_changes_nothing(table: Table) -> None:
    other = keep(table, "Window")
    table.model.update(user_styles=(*table.model.user_styles, other))
    view = attached(table)
    table.presenter.choose("my-rembrandt")
    table.presenter.files.rename("window")
    assert "already" in view.show_trouble.call_args.args[0]
    assert sorted(titles(table)) == ["My Rembrandt", "Window"]


def test_a_copy_comes_to_the_front(table: Table) -> None:
    table.presenter.files.duplicate()
    assert titles(table) == ["My Rembrandt", "My Rembrandt 2"]
    assert table.model.chosen == "my-rembrandt-2"
    assert table.presenter.resolve().detail.title == "My Rembrandt 2"


def test_a_deleted_style_can_be_brought_back(table: Table) -> None:
    before = table.card("my-rembrandt")
    table.presenter.files.delete()
    assert titles(table) == []
    assert table.told.messages == ["My Rembrandt deleted."]
    state = table.presenter.resolve()
    assert "my-rembrandt" not in [card.key for card in state.cards]
    assert state.detail.key == table.model.chosen
    table.told.buttons["Undo"]()
    assert titles(table) == ["My Rembrandt"]
    assert table.model.chosen == "my-rembrandt"
    after = table.card("my-rembrandt")
    assert (after.word, after.line, after.turn) == (before.word, before.line, before.turn)


def test_built_in_styles_are_not_renamed_or_deleted(table: Table) -> None:
    view = attached(table)
    table.presenter.choose("left-rembrandt")
    files = table.presenter.files
    files.ask_rename()
    files.delete()
    files.duplicate()
    files.ask_export()
    view.ask_name.assert_not_called()
    view.ask_file.assert_not_called()
    assert titles(table) == ["My Rembrandt"]
    enabled = {action.key: action.enabled() for action in files.actions()}
    assert not any(enabled[key] for key in ("rename-style", "delete-style", "export-style"))


def test_export_and_import(table: Table, tmp_path: Path) -> None:
    view = attached(table)
    table.presenter.files.ask_export()
    view.ask_file.assert_called_once_with("export", "My Rembrandt.turnstyle")
    file = tmp_path / "out" / "style"
    file.parent.mkdir()
    table.presenter.files.export(file)
    written = file.with_name("style.turnstyle")
    assert written.is_file()
    assert table.told.messages[-1] == "style.turnstyle saved."
    table.presenter.files.import_style(written)
    assert sorted(titles(table)) == ["My Rembrandt", "My Rembrandt 2"]
    assert table.model.chosen == "my-rembrandt-2"
    assert import_style(tmp_path / "elsewhere", written).title == "My Rembrandt"


def test_a_file_that_nobody_agreed_to_replace_stays(table: Table, tmp_path: Path) -> None:
    there = tmp_path / "style.turnstyle"
    there.write_bytes(b"precious")
    table.presenter.files.export(tmp_path / "style")
    assert "already exists" in table.told.messages[-1]
    assert there.read_bytes() == b"precious"
    sheet = tmp_path / "sheet.pdf"
    sheet.write_bytes(b"precious")
    table.presenter.files.save_sheet(tmp_path / "sheet")
    assert "already exists" in table.told.messages[-1]
    assert sheet.read_bytes() == b"precious"


def test_a_file_that_is_no_style(table: Table, tmp_path: Path) -> None:
    file = tmp_path / "holiday.turnstyle"
    file.write_bytes(b"\x00" * 100)
    table.presenter.files.import_style(file)
    assert "holiday.turnstyle is damaged or not an exported style" in table.told.messages[-1]
    assert titles(table) == ["My Rembrandt"]


@pytest.mark.parametrize(("name", "start"), [("a.pdf", b"%PDF"), ("b.png", b"\x89PNG")])
def test_set_sheet(table: Table, tmp_path: Path, name: str, start: bytes) -> None:
    view = MagicMock(spec=StylesView)
    table.presenter.attach(view)
    table.presenter.choose("left-rembrandt")
    table.presenter.files.save_sheet(tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(start)
    assert table.told.messages == [f"{name} saved in {tmp_path.name}."]
    table.told.buttons["Show"]()
    view.show_folder.assert_called_once_with(tmp_path)


def test_the_sheet_has_the_numbers_of_the_screen(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = []
    monkeypatch.setattr("app.export.set_page.write_pdf", lambda path, sheet: kept.append(sheet))
    table.presenter.choose("left-rembrandt")
    for turn in (None, 33.0):
        if turn is not None:
            table.presenter.look_at(turn)
        table.presenter.files.save_sheet(tmp_path / "x.pdf")
        shown, sheet = table.presenter.resolve().detail, kept[-1]
        assert sheet.turn_deg == pytest.approx(shown.needle)
        assert int(sheet.match) == int(shown.match)
        assert contrast_words(sheet.strength) == shown.contrast
        assert ratio_sentence(sheet.ratio) in shown.ratio_tip
        assert table.model.light is not None
        verdict = place_verdict(table.model.results, table.model.light.searched, 0.0)
        assert verdict is not None
        assert sheet.verdict == place_verdict_words(verdict, table.model.results)


def test_the_sheet_says_how_old_the_light_is_where_it_was_measured(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = []
    monkeypatch.setattr("app.export.set_page.write_pdf", lambda path, sheet: kept.append(sheet))
    now = table.services.today()
    table.presenter.choose("left-rembrandt")
    place = Place("Court", now, measured_at=now - timedelta(minutes=25), capture=CaptureFacts())
    filmed, rough = (replace(place, capture=CaptureFacts(plan=plan)) for plan in ("film", "rough"))
    never = replace(rough, measured_at=None)
    for each in (None, replace(place, capture=None), place, filmed, rough, never):
        table.model.update(place=each)
        table.presenter.files.save_sheet(tmp_path / "x.pdf")
    assert [sheet.age for sheet in kept[:2]] == ["", ""]
    assert all("25" in sheet.age for sheet in kept[2:5])
    # How it was measured, where that is rough.
    assert kept[3].age.startswith(f"{ROUGHLY['film']} ")
    assert kept[4].age.startswith(f"{ROUGHLY['rough']} ")
    assert kept[5].age == ROUGHLY["rough"]


def test_the_sheet_is_named_after_style_side_and_place(table: Table) -> None:
    view = attached(table)
    table.presenter.choose("left-rembrandt")
    table.presenter.files.ask_sheet()
    view.ask_file.assert_called_once_with("save_sheet", "Rembrandt left.pdf")
    assert plain_name('a/b\\c: "d"?') == "a b c d"
    assert plain_name("///") == "style"
