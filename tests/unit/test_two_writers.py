"""Two processes on one data folder: nothing that either of them has written is lost."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.core.painting.draft_file import Draft, load_draft, save_draft
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import list_user_styles, save_user_style, update_user_style
from app.core.places.place_folder import PLACE, change_place, create_place, read_place, write_place
from app.core.storage import data_lock
from app.core.storage.json_file import read_json
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, read_settings, write_settings
from app.ui.presenters.window_model import Model
from app.ui.screens.paint.drafts import DraftKeeper
from tests.helpers.second_writer import painted

ROOT = Path(__file__).resolve().parents[2]
NOON = datetime(2026, 5, 4, 12, tzinfo=UTC)


@pytest.fixture(params=["locks", "no locks"], autouse=True)
def locks(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_lock: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    if request.param == "no locks":
        monkeypatch.setattr(data_lock, "_acquire", refuse)


def start(*words: object) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "tests.helpers.second_writer", *map(str, words)]
    return subprocess.Popen(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})


def another_process(*words: object) -> None:
    assert start(*words).wait(120) == 0


def test_both_versions_of_a_place_are_kept(tmp_path: Path) -> None:
    folder = create_place(tmp_path, "Café", NOON)
    mine = read_place(folder)
    assert write_place(folder, replace(mine, notes="one")) is None
    another_process("place", folder, "Theirs")
    # Made from what was read before, as by a window that has it open.
    copy = write_place(folder, replace(mine, name="Mine"))
    assert copy is not None
    assert copy.name == f"{PLACE}.conflict"
    assert read_json(copy, 1 << 20).facts["name"] == "Theirs"
    assert read_place(folder).name == "Mine"
    # Told once: the next write meets the own version.
    assert write_place(folder, replace(mine, name="Mine again")) is None
    assert write_place(folder, read_place(folder)) is None
    assert sorted(os.listdir(folder)) == [PLACE, f"{PLACE}.conflict"]


def test_a_change_of_what_was_just_read_is_no_conflict(tmp_path: Path) -> None:
    folder = create_place(tmp_path, "Café", NOON)
    another_process("place", folder, "Theirs")
    change_place(folder, notes="mine")
    place = read_place(folder)
    assert (place.name, place.notes) == ("Theirs", "mine")
    assert os.listdir(folder) == [PLACE]


def test_settings_of_both_count(tmp_path: Path) -> None:
    file = tmp_path / FILE
    saved = Settings()
    write_settings(file, saved, saved)
    another_process("settings", file, "theme", "light")
    mine = saved.with_("text_scale", 1.25)
    assert write_settings(file, mine, saved) is None
    both = read_settings(file)[0]
    assert (both.theme, both.text_scale) == ("light", 1.25)


def test_one_setting_with_two_values_keeps_both(tmp_path: Path) -> None:
    file = tmp_path / FILE
    write_settings(file, Settings(), Settings())
    another_process("settings", file, "theme", "light")
    copy = write_settings(file, Settings(theme="contrast"), Settings())
    assert copy is not None
    assert read_settings(copy)[0].theme == "light"
    assert read_settings(file)[0].theme == "contrast"


def test_a_style_that_both_have_painted_becomes_two(tmp_path: Path) -> None:
    mine = save_user_style(tmp_path, painted(0.25), "Mine")
    another_process("style", tmp_path)
    others: list[UserStyle] = []
    changed = update_user_style(tmp_path, mine, painted(1.0), others.append)
    assert [each.title for each in others] == ["Mine 2"]
    kept = {each.title: float(each.weights.max()) for each in list_user_styles(tmp_path)[0]}
    assert kept == {"Mine": 1.0, "Mine 2": 0.5}
    # The own version is no other one.
    update_user_style(tmp_path, changed, painted(0.75), others.append)
    assert len(others) == 1


class _Services:
    def __init__(self) -> None:
        self.model, self.told = Model(), []  # type: ignore[var-annotated]
        self.notify = self

    def tell(self, message: str, **_how: Any) -> None:
        self.told.append(message)


def test_drafts_of_both_are_kept(tmp_path: Path) -> None:
    services: Any = _Services()
    keeper, path = DraftKeeper(services), tmp_path / "paint-loop.npz"
    keeper.opened(path, "")
    keeper._waiting[path] = Draft(painted(0.25), title="mine")
    assert keeper.flush()
    another_process("draft", path)
    keeper._waiting[path] = Draft(painted(1.0), title="mine")
    assert keeper.flush()
    assert load_draft(path).title == "mine"
    assert np.isclose(load_draft(path).canvas.weights.max(), 1.0)
    assert load_draft(tmp_path / "paint-loop.2.npz").title == "theirs"
    assert len(services.told) == 1
    keeper._waiting[path] = None
    assert keeper.flush()
    assert not path.exists()
    # Saved here, painted there: that draft stays.
    save_draft(path, Draft(painted(0.5), title="theirs again"))
    keeper._waiting[path] = None
    assert keeper.flush()
    assert load_draft(tmp_path / "paint-loop.3.npz").title == "theirs again"


def test_styles_added_at_once_get_names_of_their_own(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if "no locks" in request.node.name:
        pytest.skip("a free name is found under the lock")
    both = [start("add", tmp_path, "Mine", 6, value) for value in (0.5, 1.0)]
    assert [each.wait(120) for each in both] == [0, 0]
    values = [float(each.weights.max()) for each in list_user_styles(tmp_path)[0]]
    assert sorted(values) == [0.5] * 6 + [1.0] * 6
