"""What is said before any window is opened."""

from __future__ import annotations

import ctypes
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from app.cli import main
from app.devices.screen_check import DesktopError, check_display, missing_library

ROOT = Path(__file__).resolve().parents[2]

ONLY_LINUX = pytest.mark.skipif(sys.platform != "linux", reason="others always have a display")

# What glibc's loader said, each library hidden in turn, on Debian 12.
LOADER = [
    ("libxcb-cursor.so.0", "libxcb-cursor0", "xcb-util-cursor"),
    ("libxcb-icccm.so.4", "libxcb-icccm4", "xcb-util-wm"),
    ("libxcb-image.so.0", "libxcb-image0", "xcb-util-image"),
    ("libxcb-keysyms.so.1", "libxcb-keysyms1", "xcb-util-keysyms"),
    ("libxcb-render-util.so.0", "libxcb-render-util0", "xcb-util-renderutil"),
    ("libxkbcommon-x11.so.0", "libxkbcommon-x11-0", "libxkbcommon-x11"),
    ("libEGL.so.1", "libegl1", "libglvnd-egl"),
    ("libGL.so.1", "libgl1", "libglvnd-glx"),
    ("libfontconfig.so.1", "libfontconfig1", "fontconfig"),
    ("libdbus-1.so.3", "libdbus-1-3", "dbus-libs"),
    ("libglib-2.0.so.0", "libglib2.0-0", "glib2"),
    ("libX11-xcb.so.1", "libx11-xcb1", "libX11-xcb"),
]


def test_without_a_display_that_is_said() -> None:
    with pytest.raises(DesktopError, match="no display"):
        check_display({}, "linux")


@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_windows_and_macos_always_have_one(platform: str) -> None:
    assert check_display({}, platform) is None


@ONLY_LINUX
def test_drawing_in_memory_needs_none() -> None:
    assert check_display({"QT_QPA_PLATFORM": "offscreen"}, "linux") is None
    assert check_display({"QT_QPA_PLATFORM": "offscreen:enable_fonts"}, "linux") is None


@ONLY_LINUX
@pytest.mark.parametrize(
    ("env", "named"),
    [
        ({"DISPLAY": ":9999"}, "The display :9999 (DISPLAY)"),
        ({"QT_QPA_PLATFORM": "xcb"}, "DISPLAY is not set"),
        ({"WAYLAND_DISPLAY": "wayland-9"}, "The display wayland-9 (WAYLAND_DISPLAY)"),
        ({"XDG_SESSION_TYPE": "wayland"}, "The display wayland-0 (WAYLAND_DISPLAY)"),
        ({"WAYLAND_DISPLAY": "wayland-9", "DISPLAY": ":9999"}, "The display :9999 (DISPLAY)"),
        ({"QT_QPA_PLATFORM": "nonsense"}, "QT_QPA_PLATFORM is set to 'nonsense'"),
    ],
)
def test_a_display_that_does_not_answer_ends_with_a_sentence_and_code_3(
    env: dict[str, str], named: str, tmp_path: Path
) -> None:
    """In a process of its own: where Qt is asked first, it ends the process by SIGABRT."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM", "XDG_SESSION_TYPE")
    plain = {key: value for key, value in os.environ.items() if key not in names}
    # A socket that nothing listens at is there, as one is that was left behind.
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(tmp_path / "wayland-9"))
    done = subprocess.run(
        [sys.executable, "-P", "-m", "app"],
        env={**plain, "XDG_RUNTIME_DIR": str(tmp_path), **env},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stdout) == (3, ""), done.stderr
    assert named in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert "turnlight solve" in done.stderr


@pytest.mark.parametrize(("library", "debian", "fedora"), LOADER)
def test_a_missing_library_is_named_with_its_package(
    monkeypatch: pytest.MonkeyPatch, library: str, debian: str, fedora: str
) -> None:
    said = f"{library}: cannot open shared object file: No such file or directory"

    def load(name: str) -> object:
        if name == library:
            raise OSError(said)
        return object()

    monkeypatch.setattr(ctypes, "CDLL", load)
    lines = str(missing_library(said)).splitlines()
    assert library in lines[0]
    # Copied as they are: nothing comes after the packages, and nothing else is among them.
    assert lines[1].endswith(f"sudo apt install {debian}")
    assert lines[2].endswith(f"sudo dnf install {fedora}")


def test_all_that_is_missing_is_named_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    gone = ("libEGL.so.1", "libxcb-cursor.so.0")

    def load(name: str) -> object:
        if name in gone or name == "libxcb-xkb.so.1":
            lacks = name if name in gone else gone[0]
            raise OSError(f"{lacks}: cannot open shared object file: No such file or directory")
        return object()

    monkeypatch.setattr(ctypes, "CDLL", load)
    words = str(missing_library("libEGL.so.1: cannot open shared object file: No such file"))
    assert "sudo apt install libegl1 libxcb-cursor0\n" in words


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (
            "/lib/x86_64-linux-gnu/libc.so.6: version `GLIBC_2.34' not found (required by "
            "/home/me/.venv/lib/python3.11/site-packages/PySide6/Qt/lib/libQt6Core.so.6)",
            "too old for Turnlight’s libraries: GLIBC_2.34",
        ),
        ("/lib/x86_64-linux-gnu/libEGL.so.1: file too short", "install --reinstall libegl1"),
        ("libmystery.so.2: cannot open shared object file", "Install the package"),
        ("libQt6Gui.so.6: undefined symbol: _ZN7qt_oops", "undefined symbol"),
    ],
)
def test_other_words_of_the_loader(said: str, words: str) -> None:
    assert words in str(missing_library(said))


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
