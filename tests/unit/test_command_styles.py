"""``turnlight styles``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import pytest

from app.commands import styles as command
from app.core.base.errors import StyleError
from app.core.styles.styles import NAMES, load_styles
from app.words.phrases.directions import SIDES


def run(*words: str) -> int:
    """Run the command as the command line does."""
    parser = argparse.ArgumentParser()
    command.add_arguments(parser)
    args = parser.parse_args(words)
    return int(args.run(args))


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TURNLIGHT_HOME", str(tmp_path))


def test_json_has_the_promised_keys(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--json") == 0
    values = json.loads(capsys.readouterr().out)["styles"]
    assert [style["name"] for style in values] == list(NAMES)
    for style in values:
        assert {"name", "title", "side", "lamps", "paper"} <= set(style)
        assert style["side"] in ("left", "right", "none")
        for lamp in style["lamps"]:
            assert set(lamp) == {
                "azimuth_deg",
                "elevation_deg",
                "diameter_deg",
                "power",
                "distance_m",
            }
            assert lamp["distance_m"] >= 2.0


def test_table_names_every_style_and_both_sides(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 0
    lines = capsys.readouterr().out.splitlines()
    lamps = sum(len(style.lamps) for style in load_styles())
    assert len(lines) == 1 + lamps + 2
    for name in NAMES:
        assert any(line.startswith(f"{name} ") for line in lines)
    (line,) = (line for line in lines if line.startswith("left-split "))
    assert SIDES["left"] in line
    assert "+90°" in line
    assert "−35°" in command.as_table([s for s in load_styles() if s.name == "clamshell"])


def test_own_styles_are_listed_and_bad_ones_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "styles"
    folder.mkdir()
    lamp = "azimuth_deg=1\nelevation_deg=2\ndiameter_deg=3\npower=1\ndistance_m=2"
    (folder / "mine.toml").write_text(f'title="Mine"\nside="left"\n[[lamps]]\n{lamp}\n')
    assert run("--json") == 0
    assert json.loads(capsys.readouterr().out)["styles"][-1]["name"] == "mine"
    (folder / "mine.toml").write_text("title=")
    with pytest.raises(StyleError, match=r"mine\.toml"):
        run()
