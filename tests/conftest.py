"""No test touches what the person at this machine keeps: settings, cameras, passwords."""

from __future__ import annotations

import os
import signal

# A shell that starts this in the background makes it deaf to Ctrl-C, and what it starts, too;
# some tests press Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup

# As the app itself does it (`app.cli`), before anything imports numpy: where the tests run in
# several processes, threads that wait for each other only take the processors from the others.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Before anything imports Qt: the platform is chosen when the application is made.
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from collections.abc import Generator, Iterator
from typing import Final

import pytest
from pytestqt.qtbot import QtBot

# In this order: a module that another one has imported cannot be a plugin any more.
pytest_plugins = ["tests.plugins.workers", "tests.plugins.progress", "tests.plugins.memory"]


for _wait in (QtBot.waitUntil, QtBot.waitSignal, QtBot.waitSignals):
    # Five seconds are not enough for a slow machine; nothing that works waits as long as this.
    if _wait.__kwdefaults__ is not None:
        _wait.__kwdefaults__["timeout"] = 120_000


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their markers
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Make some kinds of tests slow, and refuse a quick test that wants to be alone."""
    for item in items:
        if any(map(item.get_closest_marker, ("sweep", "llvm", "mitsuba"))):
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("alone") and not item.get_closest_marker("slow"):
            raise pytest.UsageError(f"{item.nodeid} is marked 'alone' and not 'slow'.")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Escape bytes of file names in captured output: other processes send reports as UTF-8."""
    report = yield
    report.sections = [
        (name, text.encode("utf-8", "backslashreplace").decode()) for name, text in report.sections
    ]
    return report


@pytest.fixture(scope="session", autouse=True)
def nobodys_home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A data folder and a keyring of the tests' own, for them and for what they start."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TURNLIGHT_HOME", str(tmp_path_factory.mktemp("home")))
        patch.setenv("PYTHON_KEYRING_BACKEND", "keyring.backends.null.Keyring")
        yield


@pytest.fixture(scope="session", autouse=True)
def application(qapp: object) -> None:
    """One application for all: what draws a sheet would make one that widgets cannot use."""
    del qapp


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs LLVM where Mitsuba finds none; to look for it loads it, 80 MB."""
    if item.get_closest_marker("llvm"):
        from app.core.baking.kernel_lanes import find_llvm

        if find_llvm() is None:
            pytest.skip("needs LLVM 16 or newer")


_SCREENS: Final = ("tests/ui/", "tests/unit/test_presenter_")


@pytest.fixture(scope="module", autouse=True)
def quick_screens(request: pytest.FixtureRequest) -> Iterator[None]:
    """In files about screens read each head once, and draw it small."""
    with pytest.MonkeyPatch.context() as patch:
        if request.node.nodeid.startswith(_SCREENS):
            from tests.helpers.quick_screens import make_quick

            make_quick(patch)
        yield


@pytest.fixture(autouse=True)
def real_heads(
    quick_screens: None, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Read and draw as the program does where that is the subject, or time is measured."""
    del quick_screens
    if any(map(request.node.get_closest_marker, ("full_size", "alone"))):
        from tests.helpers.quick_screens import make_real

        make_real(monkeypatch)


@pytest.fixture
def best_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Offer the best turns themselves instead of the middles of their arcs."""
    from app.core.solver import turn_choice

    monkeypatch.setattr(turn_choice, "PRICE", 0.0)
