"""The user's own styles: kept exactly, named safely, never overwritten, and back from the trash."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.core.base.errors import StyleError
from app.core.painting.canvas import Canvas, make_canvas
from app.core.painting.user_style import (
    UserStyle,
    from_user_style,
    read_user_style,
    style_text,
    text_path,
)
from app.core.painting.user_styles import (
    delete,
    duplicate,
    list_user_styles,
    rename,
    restore,
    save_user_style,
    update_user_style,
)
from app.core.styles.styles import NAMES, load_styles
from app.words.phrases.directions import SIDES
from app.words.styles import full_title
from tests.helpers.synthetic import lambert_sphere_transport


def canvas(seed: int = 0, size: int = 64) -> Canvas:
    rng = np.random.default_rng(seed)
    return make_canvas(rng.uniform(-1, 1, (size, size)), rng.random((size, size)))


def same(one: UserStyle, other: UserStyle) -> bool:
    texts = ("name", "title", "side", "place", "note", "head", "origin")
    return all(getattr(one, key) == getattr(other, key) for key in texts) and bool(
        np.array_equal(one.weights, other.weights) and np.array_equal(one.ignore, other.ignore)
    )


def everything(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_a_style_comes_back_as_it_was(tmp_path: Path) -> None:
    saved = save_user_style(
        tmp_path / "styles",
        canvas(),
        "My Rembrandt",
        side="left",
        note='With "quotes", a \\ and ümlauts.',
        head="generic",
        origin="left-rembrandt",
    )
    assert saved.name == "my-rembrandt"
    styles, damaged = list_user_styles(tmp_path / "styles")
    assert not damaged
    assert len(styles) == 1
    assert same(styles[0], saved)
    assert full_title(saved.style) == f"My Rembrandt, {SIDES['left']}"
    assert saved.style.lamps == ()
    again = from_user_style(saved, lambert_sphere_transport())
    assert not again.touched
    text = text_path(tmp_path / "styles", saved.name).read_text(encoding="utf-8")
    assert 'title = "My Rembrandt"' in text
    assert 'from = "left-rembrandt"' in text


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.text(max_size=120))
def test_any_text_is_a_name_or_a_sentence(tmp_path: Path, title: str) -> None:
    folder = tmp_path / "any"
    usable = any(c.isprintable() and not c.isspace() for c in title) and len(title) <= 80
    try:
        saved = save_user_style(folder, canvas(size=16), title)
    except StyleError:
        assert not usable
        return
    assert text_path(folder, saved.name).parent == folder
    assert same(read_user_style(text_path(folder, saved.name)), saved)
    for path in folder.iterdir():
        path.unlink()


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("../../etc/passwd", "etc-passwd"),
        ("CON", "my-con"),
        ("Flat", "my-flat"),
        ("日本", "style"),
        ("Élan — café!", "elan-cafe"),
        ("a" * 80, "a" * 28),
    ],
)
def test_file_names_are_safe_everywhere(tmp_path: Path, title: str, name: str) -> None:
    assert save_user_style(tmp_path, canvas(size=16), title).name == name
    assert name not in NAMES


def test_names_and_titles_are_unique(tmp_path: Path) -> None:
    first = save_user_style(tmp_path, canvas(1), "My look")
    kept = everything(tmp_path)
    second = save_user_style(tmp_path, canvas(2), "MY LOOK")
    third = duplicate(tmp_path, second)
    assert [s.name for s in (first, second, third)] == ["my-look", "my-look-2", "my-look-3"]
    assert [s.title for s in (first, second, third)] == ["My look", "MY LOOK 2", "MY LOOK 3"]
    now = everything(tmp_path)
    assert {name: now[name] for name in kept} == kept
    np.testing.assert_array_equal(third.weights, second.weights)


def test_a_damaged_file_of_the_same_name_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("precious", encoding="utf-8")
    assert save_user_style(tmp_path, canvas(), "Mine").name == "mine-2"
    assert (tmp_path / "mine.toml").read_text(encoding="utf-8") == "precious"


def test_renaming_keeps_the_name_in_files(tmp_path: Path) -> None:
    one = save_user_style(tmp_path, canvas(1), "One")
    save_user_style(tmp_path, canvas(2), "Two")
    renamed = rename(tmp_path, one, "  A\tnew  name\n")
    assert (renamed.name, renamed.title) == ("one", "A new name")
    assert same(list_user_styles(tmp_path)[0][0], renamed)
    assert rename(tmp_path, renamed, "a NEW name").title == "a NEW name"
    with pytest.raises(StyleError, match="“two” is already taken"):
        rename(tmp_path, renamed, "two")
    with pytest.raises(StyleError, match="name is missing"):
        rename(tmp_path, renamed, " \x00 ")
    with pytest.raises(StyleError, match="longer"):
        rename(tmp_path, renamed, "x" * 81)


def test_deleting_and_getting_back(tmp_path: Path) -> None:
    style = save_user_style(tmp_path, canvas(), "Mine", side="right")
    trashed = delete(tmp_path, style)
    assert list_user_styles(tmp_path) == ((), ())
    assert trashed.title == "Mine"
    assert same(restore(tmp_path, trashed), style)
    assert same(list_user_styles(tmp_path)[0][0], style)
    # Meanwhile another one took the name.
    trashed = delete(tmp_path, style)
    other = save_user_style(tmp_path, canvas(5), "Mine")
    back = restore(tmp_path, trashed)
    assert (back.name, back.title) == ("mine-2", "Mine 2")
    assert same(list_user_styles(tmp_path)[0][0], other)
    with pytest.raises(StyleError, match="not deleted"):
        delete(tmp_path / "elsewhere", style)


def test_changed_weights_leave_the_old_ones_in_the_trash(tmp_path: Path) -> None:
    style = save_user_style(tmp_path, canvas(1), "Mine")
    assert update_user_style(tmp_path, style, canvas(1)) is style
    changed = update_user_style(tmp_path, style, canvas(2))
    assert same(list_user_styles(tmp_path)[0][0], changed)
    assert len(list(tmp_path.glob("*.exr"))) == 1
    old = read_user_style(tmp_path / "trash" / "mine" / "mine.toml")
    np.testing.assert_array_equal(old.weights, style.weights)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EDQUOT])
def test_a_full_disk_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    style = save_user_style(tmp_path, canvas(1), "Mine")
    kept = everything(tmp_path)

    def full(handle: int) -> None:
        raise OSError(number, os.strerror(number))

    with monkeypatch.context() as patch:
        patch.setattr("app.core.base.atomic_files.os.fsync", full)
        with pytest.raises(StyleError, match="Not saved") as found:
            save_user_style(tmp_path, canvas(2), "Other")
        with pytest.raises(StyleError, match="Not saved"):
            update_user_style(tmp_path, style, canvas(2))
    assert "strokes" in found.value.hint
    assert ("disk is full" in found.value.message) == (number != errno.EIO)
    assert everything(tmp_path) == kept


def test_killed_between_the_two_files_the_old_style_still_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    style = save_user_style(tmp_path, canvas(1), "Mine")

    def killed(path: Path, text: str) -> None:
        if path.parent == tmp_path:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("app.core.painting.user_style.atomic_write_text", killed)
        with pytest.raises(KeyboardInterrupt):
            update_user_style(tmp_path, style, canvas(2))
    assert same(list_user_styles(tmp_path)[0][0], style)


def test_damaged_styles_are_listed_and_left_alone(tmp_path: Path) -> None:
    good = save_user_style(tmp_path, canvas(1), "Good")
    texts = {
        "broken": "title = ",
        "empty": "",
        "newer": style_text(good).replace("format = 1", "format = 2"),
        "older": style_text(good).replace("format = 1", "format = 0"),
        "none": style_text(good).replace("format = 1\n", ""),
        "lonely": style_text(good),
        "strange": style_text(good) + "colour = 3\n",
        "path": style_text(good).replace('sha256 = "', 'sha256 = "../../'),
        "sideways": style_text(good).replace('side = "none"', 'side = "up"'),
        "sized": style_text(good).replace("size = 64", 'size = "64"'),
        "untitled": style_text(good).replace("Good", ""),
        "Upper": style_text(good),
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    kept = everything(tmp_path)
    styles, damaged = list_user_styles(tmp_path)
    assert [style.name for style in styles] == ["good"]
    reasons = {entry.path.stem: entry.reason for entry in damaged}
    assert set(reasons) == set(texts)
    assert damaged
    assert "(format 2)" in reasons["newer"]
    assert "format (0)" in reasons["older"]
    assert "missing" in reasons["lonely"]
    assert everything(tmp_path) == kept


@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_flipped_and_cut_weights_are_noticed(tmp_path: Path, data: st.DataObject) -> None:
    folder = tmp_path / "styles"
    if not folder.exists():
        save_user_style(folder, canvas(size=24), "Mine")
    layers = next(folder.glob("*.exr"))
    whole = layers.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    value = data.draw(st.integers(0, 255))
    damaged = data.draw(
        st.sampled_from([whole[:place], whole[:place] + bytes([value]) + whole[place + 1 :]])
    )
    layers.write_bytes(damaged)
    try:
        styles, bad = list_user_styles(folder)
        # Bytes that mean nothing (attributes) may differ; the weights may not.
        assert len(styles) + len(bad) == 1
        for style in styles:
            np.testing.assert_array_equal(style.weights, canvas(size=24).weights)
        assert layers.read_bytes() == damaged
    finally:
        layers.write_bytes(whole)


def test_hand_written_styles_and_painted_ones_share_the_folder(tmp_path: Path) -> None:
    save_user_style(tmp_path, canvas(), "Painted")
    lamp = "azimuth_deg = 10\nelevation_deg = 0\ndiameter_deg = 5\npower = 1\ndistance_m = 3\n"
    text = f'title = "Lamp"\nside = "left"\n[[lamps]]\n{lamp}'
    (tmp_path / "lamp.toml").write_text(text, encoding="utf-8")
    assert [style.name for style in load_styles(tmp_path)][len(NAMES) :] == ["lamp"]
    styles, damaged = list_user_styles(tmp_path)
    assert [style.name for style in styles] == ["painted"]
    assert not damaged


def test_no_folder_is_no_styles(tmp_path: Path) -> None:
    assert list_user_styles(tmp_path / "nowhere") == ((), ())


def test_more_styles_than_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.core.painting.user_styles._MAX_STYLES", 2)
    for title in "abc":
        save_user_style(tmp_path, canvas(size=16), title)
    styles, damaged = list_user_styles(tmp_path)
    assert [style.name for style in styles] == ["a", "b"]
    assert "more than 2 styles" in damaged[0].reason
