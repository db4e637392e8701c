"""What is said before any window is opened."""

from __future__ import annotations

import ctypes.util
import sys
from typing import TYPE_CHECKING

import pytest

from app.cli import main
from app.desktop import display_problem

if TYPE_CHECKING:
    from pathlib import Path


def test_without_a_display_that_is_said() -> None:
    words = display_problem({}, "linux")
    assert words is not None
    assert "no display" in words


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_windows_and_macos_always_have_one(platform: str) -> None:
    assert display_problem({}, platform) is None


def test_drawing_in_memory_needs_none() -> None:
    assert display_problem({"QT_QPA_PLATFORM": "offscreen"}, "linux") is None
    assert display_problem({"WAYLAND_DISPLAY": "wayland-0"}, "linux") is None


def test_a_missing_library_is_named_with_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        ctypes.util, "find_library", lambda name: None if name == "xcb-cursor" else f"{name}.so"
    )
    words = display_problem({"DISPLAY": ":0"}, "linux")
    assert words is not None
    assert "libxcb-cursor" in words
    assert "sudo apt install libxcb-cursor0" in words


@pytest.mark.skipif(sys.platform != "linux", reason="others always have a display")
def test_the_command_ends_with_a_sentence_where_there_is_no_display(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    assert main([]) == 2
    captured = capsys.readouterr()
    assert "There is no display here" in captured.err
    assert "turnlight solve" in captured.err
    assert captured.out == ""


def test_pictures_are_made_of_the_demo_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--screenshots", str(tmp_path)]) == 2
    assert "--demo" in capsys.readouterr().err


def test_the_windows_options_are_told_apart_from_commands(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--theme", "styles"]) == 2
    assert "choose from" in capsys.readouterr().err
