"""The command line's own work: dispatch, errors to exit codes, streams."""

from __future__ import annotations

import argparse
import importlib
import subprocess
import sys
import types
from typing import TYPE_CHECKING

import pytest

from app import __version__, cli, desktop
from app.commands.shared.instruments import INSTRUMENTS
from app.core.base.errors import Cancelled, CoreError, StyleError
from app.core.text import set_language, tr
from app.devices.errors import DeviceError, DownloadFailed

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    Install = Callable[[Callable[[argparse.Namespace], int]], None]


@pytest.fixture(autouse=True)
def _english() -> Iterator[None]:
    yield
    set_language("en")


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Make ``turnlight fake [--count N]`` do what a test wants."""

    def install_run(run: Callable[[argparse.Namespace], int]) -> None:
        module = types.ModuleType("app.commands.fake")

        def add_arguments(parser: argparse.ArgumentParser) -> None:
            parser.add_argument("--count", type=int, default=0)
            parser.set_defaults(run=run)

        module.__dict__["add_arguments"] = add_arguments
        monkeypatch.setitem(importlib.import_module("sys").modules, module.__name__, module)
        lines = {"fake": "nothing", "other": "something"}
        monkeypatch.setattr(cli, "command_lines", lambda: lines)

    return install_run


def raising(error: BaseException) -> Callable[[argparse.Namespace], int]:
    def run(args: argparse.Namespace) -> int:
        raise error

    return run


def interrupted_import() -> BaseException:
    """What comes of Ctrl-C in the import of a library in C: CPython's error, then the library's."""
    inner = SystemError("<built-in function __import__> returned a result with an exception set")
    inner.__cause__ = KeyboardInterrupt()
    error = NameError("name '_drjit_ext' is not defined")
    error.__context__ = inner
    return error


def test_command_gets_its_arguments_and_gives_the_code(install: Install) -> None:
    install(lambda args: int(args.count))
    assert cli.main(["fake", "--count", "3"]) == 3
    assert cli.main(["fake"]) == 0


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [
        (CoreError("It is empty.", "Copy it."), 2, "turnlight: It is empty. Copy it.\n"),
        (StyleError("No style x."), 2, "turnlight: No style x.\n"),
        (Cancelled(), 130, "Stopped.\n"),
        (KeyboardInterrupt(), 130, "Stopped.\n"),
        (PermissionError(13, "Permission denied", "a.exr"), 2, "turnlight: a.exr: Permission de"),
        (OSError(28, "No space left on device"), 2, "turnlight: No space left on device.\n"),
        (OSError("odd"), 2, "turnlight: odd.\n"),
        (OSError(), 2, "turnlight: OSError.\n"),
        (BrokenPipeError(32, "Broken pipe"), 0, ""),
        (DeviceError("It does not answer."), 3, "turnlight: It does not answer.\n"),
        (DownloadFailed("No room.", code="disk-full"), 2, "turnlight: No room.\n"),
        (interrupted_import(), 130, "Stopped.\n"),
    ],
)
def test_errors_become_a_sentence_and_a_code(
    install: Install,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    words: str,
) -> None:
    install(raising(error))
    assert cli.main(["fake"]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(words)
    assert printed.err.count("\n") == (1 if words else 0)


def test_a_mistake_of_ours_is_not_hidden(install: Install) -> None:
    install(raising(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        cli.main(["fake"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing-known"], "invalid choice: 'nothing-known'"),
        (["fake", "--count", "many"], "turnlight fake: argument --count: invalid int value"),
        (["fake", "--bad"], "unrecognized arguments: --bad"),
        (["fake", "--count=--"], "argument --count: expected a value"),
        (["--bad"], "--bad"),
    ],
)
def test_bad_usage_is_one_line_and_2(
    install: Install, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    install(lambda args: 0)
    assert cli.main(arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""


def test_no_command_opens_the_window(
    install: Install, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    install(lambda args: 1)
    opened: list[desktop.LaunchOptions] = []

    def start(options: desktop.LaunchOptions, walk: object) -> int:
        opened.append(options)
        return 0

    monkeypatch.setattr(desktop, "start", start)
    assert cli.main([]) == 0
    pictures = ["--demo", "--screenshots", str(tmp_path), "--theme", "light", "--scale", "2"]
    assert cli.main(pictures) == 0
    assert opened == [desktop.LaunchOptions(), desktop.LaunchOptions(True, tmp_path, "light", 2)]


def test_help_and_version_end_well(install: Install, capsys: pytest.CaptureFixture[str]) -> None:
    install(lambda args: 1)
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"turnlight {__version__}\n"
    assert cli.main(["fake", "--help"]) == 0
    assert "--count" in capsys.readouterr().out


def test_every_command_has_a_line_of_help() -> None:
    assert tuple(cli.command_lines()) == cli.COMMANDS


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_says_what_it_does_and_runs(name: str) -> None:
    parser = argparse.ArgumentParser()
    cli.command_module(name).add_arguments(parser)
    assert parser.description
    inner = [one.choices for one in parser._actions if isinstance(one, argparse._SubParsersAction)]
    for each in inner[0].values() if inner else [parser]:
        assert callable(each.get_default("run"))


@pytest.mark.parametrize(
    "arguments",
    [
        ["--language", "test", "fake"],
        ["--language=test", "fake", "--count", "0"],
        ["fake", "--count", "0", "--language", "test"],
    ],
)
def test_the_language_is_set_before_the_command_runs(
    install: Install, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> None:
    def run(args: argparse.Namespace) -> int:
        print(tr("Turn"))
        return int(args.count)

    install(run)
    assert cli.main(arguments) == 0
    assert capsys.readouterr().out == "[Ţûŕñ]\n"
    assert cli.main(["fake"]) == 0
    assert capsys.readouterr().out == "Turn\n"


def test_an_unknown_language_is_one_sentence(
    install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    install(lambda args: 0)
    assert cli.main(["--language", "klingon", "fake"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("turnlight: ")
    assert "'klingon'" in said
    assert said.endswith("en, test.\n")
    assert said.count("\n") == 1
    assert cli.main(["--language"]) == 2
    assert "argument --language: expected one argument" in capsys.readouterr().err


def test_no_words_are_read_before_the_language_is_set() -> None:
    code = (
        "from app.core.base import catalogue\n"
        "said = []\n"
        "catalogue.tr = catalogue.tr_plural = lambda *words, **values: said.append(words) or ''\n"
        "import app.core.text as text\n"
        "text.tr, text.tr_plural = catalogue.tr, catalogue.tr_plural\n"
        "import app.cli\n"
        "assert not said, said\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_help_of_every_command_speaks_the_language(capsys: pytest.CaptureFixture[str]) -> None:
    for name in cli.COMMANDS:
        if name in INSTRUMENTS:
            continue
        assert cli.main(["--language", "test", name, "--help"]) == 0
        words = capsys.readouterr().out
        assert "\n\n[" in words, name
