"""Too little memory ends in a sentence with the true reason, never in an abort of a library."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import cv2
import pytest

from app import cli
from app.cli import COMMANDS
from app.core.base.errors import CoreError
from app.core.base.memory import MemoryShort, check_limit, is_memory_short
from app.core.base.paths import resources
from app.ui.shell.notify import Notify
from tests.helpers.cases import sample_first

ROOT = Path(__file__).resolve().parents[2]
SCENE = str(resources() / "demo" / "scenes" / "studio.exr")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="limits as Linux has them")
SHORT = str(MemoryShort())


def limited(kilobytes: int, *words: str, home: Path) -> subprocess.CompletedProcess[str]:
    script = f'ulimit -v {kilobytes}; exec "$@"'
    return subprocess.run(
        ["bash", "-c", script, "bash", sys.executable, "-P", "-m", "app", *words],
        cwd=home,
        env={
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "QT_QPA_PLATFORM": "offscreen",
            "TURNLIGHT_HOME": str(home / "home"),
        },
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@LINUX
@pytest.mark.parametrize(
    "command", [(), (SCENE,), ("--demo",), ("solve", SCENE), ("film", "x.mp4")]
)
def test_limit_below_the_need_is_told_before_anything_is_loaded(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    done = limited(600_000, *command, home=tmp_path)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert "may use only 585 MB of memory" in done.stderr
    assert "ulimit -v" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@LINUX
@pytest.mark.slow
@pytest.mark.parametrize(
    "kilobytes", sample_first([300_000, 120_000, 600_000, 200_000, 400_000], 2)
)
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_is_ended_by_a_library(command: str, kilobytes: int, tmp_path: Path) -> None:
    done = limited(kilobytes, command, SCENE, home=tmp_path)
    assert done.returncode in (0, 2), (done.returncode, done.stderr)
    assert "Traceback" not in done.stderr


@LINUX
def test_help_works_in_little_memory(tmp_path: Path) -> None:
    done = limited(600_000, "--version", home=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_no_limit_is_no_error() -> None:
    check_limit(1)


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
        RuntimeError("can't start new thread"),
        ImportError("libx.so.1: failed to map segment from shared object"),
        cv2.error("OpenCV(5.0.0) alloc.cpp:73: error: (-4:Insufficient memory) Failed to allocate"),
        RuntimeError("std::bad_alloc"),
    ],
)
def test_every_form_of_short_memory_is_one_sentence(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> int:
        raise error

    monkeypatch.setattr(cli, "_dispatch", fail)
    assert cli.main(["solve"]) == 2
    assert capsys.readouterr().err == f"turnlight: {SHORT}\n"
    notify = Notify(lambda: datetime(2026, 11, 29, tzinfo=UTC))
    notify.tell_error(error)
    assert [message.text for message in notify.messages] == [SHORT]


def test_other_errors_are_not_short_memory() -> None:
    assert not is_memory_short(RuntimeError("out of range"))
    assert not is_memory_short(CoreError("There is not enough memory card."))
    assert not is_memory_short(OSError(errno.ENOSPC, "No space left on device"))
    outer = RuntimeError("a job failed")
    outer.__cause__ = MemoryError()
    assert is_memory_short(outer)
