"""Ctrl-C while a library is being imported: the import ends first, and then the program."""

from __future__ import annotations

import importlib
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from app import cli
from app.commands.shared.console import imports_whole
from app.core.base.atomic_files import atomic_write

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals as on POSIX")

LIBRARY = """
import signal
done = False
try:
    signal.raise_signal(signal.SIGINT)
    for _ in range(1000):
        pass
except BaseException as error:
    raise ImportError("the library did not start") from error
done = True
"""


@pytest.fixture
def library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A library during whose import Ctrl-C is pressed, and that makes an error of its own of it."""
    name = "slow_library_of_this_test"
    (tmp_path / f"{name}.py").write_text(LIBRARY)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, name, raising=False)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield name
    signal.signal(signal.SIGINT, before)
    sys.modules.pop(name, None)


def _use(library: str) -> None:
    importlib.import_module(library)
    time.sleep(60.0)


def test_an_import_ends_before_the_program(library: str) -> None:
    with pytest.raises(KeyboardInterrupt), imports_whole():
        _use(library)
    assert sys.modules[library].done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_without_it_the_library_says_something_else(library: str) -> None:
    with pytest.raises(ImportError):
        importlib.import_module(library)


def test_outside_of_imports_it_is_as_ever() -> None:
    with pytest.raises(KeyboardInterrupt), imports_whole():
        signal.raise_signal(signal.SIGINT)


def test_another_handler_and_another_thread_are_left_alone() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with imports_whole():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    seen: list[object] = []

    def elsewhere() -> None:
        with imports_whole():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [signal.getsignal(signal.SIGINT)]


def test_a_command_that_is_interrupted_in_an_import_says_so_and_ends_with_130(
    library: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def dispatch(arguments: list[str]) -> int:
        _use(library)
        return 0

    monkeypatch.setattr(cli, "_dispatch", dispatch)
    assert cli.main(["bake"]) == 130
    assert capsys.readouterr().err == "Stopped.\n"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_stopped_command_leaves_no_half_of_a_file(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "answer.txt"
    target.write_text("before")

    def work(_arguments: list[str]) -> int:
        def write(temporary: Path) -> None:
            temporary.write_text("half")
            signal.raise_signal(number)

        atomic_write(target, write)
        return 0

    monkeypatch.setattr(cli, "_dispatch", work)
    assert cli.main([]) == 128 + number
    assert [each.read_text() for each in tmp_path.iterdir()] == ["before"]
    assert cli.main([]) == 128 + number
