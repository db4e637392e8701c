"""Cancelling and reporting."""

from __future__ import annotations

import threading

import pytest

from app.core.base.errors import Cancelled
from app.core.base.progress import Token, silent, span


def test_token_goes_from_no_to_yes_and_stays() -> None:
    token = Token()
    token.check()
    states = [token.cancelled]
    for _ in range(2):
        token.cancel()
        states.append(token.cancelled)
    assert states == [False, True, True]
    with pytest.raises(Cancelled):
        token.check()
    with pytest.raises(Cancelled):
        token.check()


def test_token_is_seen_by_another_thread() -> None:
    token = Token()
    stopped = threading.Event()

    def work() -> None:
        while not token.cancelled:
            stopped.wait(0.001)
        stopped.set()

    thread = threading.Thread(target=work)
    thread.start()
    token.cancel()
    thread.join(120.0)
    assert stopped.is_set()


def test_span_maps_a_part_onto_the_whole_and_clips() -> None:
    said: list[tuple[float, str]] = []

    def report(fraction: float, message: str) -> None:
        said.append((fraction, message))

    part = span(report, 0.2, 0.6)
    for fraction in (0.0, 0.5, 1.0, -3.0, 7.0):
        part(fraction, "x")
    assert [fraction for fraction, _ in said] == pytest.approx([0.2, 0.4, 0.6, 0.2, 0.6])
    assert {message for _, message in said} == {"x"}


def test_silent_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    silent(0.5, "rendering")
    assert capsys.readouterr() == ("", "")
