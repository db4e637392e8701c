"""Places in core: files are opened, saved, loaded, solved and resumed without a window."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.cli import main
from app.core.base.errors import Cancelled, CoreError
from app.core.base.imaging.images import write_exr, write_png
from app.core.base.paths import resources
from app.core.base.progress import Progress, Token, silent
from app.core.painting.canvas import from_style, make_canvas
from app.core.painting.user_style import UserStyle
from app.core.painting.user_styles import save_user_style
from app.core.places.files.originals import adopt_files
from app.core.places.load_saved import NotFinished, last_opened, load_place
from app.core.places.open_files import OpenOptions, open_paths
from app.core.places.place import OpenPlace
from app.core.places.place_folder import create_place, read_place, write_place
from app.core.places.resume import drop_empty_place, list_unfinished
from app.core.places.save import FolderState, folder_state, save_anywhere
from app.core.places.solve_place import solve_place
from app.core.portrait.head import Head
from app.core.portrait.portrait_file import PLAIN
from app.core.solver.lens.lens_wish import LensWish
from app.core.storage.settings import Settings
from tests.helpers.shipped import generic_pack, generic_transport

NOW = datetime(2026, 6, 1, 12, 0, tzinfo=UTC)
ORIGIN = "left-loop"
SCENE = resources() / "demo" / "scenes" / "interior.exr"


@cache
def head() -> Head:
    return Head("generic", generic_pack(), generic_transport(), PLAIN)


def options(tmp_path: Path, **more: Any) -> OpenOptions:
    return OpenOptions(tmp_path / "places", NOW, Settings(), **more)


def panorama(tmp_path: Path) -> Path:
    """A window in a dim room; the name becomes the place's."""
    radiance = np.full((64, 128, 3), 0.1, np.float32)
    radiance[20:30, 40:50] = 37.123456
    write_exr(tmp_path / "north_room.exr", radiance)
    return tmp_path / "north_room.exr"


def opened(tmp_path: Path, **more: Any) -> OpenPlace:
    return open_paths([panorama(tmp_path)], options(tmp_path, **more), Token(), silent)


def test_a_panorama_becomes_a_place_that_loads_to_the_same_bits(tmp_path: Path) -> None:
    made = opened(tmp_path)
    assert (made.place.name, made.place.made_at) == ("north room", NOW)
    assert made.trouble is None
    assert made.folder is not None
    again = load_place(made.folder)
    assert again.place.fingerprint == made.place.fingerprint
    one, other = made.light.environment.radiance, again.light.environment.radiance
    assert np.array_equal(one.view(np.uint32), other.view(np.uint32))
    assert last_opened("", tmp_path / "places") == made.folder


def test_opening_a_folder_of_a_place_takes_what_the_disk_has_not_taken(tmp_path: Path) -> None:
    made = opened(tmp_path)
    assert made.folder is not None
    newer = replace(read_place(made.folder), front_deg=30.0)
    again = open_paths(
        [made.folder / "place.json"], options(tmp_path), Token(), silent, lambda folder: newer
    )
    assert again.folder == made.folder
    assert again.place.front_deg == 30.0
    assert read_place(made.folder).front_deg == 0.0


def test_a_place_that_cannot_be_saved_is_open_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "places").write_text("a file where the folder should be")
    made = opened(tmp_path)
    assert made.folder is None
    assert isinstance(made.trouble, CoreError)
    assert made.light.environment.radiance.max() > 30.0


def test_a_cancelled_opening_leaves_no_place(tmp_path: Path) -> None:
    token, steps = Token(), list[float]()

    def report(fraction: float, step: Progress) -> None:
        steps.append(fraction)
        token.cancel()

    with pytest.raises(Cancelled):
        open_paths([panorama(tmp_path)], options(tmp_path), token, report)
    assert steps[0] < 0.9
    assert not (tmp_path / "places").exists()


def test_a_folder_that_is_gone_is_made_again_with_what_is_in_memory(tmp_path: Path) -> None:
    made = opened(tmp_path)
    assert made.folder is not None
    assert folder_state(made.folder) is FolderState.THERE
    shutil.rmtree(made.folder)
    assert folder_state(made.folder) is FolderState.GONE
    assert folder_state(tmp_path / "no" / "disk") is FolderState.UNPLUGGED
    assert save_anywhere(made, tmp_path / "places").folder == made.folder
    assert load_place(made.folder).place.fingerprint == made.place.fingerprint


def test_a_place_whose_folder_is_there_is_rescued_into_another_one(tmp_path: Path) -> None:
    made = opened(tmp_path)
    assert made.folder is not None
    adopt_files(made.folder, [panorama(tmp_path)])
    rescued = save_anywhere(made, tmp_path / "elsewhere")
    assert rescued.folder is not None
    assert rescued.folder.parent == tmp_path / "elsewhere"
    assert [each.name for each in (rescued.folder / "originals").iterdir()] == ["north_room.exr"]


def test_a_place_with_photographs_and_no_light_can_be_finished(tmp_path: Path) -> None:
    folder = create_place(tmp_path / "places", "Begun", NOW)
    shade = np.random.default_rng(5).integers(0, 255, (64, 128, 3), np.uint8)
    write_png(tmp_path / "frame.png", shade)
    adopt_files(folder, [tmp_path / "frame.png"])
    (left,) = list_unfinished(tmp_path / "places")
    assert (left.folder, left.session, left.can_finish) == (folder, None, True)
    with pytest.raises(NotFinished) as caught:
        load_place(folder)
    assert caught.value.unfinished == left
    # Nothing of it was captured by a camera: it is the user's.
    assert not drop_empty_place(folder, folder / "capture")
    assert folder.is_dir()


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[UserStyle]:
    """A copy of a built-in style without strokes, and a painted one, as saved by the window."""
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    folder = tmp_path / "home" / "styles"
    copy = from_style(generic_pack(), generic_transport(), ORIGIN)
    drawn = make_canvas(copy.weights, copy.ignore, np.zeros_like(copy.weights))
    return [
        save_user_style(folder, copy, "A copy", origin=ORIGIN, head="generic"),
        save_user_style(folder, drawn, "Strokes", origin=ORIGIN, head="generic"),
    ]


@pytest.mark.parametrize("yaw", [0.0, 15.0])
def test_the_command_and_the_window_give_one_answer(
    tmp_path: Path, own: list[UserStyle], capsys: pytest.CaptureFixture[str], yaw: float
) -> None:
    place = open_paths([SCENE], options(tmp_path), Token(), silent)
    lens = LensWish(yaw)
    results = solve_place(head(), place.light, own, Settings(), 20.0, lens)
    names = [result.name for result in results]
    words = [str(SCENE), "--front", "20", "--yaw", str(yaw), "--style", *reversed(names)]
    assert main(["solve", *words, "--json"]) == 0
    styles = json.loads(capsys.readouterr().out)["styles"]
    assert [style["name"] for style in styles] == names
    assert [style.copy_of for style in own] == [ORIGIN, ""]
    for style, result in zip(styles, results, strict=True):
        assert style["grade"] == result.grade
        # The place's light was rounded to half floats when it was saved.
        assert style["match"] == pytest.approx(result.match, abs=0.05)
        assert style["turn_refined_deg"] == pytest.approx(result.turn_refined_deg, abs=0.2)
    copy, origin = results[-2], results[names.index(ORIGIN)]
    assert (copy.match, copy.turn_refined_deg) == (origin.match, origin.turn_refined_deg)


def test_a_saved_place_is_solved_to_the_digit(tmp_path: Path) -> None:
    made = opened(tmp_path)
    assert made.folder is not None
    results = solve_place(head(), made.light, (), Settings(), 0.0)
    write_place(made.folder, replace(read_place(made.folder), results=results))
    again = load_place(made.folder)
    for one, other in zip(again.place.results, results, strict=True):
        assert (one.name, one.match, one.turn_refined_deg) == (
            other.name,
            other.match,
            other.turn_refined_deg,
        )
    assert [one.match for one in solve_place(head(), again.light, (), Settings(), 0.0)] == [
        one.match for one in results
    ]
