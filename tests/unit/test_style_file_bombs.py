"""Style files that are made to break their reader are refused with the reason, in one sentence."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from app.cli import main
from app.core.base.errors import StyleError
from app.core.base.paths import resources
from app.core.painting.user_styles import list_user_styles
from app.core.styles.painted_style_file import is_painted, read_painted
from app.core.styles.style_file import read_style

SOUND = (resources() / "styles" / "left-loop.toml").read_text(encoding="utf-8")
LAMP = "azimuth_deg = {}\nelevation_deg = 0\ndiameter_deg = 9\npower = 1\ndistance_m = 3\n"
PAINTED = 'title = "x"\nside = "left"\n[painted]\nsha256 = "0"\nformat = {}\n'
DIGITS = "too many digits"
DEEP = "nested too deeply"

BOMBS: dict[str, tuple[str, str]] = {
    "digits": (f"a = {'9' * 5000}\n", DIGITS),
    "digits below zero": (f"a = -{'9' * 4301}\n", DIGITS),
    "digits with signs between": (f"a = {'_'.join('9' * 5000)}\n", DIGITS),
    "digits of base 16": (f"a = 0x{'f' * 60_000}\n", DIGITS),
    "digits of base 8": (f"a = 0o{'7' * 60_000}\n", DIGITS),
    "digits of base 2": (f"a = 0b{'1' * 60_000}\n", DIGITS),
    "digits in a list": (f"a = [1, [{'9' * 400}]]\n", DIGITS),
    "digits in a painted style": (PAINTED.format("9" * 300), DIGITS),
    "digits in a lamp": ("[[lamps]]\n" + LAMP.format("9" * 400), DIGITS),
    "lists": ("a = " + "[" * 20_000, DEEP),
    "whole lists": ("a = " + "[" * 60 + "]" * 60, DEEP),
    "tables": ("a = " + "{b = " * 9000, DEEP),
    "dotted keys": ("side" + ".a" * 1500 + " = 1\n", DEEP),
    "dotted tables": ("[side" + ".a" * 1500 + "]\n", DEEP),
    "very many dots": ("side" + ".a" * 20_000 + " = 1\n", "too large"),
    "a long key": (f"{'k' * 60_000} = 1\n", "unknown key"),
    "a long side": (f'title = "x"\nside = "{"l" * 60_000}"\n', "side must be"),
    "a side that is a table": ('title = "x"\nside = {a = 1}\n', "side must be"),
    "a side that is a list": ("side = [1]\n", "side must be"),
    "an area that is a list": (
        re.sub(r'bright = ("[^"]*")', r"bright = [\1]", SOUND),
        "unknown area",
    ),
    "a float without end": (f"a = 1.{'0' * 60_000}1\n", "unknown key"),
    "an exponent": ("title = 'x'\nside = 'left'\n[[lamps]]\n" + LAMP.format("1e99999"), "finite"),
    "no number": ("title = 'x'\nside = 'left'\n[[lamps]]\n" + LAMP.format("nan"), "finite"),
    "a month 13": ("a = 2026-13-01\n", "not valid TOML"),
    "a byte order mark": ("\ufefftitle = 'x'\n", "not valid TOML"),
    "a bell": ("title = '\a'\n", "not valid TOML"),
    "a turn of writing": ("title = 'x\u202egnp'\nside = 'left'\n", "cannot be displayed"),
    "a cut text": ('title = "', "not valid TOML"),
}


@pytest.mark.parametrize("read", [read_style, read_painted])
@pytest.mark.parametrize("case", BOMBS)
def test_bomb_is_refused_in_one_sentence(
    case: str, read: Callable[[Path], object], tmp_path: Path
) -> None:
    text, words = BOMBS[case]
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(StyleError) as caught:
        read(path)
    assert len(str(caught.value)) < 1000
    assert "\n" not in str(caught.value)
    if read is read_style:
        assert words in str(caught.value)
    assert is_painted(path) in (True, False)


@pytest.mark.parametrize("case", ["digits", "digits of base 16", "dotted keys", "lists"])
def test_bomb_in_the_library_is_one_damaged_style(case: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(BOMBS[case][0], encoding="utf-8")
    styles, damaged = list_user_styles(tmp_path)
    assert not styles
    assert len(damaged) <= 1


@pytest.mark.parametrize("case", ["digits", "digits of base 16", "dotted keys", "lists"])
def test_command_ends_with_code_2_and_the_reason(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path / "home"))
    path = tmp_path / "home" / "styles" / "mine.toml"
    path.parent.mkdir(parents=True)
    path.write_text(BOMBS[case][0], encoding="utf-8")
    assert main(["styles"]) == 2
    assert BOMBS[case][1] in capsys.readouterr().err
