"""The command line's own work: dispatch, errors to exit codes, streams."""

from __future__ import annotations

import argparse
import importlib
import types
from typing import TYPE_CHECKING

import pytest

from app import __version__, cli, desktop
from app.core.base.errors import Cancelled, CoreError, StyleError
from app.devices.errors import DeviceError, DownloadFailed

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Install = Callable[[Callable[[argparse.Namespace], int]], None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Make ``turnlight fake [--count N]`` do what a test wants."""

    def install_run(run: Callable[[argparse.Namespace], int]) -> None:
        module = types.ModuleType("app.commands.fake")

        def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
            parser = subparsers.add_parser("fake", help="nothing")
            parser.add_argument("--count", type=int, default=0)
            parser.set_defaults(run=run)

        module.__dict__["add_parser"] = add_parser
        monkeypatch.setitem(importlib.import_module("sys").modules, module.__name__, module)
        monkeypatch.setattr(cli, "COMMANDS", {"fake": "nothing", "other": "something"})

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

    def start(wishes: desktop.LaunchOptions) -> int:
        opened.append(wishes)
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


@pytest.mark.parametrize("name", list(cli.COMMANDS))
def test_overview_says_what_the_command_says_of_itself(name: str) -> None:
    parser = argparse.ArgumentParser()
    subparsers = parser.add_subparsers()
    importlib.import_module(f"app.commands.{name.replace('-', '_')}").add_parser(subparsers)
    own = {action.dest: action.help for action in subparsers._choices_actions}
    assert own == {name: cli.COMMANDS[name]}
    chosen = subparsers.choices[name]
    inner = [one.choices for one in chosen._actions if isinstance(one, argparse._SubParsersAction)]
    for each in inner[0].values() if inner else [chosen]:
        assert callable(each.get_default("run"))
