"""The table of settings, the values it takes, and the page that is made of it."""

from __future__ import annotations

import math
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.core.storage.settings import (
    SECTIONS,
    TABLE,
    Setting,
    Settings,
    SettingsError,
    SettingValueError,
    setting,
)
from app.core.styles.style_pack_file import pack_names
from app.words import settings as words
from tests.helpers.settings_page import PAGE, document

IDS = [entry.key for entry in TABLE]


def values_of(entry: Setting) -> st.SearchStrategy[object]:
    """Values that a setting takes."""
    if entry.kind == "toggle":
        return st.booleans()
    if entry.kind == "number":
        if entry.whole:
            return st.integers(int(entry.minimum), int(entry.maximum))
        return st.floats(entry.minimum, entry.maximum)
    if entry.kind == "choice":
        keys = list(entry.choices) or list(pack_names())
        return st.sampled_from(keys)
    if entry.kind == "folder":
        return st.sampled_from(["", "/home/me/Bilder und Töne", "C:\\Users\\me", "\\\\nas\\photos"])
    return st.sampled_from(["", "Zoë", "Anne-Marie d’Été", "家族 👨‍👩‍👧"])


def test_page_is_the_table() -> None:
    assert PAGE.read_text(encoding="utf-8") == document()


def test_page_names_every_setting_and_choice() -> None:
    page = document()
    for entry in TABLE:
        assert f"| {words.title(entry)} |" in page
        assert f"| `{entry.key}` |" in page
        assert all(f"{name} (`{key}`)" in page for key, name in words.choices(entry))


def test_settings_have_a_typed_field_for_every_line_and_no_other() -> None:
    assert [each.name for each in fields(Settings)] == [*IDS, "unknown"]
    for entry in TABLE:
        value = getattr(Settings(), entry.key)
        assert value == entry.default
        kinds = {"number": int if entry.whole else float, "toggle": bool}
        assert type(value) is kinds.get(entry.kind, str)


@pytest.mark.parametrize("entry", TABLE, ids=IDS)
def test_lines_are_complete(entry: Setting) -> None:
    assert words.title(entry)
    assert words.explanation(entry).endswith(".")
    assert len(words.choices(entry)) == len(entry.choices)
    assert entry.section in SECTIONS
    assert entry.check(entry.default) == entry.default
    if entry.kind == "number":
        assert entry.minimum < entry.maximum
        assert entry.step > 0
    if entry.kind == "choice":
        assert bool(entry.choices) != bool(entry.offers)
        assert len(set(entry.choices)) == len(entry.choices)


def test_keys_are_unique() -> None:
    assert len(set(IDS)) == len(IDS)


def test_what_was_agreed() -> None:
    assert Settings().objective == "picture"
    assert Settings(paper_mode=True).objective == "paper"
    assert Settings().camera_distance_m == 1.8
    assert Settings().camera_looks == "ask"
    assert Settings().head in pack_names()
    assert (setting("text_scale").minimum, setting("text_scale").maximum) == (1.0, 2.0)


@given(st.data())
def test_takes_what_it_offers(data: st.DataObject) -> None:
    entry = data.draw(st.sampled_from(TABLE))
    value = data.draw(values_of(entry))
    changed = Settings().with_(entry.key, value)
    assert changed.value(entry.key) == value
    others = [each.key for each in TABLE if each is not entry]
    assert all(changed.value(key) == Settings().value(key) for key in others)


BAD: dict[str, list[object]] = {
    "theme": ["purple", "", 1, None, True],
    "text_scale": [0.99, 2.01, math.nan, math.inf, True, "1", None, [1.0]],
    "sounds": [1, 0, "on", None],
    "webcam": [0.5, -1, 16, 10**400, "0"],
    "self_timer_s": [11, -1, 2.5],
    "head": ["", "a\nb", 3, "x" * 81],
    "sitter_name": ["x" * 81, 7],
    "places_folder": ["here", "../up", "/with\nline", "C:", 3, "/" + "x" * 5000],
}


@pytest.mark.parametrize(
    ("key", "value"), [(k, v) for k, values in BAD.items() for v in values], ids=str
)
def test_refuses_with_what_it_takes(key: str, value: object) -> None:
    with pytest.raises(SettingsError) as caught:
        Settings().with_(key, value)
    assert isinstance(caught.value, SettingValueError)
    assert caught.value.entry is setting(key)
    assert words.title(setting(key)) in words.takes(setting(key))
    with pytest.raises(SettingsError):
        Settings(**{key: value})  # type: ignore[arg-type]


def test_unknown_key_is_a_sentence() -> None:
    with pytest.raises(SettingsError, match="no setting 'colour'"):
        Settings().with_("colour", "red")
    with pytest.raises(SettingsError, match="no setting 'unknown'"):
        Settings().with_("unknown", {})
    with pytest.raises(SettingsError):
        Settings().value("unknown")


def test_texts_are_cleaned_to_one_line() -> None:
    assert Settings().with_("sitter_name", "  Zoë\t\u2028\x00 ").sitter_name == "Zoë"


def test_words_for_the_dialog() -> None:
    assert words.value_words(setting("camera_distance_m"), 1.8) == "1.8 m"
    angle = Setting("angle", "turning", "number", 65.0, maximum=150.0, unit="°")
    assert words.value_words(angle, 65.0) == "65°"
    assert words.value_words(setting("text_scale"), 1.25) == "1.25×"
    assert words.value_words(setting("volume"), 70.0) == "70%"
    assert words.value_words(setting("theme"), "contrast") == "High contrast"
    assert words.value_words(setting("places_folder"), "") == "Turnlight’s own folder"
    assert words.value_words(setting("sounds"), True) == "on"


def test_reset_leaves_what_is_remembered() -> None:
    changed = Settings().with_("theme", "light").with_("volume", 5).with_("tour_seen", True)
    assert changed.reset() == Settings().with_("tour_seen", True)
