"""Which of a test's many cases run each time; the others are among the slow tests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["quick_first"]


def quick_first(values: Iterable[Any], quick: int = 2) -> list[Any]:
    """Give the values of a parameter back, all but the first few of them as slow ones.

    Args:
        values: One for each case; tuples where the test has several parameters.
        quick: How many cases run with the ordinary tests.

    Returns:
        For `pytest.mark.parametrize`.
    """
    found: list[Any] = list(values)
    slow = [
        pytest.param(*(each if isinstance(each, tuple) else (each,)), marks=pytest.mark.slow)
        for each in found[quick:]
    ]
    return found[:quick] + slow
