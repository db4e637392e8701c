"""Like this photo: what is dropped is read, corrected, refused or kept as a style of one's own."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import MagicMock

import cv2
import numpy as np
import pytest

from app.ui.screens.styles.like_photo import LikeState
from tests.helpers.photos import photo_bytes
from tests.helpers.styles_screen import Table, lamp_light
from tests.unit.test_faces import Bytes, portrait, shown_in


def written(path: Path, picture: Bytes) -> Path:
    assert cv2.imwrite(str(path), np.ascontiguousarray(picture[..., ::-1]))
    return path


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    return written(tmp_path / "Anna.jpg", portrait("generic", 50.0, 40.0))


@pytest.fixture
def table(tmp_path: Path) -> Table:
    made = Table(tmp_path).open(lamp_light(0.0))
    made.presenter.attach(MagicMock())
    return made


def state(table: Table) -> LikeState:
    found = table.presenter.like.state
    assert found is not None
    return found


def test_a_portrait_is_read_and_shown_beside_the_head(table: Table, photo: Path) -> None:
    table.presenter.enter()
    table.desk.open_paths([photo])
    found = state(table)
    assert (found.name, found.trouble) == ("Anna", "")
    assert found.azimuth_deg == pytest.approx(50, abs=8)
    assert found.altitude_deg == pytest.approx(40, abs=8)
    assert found.best is None, "it was not moved"
    assert "may be " in found.note
    for picture in (found.photo, found.face, found.head):
        assert picture is not None
        assert picture.shape == (512, 512, 3)
    assert "key" in found.note


def test_mirrored_photo_is_read_the_right_way_round(table: Table, tmp_path: Path) -> None:
    mirror = np.ascontiguousarray(portrait("generic", 50.0, 40.0)[:, ::-1])
    path = tmp_path / "Selfie.jpg"
    path.write_bytes(photo_bytes(mirror, lens=b"iPhone 15 front camera 2.69mm f/1.9"))
    like = table.presenter.like
    like.take([path])
    before = state(table)
    assert before.azimuth_deg == pytest.approx(-50, abs=8)
    assert "turn on Mirrored" in before.hint
    like.set_mirrored(True)
    found = state(table)
    assert (found.mirrored, found.best) == (True, None)
    assert found.azimuth_deg == pytest.approx(50, abs=8)
    assert found.face is not None
    assert before.face is not None
    bright = [face[:, :256].mean() > face[:, 256:].mean() for face in (before.face, found.face)]
    assert bright == [True, False]
    like.set_mirrored(False)
    assert state(table).azimuth_deg == pytest.approx(-50, abs=8)


def test_the_head_follows_the_key(table: Table, photo: Path) -> None:
    like = table.presenter.like
    like.take([photo])
    before = state(table)
    like.move(-60.0, 120.0)
    found = state(table)
    assert (found.azimuth_deg, found.altitude_deg) == (-60.0, 85.0)
    assert found.best == (before.azimuth_deg, before.altitude_deg)
    assert found.note.startswith("Set by hand, based on a photo: key ")
    assert found.head is not None
    assert before.head is not None
    left, right = found.head[200:340, 160:240].mean(), found.head[200:340, 272:352].mean()
    assert left > right, "from the sitter's right, which is the picture's left"
    like.go_back()
    again = state(table).head
    assert again is not None
    assert np.array_equal(again, before.head)


def test_softness_and_fill(table: Table, photo: Path) -> None:
    like = table.presenter.like
    like.take([photo])
    hard = state(table).head
    like.set_fill("4")
    like.set_size(40.0)
    found = state(table)
    assert found.light is not None
    assert (found.light.fill_ratio, found.light.softness_deg) == (4.0, 40.0)
    assert "4:1" in found.note
    assert hard is not None
    assert found.head is not None
    dark = slice(200, 340), slice(160, 240)
    assert found.head[dark].mean() > hard[dark].mean(), "the fill lights the far cheek"
    like.set_fill("none")
    assert "no fill" in state(table).note


def test_it_is_kept_among_ones_own_and_solved(table: Table, photo: Path) -> None:
    table.presenter.like.take([photo])
    table.presenter.like.save()
    (style,) = table.model.user_styles
    assert style.title == "Like Anna"
    assert style.side == "left"
    assert table.model.chosen == style.name
    assert table.told.messages[-1].startswith("Like Anna ")
    # A lamp from azimuth 0 lights as a key 50 degrees to the left does where one turns by 50.
    card = table.card(style.name)
    assert card.turn.rstrip("°").isdecimal()
    assert int(card.turn.rstrip("°")) == pytest.approx(50, abs=15)


def test_of_several_faces_a_click_chooses(table: Table, tmp_path: Path) -> None:
    small = cv2.resize(portrait("male", -60.0, 30.0), (320, 320), interpolation=cv2.INTER_AREA)
    both = np.full((640, 960, 3), 110, np.uint8)
    both[:, :640], both[160:480, 640:] = portrait("generic", 50.0, 40.0), small
    like = table.presenter.like
    like.take([written(tmp_path / "two.png", both)])
    assert [state(table).chosen, len(state(table).faces)] == [0, 2]
    assert state(table).azimuth_deg > 30
    like.choose_at(0.5, 0.05)
    assert state(table).chosen == 0, "nobody is there"
    like.choose_at(800 / 960, (160 + 320) / 960)
    assert state(table).chosen == 1
    assert state(table).azimuth_deg == pytest.approx(-60, abs=12)


def test_what_cannot_be_read_is_refused_and_not_kept(table: Table, tmp_path: Path) -> None:
    like = table.presenter.like
    even = shown_in("generic", np.ones((64, 128, 3), np.float32))
    for name, picture, words in (
        ("even.png", even, "flat"),
        ("wall.png", np.full((480, 640, 3), 140, np.uint8), "No face"),
        ("behind.png", portrait("generic", 115.0, 15.0), "behind"),
    ):
        like.take([written(tmp_path / name, picture)])
        assert words in state(table).trouble
        like.move(30.0, 30.0)
        like.save()
        assert table.model.user_styles == ()


def test_what_else_is_dropped_goes_on_its_way(table: Table, tmp_path: Path, photo: Path) -> None:
    like = table.presenter.like
    assert not like.take([tmp_path / "place.exr"])
    assert not like.take([photo, photo])
    opened = MagicMock()
    table.desk.open_as_place = opened  # type: ignore[method-assign]
    panorama = written(tmp_path / "around.jpg", np.full((400, 800, 3), 90, np.uint8))
    assert like.take([panorama])
    opened.assert_called_once_with([panorama])
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"no picture")
    assert like.take([broken])
    assert table.told.errors
    table.presenter.enter()
    assert table.desk.photo_taker is not None
    table.presenter.leave()
    assert table.desk.photo_taker is None
