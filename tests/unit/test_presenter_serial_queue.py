"""Work in turn: nothing that was asked for is left out, and one failure stops nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from unittest.mock import MagicMock

import pytest

from app.core.base.progress import Token, silent
from app.ui.presenters.file_changes import SerialQueue


class Held:
    """Keeps work until it is let go; newer work of a key takes the older one's place."""

    def __init__(self) -> None:
        self.jobs: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {}

    def submit(self, key: str, work: Callable[..., Any], **calls: Any) -> None:
        assert key not in self.jobs, "it would cancel what is running"
        self.jobs[key] = (work, calls)

    def go(self) -> None:
        """Let what runs end."""
        work, calls = self.jobs.pop("files")
        try:
            answer = work(Token(), silent)
        except ValueError as error:
            calls["failed"](error)
        else:
            calls["done"](answer)

    def stop(self) -> None:
        """Cancel what runs."""
        self.jobs.pop("files")[1]["cancelled"]()


@pytest.fixture
def held() -> tuple[Held, SerialQueue, MagicMock]:
    services = MagicMock()
    services.runner = runner = Held()
    return runner, SerialQueue(services, "files"), services.notify


def test_two_that_are_asked_for_at_once_are_both_done(
    held: tuple[Held, SerialQueue, MagicMock],
) -> None:
    runner, turns, _ = held
    ended: list[str] = []
    for name in ("one", "two"):
        turns.submit(lambda token, report, name=name: name, done=ended.append)  # type: ignore[misc]
    runner.go()
    runner.go()
    assert (ended, runner.jobs) == (["one", "two"], {})


def test_a_failure_is_told_and_the_next_is_done_all_the_same(
    held: tuple[Held, SerialQueue, MagicMock],
) -> None:
    runner, turns, notify = held
    ended: list[str] = []

    def fail(token: Token, report: object) -> str:
        raise ValueError("full")

    turns.submit(fail, done=ended.append)
    turns.submit(lambda token, report: "two", done=ended.append)
    runner.go()
    runner.go()
    assert ended == ["two"]
    assert str(notify.tell_error.call_args[0][0]) == "full"


def test_cancelling_one_leaves_the_next(held: tuple[Held, SerialQueue, MagicMock]) -> None:
    runner, turns, _ = held
    ended: list[str] = []
    turns.submit(lambda token, report: "one", done=ended.append, cancelled=lambda: None)
    turns.submit(lambda token, report: "two", done=ended.append)
    runner.stop()
    runner.go()
    assert ended == ["two"]


def test_an_answer_may_ask_for_more(held: tuple[Held, SerialQueue, MagicMock]) -> None:
    runner, turns, _ = held
    ended: list[str] = []

    def again(answer: str) -> None:
        ended.append(answer)
        turns.submit(lambda token, report: "more", done=ended.append)

    turns.submit(lambda token, report: "one", done=again)
    runner.go()
    runner.go()
    assert ended == ["one", "more"]
