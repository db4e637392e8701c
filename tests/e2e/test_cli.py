"""``turnlight`` as a process: streams, interruption, speed of the help."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from app import cli
from app.core.base.errors import Cancelled

ROOT = Path(__file__).resolve().parents[2]
TURNLIGHT = [sys.executable, "-P", "-m", "app"]


def environment(**changes: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), **changes}


def turnlight(*arguments: str, cwd: Path, **changes: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*TURNLIGHT, *arguments],
        cwd=cwd,
        env=environment(**changes),
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


def test_works_from_any_folder_even_beside_another_app(tmp_path: Path) -> None:
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__init__.py").write_text("raise SystemExit(9)")
    done = turnlight("styles", "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    names = [style["name"] for style in json.loads(done.stdout)["styles"]]
    assert {"butterfly", "left-rembrandt", "right-loop-rim"} <= set(names)


def test_help_needs_no_library(tmp_path: Path) -> None:
    code = (
        "import sys; from app.cli import main; code = main(['--help']);"
        "heavy = {'numpy', 'cv2', 'OpenImageIO', 'mitsuba', 'PySide6'} & set(sys.modules);"
        "sys.exit(f'{heavy} imported' if heavy else code)"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    for name in ("solve", "render", "styles", "bake", "bench"):
        assert name in done.stdout


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_answers_are_utf_8_whatever_the_system_says(tmp_path: Path, encoding: str) -> None:
    done = turnlight("styles", cwd=tmp_path, PYTHONIOENCODING=encoding, PYTHONUTF8="0")
    assert (done.returncode, done.stderr) == (0, "")
    assert "°" in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="a shell and its pipes")
def test_reader_that_goes_away_is_no_error(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with subprocess.Popen(
        [*TURNLIGHT, "styles"],
        cwd=tmp_path,
        env=environment(),
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        os.close(writing)
        _, errors = process.communicate(timeout=600)
    assert (process.returncode, errors) == (0, "")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_ctrl_c_is_130_without_a_traceback(tmp_path: Path) -> None:
    with subprocess.Popen(
        [*TURNLIGHT, "bench"],
        cwd=tmp_path,
        env=environment(PYTHONUNBUFFERED="1"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Children of a shell's background job inherit "ignore".
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    ) as process:
        assert process.stderr is not None
        assert "%" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=600)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert errors.endswith("Stopped.\n")


@pytest.mark.parametrize("hint", ["", "The camera is still owed its settings."])
def test_what_is_left_to_do_after_stopping_is_said(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, hint: str
) -> None:
    def stopped(arguments: list[str]) -> int:
        raise Cancelled(hint=hint)

    monkeypatch.setattr(cli, "_dispatch", stopped)
    assert cli.main(["capture"]) == 130
    assert capsys.readouterr().err == f"Stopped. {hint}".rstrip() + "\n"


def shell(line: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    program = f'"{sys.executable}" -P -m app'
    return subprocess.run(
        ["/bin/sh", "-c", line.replace("turnlight", program)],
        cwd=cwd,
        env=environment(),
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a shell and a full device")
def test_an_answer_that_cannot_be_printed_is_an_error_in_one_line(tmp_path: Path) -> None:
    for line in ("turnlight styles >&-", "turnlight styles >/dev/full", "turnlight -h >/dev/full"):
        done = shell(line, tmp_path)
        assert done.returncode == 2, line
        assert done.stderr.startswith("turnlight: The result cannot be printed: ")
        assert done.stderr.count("\n") == 1
    # Only words are lost here.
    for line in ("turnlight styles 2>&-", "turnlight styles 2>/dev/full <&-"):
        done = shell(line, tmp_path)
        assert (done.returncode, done.stderr) == (0, ""), line
        assert "butterfly" in done.stdout
    assert shell("turnlight solve none.exr 2>&-", tmp_path).returncode == 2


@pytest.mark.skipif(os.name != "posix", reason="names of bytes")
def test_names_that_steer_a_terminal_are_shown_as_escapes(tmp_path: Path) -> None:
    name = os.fsdecode(b"red\x1b[31m\xff\xc2\x9b\ntwo.exr")
    done = turnlight("solve", name, cwd=tmp_path)
    assert done.returncode == 2
    escaped = r"red\u001b[31m\udcff\u009b\ntwo.exr"
    assert re.fullmatch(f"turnlight: .*{re.escape(escaped)}.*\n", done.stderr)
    (tmp_path / name).write_bytes(b"v/1\x01" + bytes(100))
    done = turnlight("solve", name, cwd=tmp_path)
    assert done.returncode == 2
    assert re.fullmatch(f"turnlight: {re.escape(escaped)} .*\n", done.stderr)


def test_what_libraries_say_of_a_damaged_file_stays_with_them(tmp_path: Path) -> None:
    good = (ROOT / "tests" / "data" / "near-field.npz").read_bytes()
    (tmp_path / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n" + good[:50])
    done = turnlight("align", "cut.png", "cut.png", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("turnlight: cut.png is damaged")
    assert done.stderr.count("\n") == 1
