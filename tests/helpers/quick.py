"""Which of a test's many cases run each time; the others are slow, or belong to the sweeps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["quick_first", "sample_first"]


def quick_first(values: Iterable[Any], quick: int = 2) -> list[Any]:
    """Give the values of a parameter back, all but the first few of them as slow ones.

    Args:
        values: One for each case; tuples where the test has several parameters.
        quick: How many cases run with the ordinary tests.

    Returns:
        For `pytest.mark.parametrize`.
    """
    return _later(list(values), quick, pytest.mark.slow)


def sample_first(values: Iterable[Any], sample: int) -> list[Any]:
    """Give the values of a slow test's parameter back, all but the first few for the sweeps.

    Args:
        values: See `quick_first`.
        sample: How many cases every change is checked with.

    Returns:
        For `pytest.mark.parametrize`.
    """
    return _later(list(values), sample, pytest.mark.sweep)


def _later(values: list[Any], first: int, mark: pytest.MarkDecorator) -> list[Any]:
    return values[:first] + [
        pytest.param(*(each if isinstance(each, tuple) else (each,)), marks=mark)
        for each in values[first:]
    ]
