"""The window as a process: one for each data folder, ended by signals, and after a crash."""

from __future__ import annotations

import os
import signal
import stat
import sys
from pathlib import Path

import pytest

from app.core.base.paths import resources
from app.core.places.place_list import list_places
from app.core.storage.settings import Settings
from app.core.storage.settings_file import FILE, write_settings
from app.ui.shell.log import LAST_CRASH, LOGS
from tests.helpers.window_process import ended, log_of, start_window, wait_for, window

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals as on POSIX")

SCENE = resources() / "demo" / "scenes" / "studio.exr"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    folder = tmp_path / "home"
    write_settings(folder / FILE, Settings(tour_seen=True))
    return folder


def names(home: Path) -> list[str]:
    return [one.name for one in list_places(home / "places") if one.has_light]


def test_a_second_start_opens_its_file_in_the_first_window(home: Path) -> None:
    with window(home) as first:
        code, words = ended(start_window(home, SCENE))
        assert (code, len(words)) == (0, 1)
        assert "already open" in words[0]
        wait_for(lambda: names(home) == ["studio"])
        first.send_signal(signal.SIGTERM)
        assert ended(first)[0] == 128 + signal.SIGTERM
    assert log_of(home).count("start: Turnlight") == 1


@pytest.mark.slow
def test_a_killed_window_leaves_nothing_in_the_way(home: Path) -> None:
    with window(home) as first:
        first.kill()
        first.wait()
    with window(home) as second:
        second.send_signal(signal.SIGHUP)
        assert ended(second)[0] == 128 + signal.SIGHUP


def test_sigterm_saves_the_place_that_is_still_being_worked_out(home: Path) -> None:
    with window(home, SCENE) as process:
        wait_for(lambda: bool(names(home)))
        process.send_signal(signal.SIGTERM)
        assert ended(process)[0] == 128 + signal.SIGTERM
    (place,) = list_places(home / "places")
    assert (place.state, place.has_light) == ("whole", True)
    assert "end: exit code 143" in log_of(home)


@pytest.mark.slow
def test_a_crash_is_told_at_the_next_start_and_only_there(home: Path) -> None:
    with window(home) as process:
        process.send_signal(signal.SIGSEGV)
        assert ended(process)[0] == -signal.SIGSEGV
    for _ in range(2):
        with window(home) as process:
            process.send_signal(signal.SIGTERM)
            ended(process)
    assert log_of(home).count("Turnlight crashed last time") == 1
    crash = home / LOGS / LAST_CRASH
    assert "Segmentation fault" in crash.read_text()
    assert stat.S_IMODE(os.stat(crash).st_mode) == 0o600
