"""Sentences with placeholders, plural forms, catalogues, and the language that tests layouts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from app.core import text
from app.core.base.catalogue import stretched
from app.core.base.errors import Cancelled
from app.core.text import TextError, set_language, tr, tr_plural

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def _english() -> Iterator[None]:
    yield
    set_language("en")


def write_mo(folder: Path, language: str, sentences: dict[str, str]) -> None:
    """A catalogue as `msgfmt` writes it: GNU gettext manual, "The Format of GNU MO Files"."""
    told = {"": "Content-Type: text/plain; charset=UTF-8\nPlural-Forms: nplurals=2; plural=n>1;\n"}
    pairs = sorted((told | sentences).items())
    keys, values = ([part.encode() for part in side] for side in zip(*pairs, strict=True))
    start = 28 + 16 * len(pairs)
    table, text = b"", b""
    for side in (keys, values):
        for part in side:
            table += len(part).to_bytes(4, "little") + (start + len(text)).to_bytes(4, "little")
            text += part + b"\0"
    head = [0x950412DE, 0, len(pairs), 28, 28 + 8 * len(pairs), 0, start]
    file = folder / "locale" / language / "LC_MESSAGES" / "turnlight.mo"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"".join(n.to_bytes(4, "little") for n in head) + table + text)


def test_english_is_the_source() -> None:
    assert tr("Nothing to undo.") == "Nothing to undo."
    assert tr("{left} of {all}", left=2, all="{3}") == "2 of {3}"
    assert tr("100 % {sure}") == "100 % {sure}"  # without values nothing is filled in


def test_a_catalogue_is_spoken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sentences = {
        "Turn {turn}": "Tourner de {turn}",
        "{count} frame\0{count} frames": "{count} photo\0{count} photos",
        "Wrong {name}": "Mauvais {nom}",
    }
    write_mo(tmp_path, "fr", sentences)
    monkeypatch.setattr(text, "resources", lambda: tmp_path)
    set_language("fr")
    assert tr("Turn {turn}", turn="96°") == "Tourner de 96°"
    assert [tr_plural("{count} frame", "{count} frames", n) for n in (0, 1, 2)] == [
        "0 photo", "1 photo", "2 photos",
    ]  # fmt: skip
    # A translator's slip shows English, not a traceback.
    assert tr("Wrong {name}", name="head") == "Wrong head"
    assert tr("Not translated yet") == "Not translated yet"


def test_an_unknown_language_is_refused() -> None:
    with pytest.raises(TextError, match="not available in 'xx'"):
        set_language("xx")
    assert tr("Still English") == "Still English"


def test_the_test_language_changes_all_but_placeholders_and_tags() -> None:
    set_language("test")
    shown = tr("Turn <b>{turn}</b> towards 3 o’clock &amp; hold", turn="left")
    assert "<b>left</b>" in shown
    assert "&amp;" in shown
    assert shown.startswith("[")
    assert shown.endswith("]")
    assert not set("adeghiklnortu") & set(stretched("A rather long English sentence.").lower())
    assert tr("{count} %", count=3) == "3 %"
    assert Cancelled().message == tr("Cancelled.") != "Cancelled."


@pytest.mark.parametrize("sentence", ["Save", "Save set sheet", "The panorama is " + "dark " * 20])
def test_the_test_language_is_forty_percent_longer(sentence: str) -> None:
    assert len(stretched(sentence)) >= 1.4 * len(sentence) - 1
    assert len(stretched(sentence)) <= 1.4 * len(sentence) + 3


def test_plural_forms_in_the_test_language() -> None:
    set_language("test")
    assert tr_plural("{count} step", "{count} steps", 1) == "[1 šţéþ]".replace("þ", "p")
    assert "šţépš" in tr_plural("{count} step", "{count} steps", 2)
