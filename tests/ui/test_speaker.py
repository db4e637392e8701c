"""The loudspeaker: what it plays, and that it is silent in every way where there is none."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Generator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.ui.shell import notify as module
from app.ui.shell.notify import Speaker
from tests.helpers.waiting import PATIENCE_S, until

CODE = """
import numpy as np
from app.ui.shell.notify import Speaker
speaker = Speaker()
speaker.play(np.zeros(100, np.int16))
speaker.stop()
print(speaker.available)
"""
LOUD = np.arange(1, 1001, dtype=np.int16)
FRAMES = 400


class Device:
    """Asks for samples when a test wants it to."""

    broken = False

    def __init__(self) -> None:
        self.frames: Generator[bytes, int, None] | None = None
        self.started, self.stopped = threading.Event(), threading.Event()

    def start(self, frames: Generator[bytes, int, None]) -> None:
        if self.broken:
            raise OSError("unplugged")
        self.frames = frames
        self.stopped.clear()
        self.started.set()

    def stop(self) -> None:
        self.started.clear()
        self.stopped.set()

    def close(self) -> None:
        self.stopped.set()

    def heard(self) -> list[int]:
        assert self.started.wait(PATIENCE_S)
        assert self.frames is not None
        return list(np.frombuffer(self.frames.send(FRAMES), np.int16))


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Device:
    made = Device()
    monkeypatch.setattr(module, "_device", lambda: made)
    monkeypatch.setattr(module, "atexit", SimpleNamespace(register=lambda *_: None))
    return made


def heard(speaker: Speaker) -> bool:
    return speaker.available


def test_a_sound_is_played_once_and_the_next_one_cuts_it_off(device: Device) -> None:
    speaker = Speaker()
    assert speaker.available
    assert not device.started.is_set()
    speaker.play(LOUD)
    assert device.heard() == list(range(1, 401))
    speaker.play(LOUD, 0.5)
    assert device.heard() == [value // 2 for value in range(1, 401)]
    assert device.heard()[-1] == 400
    assert len(device.heard()) == 200, "the end of the sound"
    assert device.heard() == []
    speaker.play(LOUD)
    assert len(device.heard()) == FRAMES
    speaker.stop()
    assert device.heard() == []


@pytest.mark.parametrize(("volume", "last"), [(-1.0, 0), (0.0, 0), (2.0, 400)])
def test_volume_stays_between_silent_and_full(device: Device, volume: float, last: int) -> None:
    speaker = Speaker()
    speaker.play(LOUD, volume)
    assert device.heard()[-1] == last


def test_the_device_rests_when_nothing_is_played(
    device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_QUIET_S", 0.01)
    speaker = Speaker()
    for _ in range(3):
        speaker.play(LOUD[:10])
        assert device.stopped.wait(PATIENCE_S)
        device.stopped.clear()


def test_a_device_that_fails_leaves_silence(device: Device) -> None:
    device.broken = True
    speaker = Speaker()
    assert heard(speaker)
    speaker.play(LOUD)
    until(lambda: not heard(speaker))
    speaker.play(LOUD)


def test_without_the_library_there_is_no_sound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "miniaudio", None)
    assert not Speaker().available


@pytest.mark.parametrize("error", [OSError, RuntimeError])
def test_a_device_that_cannot_be_opened_is_none(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception]
) -> None:
    def fail(**_: Any) -> None:
        raise error("no device")

    miniaudio = pytest.importorskip("miniaudio")
    monkeypatch.setattr(miniaudio, "PlaybackDevice", fail)
    assert not Speaker().available


@pytest.mark.skipif(sys.platform != "linux", reason="sound servers are Linux's")
@pytest.mark.parametrize("left_behind", [False, True])
def test_without_a_sound_server_nothing_is_said(tmp_path: Path, left_behind: bool) -> None:
    if left_behind:
        (tmp_path / "pulse").mkdir()
        with socket.socket(socket.AF_UNIX) as line:
            line.bind(str(tmp_path / "pulse" / "native"))
    env = {key: value for key, value in os.environ.items() if not key.startswith("PULSE_")}
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**env, "XDG_RUNTIME_DIR": str(tmp_path), "HOME": str(tmp_path), "PATH": ""},
        cwd=Path(__file__).resolve().parents[2],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "False\n"


@pytest.mark.parametrize(
    ("system", "found"), [("linux", "espeak"), ("darwin", "say"), ("win32", "powershell")]
)
def test_the_systems_own_voice(monkeypatch: pytest.MonkeyPatch, system: str, found: str) -> None:
    """Its command is run with the words, or with them in the environment; nothing waits for it."""
    runs: list[tuple[tuple[str, ...], str]] = []
    done = threading.Event()

    def run(command: tuple[str, ...], env: dict[str, str], **_: Any) -> None:
        runs.append((command, env["TURNLIGHT_SAYS"]))
        done.set()

    monkeypatch.setattr(sys, "platform", system)
    there = {found: f"/bin/{found}"}
    monkeypatch.setattr(shutil, "which", there.get)
    monkeypatch.setattr(subprocess, "run", run)
    module._voice.cache_clear()
    speaker = Speaker()
    assert speaker.speaks
    speaker.say("You may move")
    assert done.wait(PATIENCE_S)
    ((command, words),) = runs
    assert words == "You may move"
    assert command[0] == f"/bin/{found}"
    assert (command[-1] == "You may move") is (system != "win32")
    module._voice.cache_clear()


def test_no_voice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    module._voice.cache_clear()
    assert not Speaker().speaks
    Speaker().say("Nothing is run")
    module._voice.cache_clear()
